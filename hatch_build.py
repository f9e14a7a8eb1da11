"""The README as a package index shows it: there no file of the project stands beside it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

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
