"""Sphinx configuration; the pages load nothing from the network."""

import functools
import inspect
import os
import pydoc
import re
import sys
from importlib.metadata import version as installed_version
from pathlib import Path

import sphinx.ext.autosummary
from sphinx_gallery.sorting import ExplicitOrder

from rocking.explorer.standalone import build_page

sys.path.insert(0, str(Path(__file__).parent / "_extensions"))

project = "rocking"
author = "The rocking developers"
project_copyright = author
version = release = installed_version("rocking")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.intersphinx",
    "sphinx.ext.viewcode",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",
    "sphinx_design",
    "numpydoc",
    "sphinxcontrib.bibtex",
    "sphinx_copybutton",
    "commands",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build"]
templates_path = ["_templates"]

myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
# MathJax's menu could fetch its speech engine from a content network.
mathjax3_config = {"options": {"enableMenu": False}}

bibtex_bibfiles = ["references.bib"]
bibtex_default_style = "unsrtalpha"
bibtex_reference_style = "author_year"
copybutton_exclude = ".linenos, .gp, .go"

default_role = "literal"
# Inventories of other projects need the network, so that only the build for
# publication links them.
if os.environ.get("ROCKING_DOCS_INTERSPHINX"):
    intersphinx_mapping = {
        "python": ("https://docs.python.org/3", None),
        "numpy": ("https://numpy.org/doc/stable", None),
        "scipy": ("https://docs.scipy.org/doc/scipy", None),
        "xarray": ("https://docs.xarray.dev/en/stable", None),
        "pandas": ("https://pandas.pydata.org/docs", None),
        "matplotlib": ("https://matplotlib.org/stable", None),
    }

autosummary_generate = True
autosummary_ignore_module_all = False
# So that a summary does not end at the citation of an equation.
sphinx.ext.autosummary.WELL_KNOWN_ABBREVIATIONS += (
    "Eq.",
    "Eqs.",
    "Fig.",
    "Figs.",
)
autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False

GALLERY = [
    "paper",
    "museum",
    "threshold",
    "bouncing_ball",
    "chaos",
    "pulse_map",
    "frame",
    "sizes",
    "ten_thousand",
]
GALLERY += [
    "precarious_rock",
    "median_gradient",
    "statue",
    "calibration",
    "restitution_law",
]
sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "filename_pattern": "",
    "ignore_pattern": "__main__",
    "within_subsection_order": ExplicitOrder(
        [f"{name}.py" for name in GALLERY]
    ),
    "abort_on_example_error": True,
    "capture_repr": (),
    "image_srcset": ["2x"],
    # The same pages from every build, and nothing that nobody needs.
    "min_reported_time": 3600,
    "write_computation_times": False,
    "show_signature": False,
    "download_all_examples": False,
}


#: Pages of the repository's root that are included in docs/development.
INCLUDED = {
    "ARCHITECTURE.md": "architecture",
    "CONTRIBUTING.md": "contributing",
    "CHANGELOG.md": "changelog",
    "SECURITY.md": "security",
    "CODE_OF_CONDUCT.md": "conduct",
}

html_theme = "pydata_sphinx_theme"
html_title = f"rocking {version}"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_show_sphinx = False
html_show_sourcelink = False
# Summaries of what was found are fetched, which a browser refuses where pages are opened as files.
html_show_search_summary = False
html_theme_options = {
    "logo": {"text": f"rocking {version}"},
    "header_links_before_dropdown": 8,
    "navbar_align": "left",
    "search_bar_text": "Search",
    "show_toc_level": 2,
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
html_sidebars = {"index": []}
html_context = {"default_mode": "auto"}


def escape_bars(_app, _what, _name, _object, _options, lines):
    """Show |theta| in a docstring as it is; reStructuredText would take it for a substitution."""
    lines[:] = [re.sub(r"\|([^|`\s]+)\|", r"\\|\1\\|", line) for line in lines]


METHODS = (property, functools.cached_property, classmethod, staticmethod)


@functools.cache
def public_names():
    """Return the full name of every object in the reference, by short name."""
    page = (Path(__file__).parent / "api" / "index.md").read_text("utf-8")
    names = re.findall(r"^   ([\w.]+)$", page, re.MULTILINE)
    # Of two equal short names, the one of the top level.
    names.sort(key=len, reverse=True)
    return {name.rpartition(".")[2]: f"rocking.{name}" for name in names}


def link_names(_app, _what, name, _object, _options, lines):
    """Link public names in backticks, such as `Response.plot`."""
    known = public_names()

    def link(match):
        first, dot, rest = match[1].removeprefix("rocking.").partition(".")
        target = known.get(first)
        if target is None or target == name or "." in rest:
            return match[0]
        # Fields have no entry of their own.
        part = inspect.getattr_static(pydoc.locate(target), rest, None)
        if callable(part) or isinstance(part, METHODS):
            target += dot + rest
        return f":py:obj:`{match[1]} <{target}>`"

    pattern = r"(?<![:`\w])`((?:rocking\.)?\w+(?:\.\w+)*)`(?![`\w])"
    lines[:] = [re.sub(pattern, link, line) for line in lines]


def lead_within(_app, _path, _page, content):
    """Let links of an included page of the repository lead to its page here."""
    for file, page in INCLUDED.items():
        content[0] = content[0].replace(
            f"]({file})", f"](/development/{page}.md)"
        )
    content[0] = content[0].replace("](docs/", "](/")


def write_page(app, error):
    """Write the standalone page, which other pages embed."""
    if error is None and app.builder.format == "html":
        path = Path(app.outdir) / "_static" / "block.html"
        path.write_text(build_page(), "utf-8")


def setup(app):
    """Register what this file adds to Sphinx."""
    app.connect("build-finished", write_page)
    app.connect("include-read", lead_within)
    # After numpydoc, which reads the docstring at the default priority.
    app.connect("autodoc-process-docstring", escape_bars, priority=900)
    app.connect("autodoc-process-docstring", link_names, priority=901)
