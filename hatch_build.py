"""What a wheel holds that is not in the tree: a README for the package index, and libraries of compiled kernels."""

from __future__ import annotations

import re
import runpy
import subprocess
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

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
    """Builds the libraries of compiled kernels, into the source tree, and puts them into the wheel."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """List the packages that compile, where something must be compiled."""
        requirements: list[str] = self._libraries()["dependencies"]()
        return requirements

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the libraries, name the platform and, but for an editable installation, list the files."""
        libraries = self._libraries()
        try:
            files = libraries["build"]()
        except (libraries["BuildError"], subprocess.CalledProcessError) as error:
            self.app.abort(f"the kernels of rocking could not be compiled: {error}")
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{libraries['tag']()}"
        if version == "standard":
            for file in files:
                build_data["force_include"][str(file)] = str(file.relative_to(Path(self.root) / "src"))

    def _libraries(self) -> dict[str, Any]:
        return runpy.run_path(str(Path(self.root) / "compiling" / "libraries.py"))
