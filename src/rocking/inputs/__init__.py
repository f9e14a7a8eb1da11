"""Inputs, each declared once: options, keys of study files, fields of the page and Python text are made from them."""
