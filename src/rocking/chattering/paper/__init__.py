"""The paper's figures, redrawn from computation, with the data and with what the paper states about them in numbers."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Hashable, Mapping
from types import MappingProxyType
from typing import Final

from rocking import checks
from rocking.chattering.paper.figure import PaperFigure, Statement
from rocking.chattering.paper.responses import figure_1, figure_4, figure_8, figure_9, figure_10, figure_11
from rocking.chattering.paper.theory import figure_2, figure_3, figure_5, figure_6, figure_7
from rocking.errors import InvalidOption

#: All figures of the paper. A figure takes those parameters that it depends on; their defaults are the paper's values.
FIGURES: Final[Mapping[int, Callable[..., PaperFigure]]] = MappingProxyType(
    dict(
        enumerate(
            (
                figure_1, figure_2, figure_3, figure_4, figure_5, figure_6,
                figure_7, figure_8, figure_9, figure_10, figure_11,
            ),
            start=1,
        )
    )
)  # fmt: skip


def paper_figure(
    number: int,
    *,
    a: float | None = None,
    omega: float | None = None,
    eta: float | None = None,
    p: float | None = None,
    alpha: float | None = None,
) -> PaperFigure:
    """Compute one of the paper's figures, for the paper's parameters or for others.

    Parameters
    ----------
    number : int
        1 to 11.
    a : float, optional
        Amplitude of the ground acceleration over g alpha, above 1: Figs 2 to 4 and 9 to 11.
    omega : float, optional
        Its frequency over the block's p: Figs 2 to 5 and 9 to 11.
    eta : float, optional
        Coefficient of restitution, below 1: Figs 2 to 5, 7 and 9 to 11.
    p : float, optional
        The block's frequency parameter, rad/s: Figs 2 and 9 to 11, whose data are in seconds, too.
    alpha : float, optional
        Its slenderness, rad: Fig. 1, and Figs 2 and 9 to 11, whose data are in rad, too.

    Returns
    -------
    PaperFigure
        Its data, what the paper states about it in numbers, and a way to draw and to write it.

    Raises
    ------
    InvalidOption
        If there is no such figure, it does not depend on a parameter that is given, or a parameter is out of its range.

    Warns
    -----
    OutsideFit
        Where the figure shows Eq. 76 or 77 beyond the frequencies and restitutions that they were fitted to.

    Examples
    --------
    >>> figure = paper_figure(7)
    >>> spread = figure.statements[0]
    >>> spread.claim, spread.paper, round(spread.here, 2)
    ('spread of a_cr from omega = 0.5 to 8, %', 0.5, 0.52)
    >>> paper_figure(7, eta=0.8).caption
    'Fig. 7: critical amplitude against frequency; eta = 0.8'
    """
    if not isinstance(number, Hashable) or number not in FIGURES:
        raise InvalidOption(f"the paper has Figs 1 to {len(FIGURES)}, not {checks.shown(number)}")
    figure = FIGURES[number]
    given = {"a": a, "omega": omega, "eta": eta, "p": p, "alpha": alpha}
    chosen = {name: value for name, value in given.items() if value is not None}
    taken = inspect.signature(figure).parameters
    strange = [name for name in chosen if name not in taken]
    if strange:
        takes = f"it takes {_listed([*taken])}" if taken else "it is drawn in one way only"
        raise InvalidOption(f"Fig. {number} does not depend on {_listed(strange)}; {takes}")
    return figure(**chosen)


def _listed(names: list[str]) -> str:
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


__all__ = ["FIGURES", "PaperFigure", "Statement", "paper_figure"]
