"""Sphinx configuration; the pages load nothing from the network."""

import re
from importlib.metadata import version as installed_version

import sphinx.ext.autosummary
from sphinx_gallery.sorting import ExplicitOrder

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
    "sphinx_gallery.gen_gallery",
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

GALLERY = ["paper", "museum", "threshold", "bouncing_ball", "chaos", "pulse_map", "frame", "sizes", "ten_thousand"]
GALLERY += ["precarious_rock", "statue", "calibration"]
sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "filename_pattern": "",
    "ignore_pattern": "__main__",
    "within_subsection_order": ExplicitOrder([f"{name}.py" for name in GALLERY]),
    "abort_on_example_error": True,
    "capture_repr": (),
    "image_srcset": ["2x"],
    # The same pages from every build, and nothing that nobody needs.
    "min_reported_time": 3600,
    "write_computation_times": False,
    "show_signature": False,
    "download_all_examples": False,
}

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
