"""Files of the page: its own, and the plotting library's that the installed package brings along."""

from __future__ import annotations

from importlib import metadata, resources, util
from pathlib import Path
from typing import Final

from rocking.errors import InvalidOption

#: Types of the page's own files.
TYPES: Final = {
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}

#: Files of the library, in the order in which they are loaded.
LIBRARY: Final = ("bokeh.min.js", "bokeh-api.min.js")

_NEEDED: Final = "the explorer needs packages that are not installed: pip install 'rocking[explorer]'"


def page_files() -> dict[str, bytes]:
    """Return the page's own files by name."""
    folder = resources.files("rocking.explorer") / "page"
    return {file.name: file.read_bytes() for file in folder.iterdir() if Path(file.name).suffix in {*TYPES, ".html"}}


def library_folder() -> Path:
    """Return where the plotting library lies in its installed package, without importing that.

    Raises
    ------
    InvalidOption
        If it is not installed, or in a version for which the page was not made.
    """
    found = util.find_spec("bokeh")
    if found is None or not found.submodule_search_locations:
        raise InvalidOption(_NEEDED)
    version = metadata.version("bokeh")
    if version.split(".")[0] != "3":
        raise InvalidOption(f"the explorer needs bokeh 3.9 or a later 3, not {version}: pip install 'bokeh>=3.9,<4'")
    folder = Path(found.submodule_search_locations[0]) / "server" / "static" / "js"
    if not all((folder / name).is_file() for name in LIBRARY):
        raise InvalidOption(f"bokeh {version} is not installed completely: install it again")
    return folder


def require_packages() -> None:
    """Check that what the explorer needs is installed.

    Raises
    ------
    InvalidOption
        If it is not.
    """
    if any(util.find_spec(name) is None for name in ("starlette", "uvicorn")):
        raise InvalidOption(_NEEDED)
    library_folder()
