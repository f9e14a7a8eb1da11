"""Sphinx configuration; the pages load nothing from the network."""

from importlib.metadata import version as installed_version

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
autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False

html_theme = "furo"
html_title = f"rocking {version}"
html_static_path = ["_static"]
html_show_sphinx = False
