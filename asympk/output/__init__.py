"""Output: tables, numbers and figures of the paper, the site, the text of the terminal, and stand-alone modules."""
