"""What a wheel holds that is not in the tree: a README for the package index, and libraries of compiled kernels."""

from __future__ import annotations

import json
import re
import runpy
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface
from packaging.tags import platform_tags

#: A picture on a line of its own, and a link, where what they lead to is a file of the project.
_PICTURE = re.compile(r"^!\[[^\]]*\]\((?!https?:)[^)]*\)\n+", re.MULTILINE)
_LINK = re.compile(r"\[([^\]]*)\]\((?!https?:)([^)]*)\)")


def for_index(readme: str) -> str:
    """Return a README without its pictures, and with the paths of files instead of links to them.

    Examples
    --------
    >>> for_index("More ([a page](docs/page.md)), and [NOTES.md](NOTES.md).")
    'More (a page, `docs/page.md` in the source), and `NOTES.md` in the source.'
    """
    return _LINK.sub(_named, _PICTURE.sub("", readme))


def _named(link: re.Match[str]) -> str:
    text, path = link.groups()
    return f"`{path}` in the source" if text == path else f"{text}, `{path}` in the source"


class ReadmeHook(MetadataHookInterface):
    """Sets the readme of the package's metadata."""

    PLUGIN_NAME = "custom"

    def update(self, metadata: dict[str, Any]) -> None:
        """Put the README for the index where the project's table says that it is dynamic."""
        text = for_index((Path(self.root) / "README.md").read_text("utf-8"))
        metadata["readme"] = {"content-type": "text/markdown", "text": text}


class KernelsHook(BuildHookInterface[Any]):
    """Puts libraries of kernels into the wheel where `scripts/ship_kernels.py` has made them; it compiles nothing."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Name the files and the platform. Versions of Python and numba do not matter to the libraries."""
        folder = Path(self.root) / "build" / "shipped"
        if version != "standard" or self.target_name != "wheel" or not (folder / "manifest.json").exists():
            return
        manifest = json.loads((folder / "manifest.json").read_text("utf-8"))
        # Another platform's, where machines share the tree: pip would make a wheel that it refuses to install.
        if manifest["platform"] not in platform_tags():
            return
        # Python would leave them aside, and have numba compile: a wheel for every platform says as much.
        kernels = Path(self.root) / "src" / "rocking" / "kernels"
        if manifest["sources"] != runpy.run_path(str(kernels / "sources.py"))["sources"](kernels):
            self.app.display_warning(
                f"{folder} holds kernels that were made from other sources: the wheel holds none. To renew them run "
                "scripts/ship_kernels.py"
            )
            return
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{manifest['platform']}"
        for name in ("manifest.json", *manifest["libraries"]):
            build_data["force_include"][str(folder / name)] = f"rocking/kernels/shipped/{name}"
