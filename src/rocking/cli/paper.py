"""`rocking paper`: the paper's figures, redrawn from computation."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from rocking.chattering.paper import FIGURES, paper_figure
from rocking.cli.options import OUTPUT, QuietOptions, output_folder


def paper(*, out: Path, figure: int | None = None, output: Annotated[QuietOptions, OUTPUT] = QuietOptions()) -> None:
    """Redraw the paper's figures from computation: PDF, PNG, the data as CSV, and what the paper states in numbers.

    Parameters
    ----------
    out
        Folder for the files.
    figure
        Number of one figure; all of them by default.
    """
    with output_folder(out) as folder:
        for number in FIGURES if figure is None else [figure]:
            drawn = paper_figure(number)
            print(f"Fig. {drawn.number}: {drawn.title}")
            for statement in drawn.statements:
                print(f"  {statement.claim}: {statement.shown()}")
            for path in drawn.write(folder):
                print(f"  {path}")
