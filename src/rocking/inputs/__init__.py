"""Inputs, each declared once, as the source of options, keys of study files, fields of the page and Python code."""
