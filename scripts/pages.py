"""Tables of the documentation's pages."""

from collections.abc import Iterable, Sequence


def markdown(heading: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Write a table as Markdown: columns of numbers to the right, the others to the left."""
    cells = [[str(cell) for cell in row] for row in rows]
    columns = zip(*cells, strict=True)
    sides = ["---:" if all(cell[:1] in "+-0123456789" for cell in column) else "---" for column in columns]
    return "".join(f"| {' | '.join(line)} |\n" for line in [heading, sides, *cells])
