"""Tables and images of the documentation's pages."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOCS = Path(__file__).resolve().parents[1] / "docs"

#: Small enough for a page.
DOTS_PER_INCH = 110


def markdown(heading: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Write a table as Markdown: columns of numbers to the right, the others to the left."""
    cells = [[str(cell) for cell in row] for row in rows]
    columns = zip(*cells, strict=True)
    sides = ["---:" if all(cell[:1] in "+-0123456789" for cell in column) else "---" for column in columns]
    return "".join(f"| {' | '.join(line)} |\n" for line in [heading, sides, *cells])


def write(tables: Mapping[str, str], images: Iterable[tuple[str, Figure]] = ()) -> None:
    """Write tables and images by their file names."""
    for name, text in tables.items():
        (DOCS / "_tables" / name).write_text(text, encoding="utf-8")
        sys.stdout.write(f"{name}\n{text}\n")
    for name, figure in images:
        path = DOCS / "_static" / name
        figure.savefig(path, dpi=DOTS_PER_INCH, pil_kwargs={"optimize": True})
        sys.stdout.write(f"{path}: {path.stat().st_size // 1000} kB\n")
