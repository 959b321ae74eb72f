"""What people read: tables, numbers, the chart, the paper, the page, the terminal."""
