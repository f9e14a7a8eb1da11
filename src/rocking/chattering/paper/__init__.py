"""The paper's figures, redrawn from computation, with the data and with what the paper states about them in numbers."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

from rocking.chattering.paper.amplitudes import figure_5, figure_6, figure_7
from rocking.chattering.paper.figure import PaperFigure, Statement
from rocking.chattering.paper.histories import figure_4, figure_9, figure_10, figure_11
from rocking.chattering.paper.sequences import figure_2, figure_3
from rocking.errors import InvalidOption

#: The figures that show computed results; 1 is a sketch of the block and 8 a flowchart.
FIGURES: Final = MappingProxyType(
    {
        2: figure_2,
        3: figure_3,
        4: figure_4,
        5: figure_5,
        6: figure_6,
        7: figure_7,
        9: figure_9,
        10: figure_10,
        11: figure_11,
    }
)


def paper_figure(number: int) -> PaperFigure:
    """Compute one of the paper's figures.

    Parameters
    ----------
    number : int
        2 to 7 or 9 to 11; Fig. 1 is a sketch of the block and Fig. 8 a flowchart.

    Returns
    -------
    PaperFigure
        Its data, what the paper states about it in numbers, and a way to draw and to write it.

    Raises
    ------
    InvalidOption
        If there is no such figure.

    Examples
    --------
    >>> figure = paper_figure(7)
    >>> spread = figure.statements[0]
    >>> spread.claim, spread.paper, round(spread.here, 2)
    ('spread of a_cr from omega = 0.5 to 8, %', 0.5, 0.52)
    """
    if number not in FIGURES:
        known = ", ".join(map(str, FIGURES))
        raise InvalidOption(f"the paper's figures that show results are {known}, not {number!r}")
    return FIGURES[number]()


__all__ = ["FIGURES", "PaperFigure", "Statement", "paper_figure"]
