"""The paper's figures by their numbers."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Final

from block_responses import figure_1, figure_4, figure_8, figure_9, figure_10, figure_11
from figure import PaperFigure
from theory import figure_2, figure_3, figure_5, figure_6, figure_7

from rocking.errors import OptionError

#: All figures of the paper. A figure accepts the parameters that it depends on; their defaults are the paper's values.
FIGURES: Final[dict[int, Callable[..., PaperFigure]]] = {
    1: figure_1,
    2: figure_2,
    3: figure_3,
    4: figure_4,
    5: figure_5,
    6: figure_6,
    7: figure_7,
    8: figure_8,
    9: figure_9,
    10: figure_10,
    11: figure_11,
}


def paper_figure(number: int, **parameters: float) -> PaperFigure:
    """Compute one of the paper's figures, for the paper's parameters or for others.

    Parameters are a (amplitude of the ground acceleration over g alpha), omega (its frequency over the block's p), eta
    (coefficient of restitution), p (rad/s) and alpha (slenderness, rad); a figure accepts those that it depends on.
    """
    if number not in FIGURES:
        raise OptionError(f"the paper has Figs 1 to {len(FIGURES)}, not {number}")
    accepted = [*inspect.signature(FIGURES[number]).parameters]
    strange = [name for name in parameters if name not in accepted]
    if strange:
        has = f"it accepts {', '.join(accepted)}" if accepted else "it is drawn in one way only"
        raise OptionError(f"Fig. {number} does not depend on {', '.join(strange)}; {has}")
    return FIGURES[number](**parameters)
