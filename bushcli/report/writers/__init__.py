"""Documents and results -> the terminal, a page, the files of a folder."""
