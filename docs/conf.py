"""Sphinx configuration; the pages load nothing from the network."""

import re
from importlib.metadata import version as installed_version

import sphinx.ext.autosummary

project = "rocking"
author = "The rocking developers"
project_copyright = author
version = release = installed_version("rocking")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",
    "numpydoc",
]
exclude_patterns = ["_build"]
templates_path = ["_templates"]

myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence"]
myst_heading_anchors = 3
# MathJax's menu could fetch its speech engine from a content network.
mathjax3_config = {"options": {"enableMenu": False}}

autosummary_generate = True
# So that a summary does not end at the citation of an equation.
sphinx.ext.autosummary.WELL_KNOWN_ABBREVIATIONS += ("Eq.", "Eqs.", "Fig.", "Figs.")
autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False

html_theme = "furo"
html_title = f"rocking {version}"
html_static_path = ["_static"]
html_show_sphinx = False


def escape_bars(_app, _what, _name, _object, _options, lines):
    """Show |theta| in a docstring as it is; reStructuredText would take it for a substitution."""
    lines[:] = [re.sub(r"\|([^|`\s]+)\|", r"\\|\1\\|", line) for line in lines]


def setup(app):
    """Register what this file adds to Sphinx."""
    # After numpydoc, which reads the docstring at the default priority.
    app.connect("autodoc-process-docstring", escape_bars, priority=900)
