"""What people read: tables, numbers, the chart, the paper, the page, the terminal, and stand-alone modules."""
