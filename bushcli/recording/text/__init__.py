"""Bytes -> rows: encodings, lines, fields, numbers and times as written, and the table of them."""
