"""Figs 1 and 8: the block, and flowcharts of the two schemes as this package follows them."""

from __future__ import annotations

import math
from functools import partial
from typing import Final, Literal

import numpy as np

from rocking.arrays import Floats
from rocking.chattering.paper.case import ALPHA, Case
from rocking.chattering.paper.figure import PaperFigure
from rocking.plot.flowchart import Box, Flowchart, Way, flowchart_figure
from rocking.plot.sketch import block_figure

#: Rotation of the block in Fig. 1, over its slenderness, and at most; rad.
_ROTATION: Final = 0.7
_LARGEST_ROTATION: Final = 0.25

_POINTS: Final = ("O", "right upper corner", "left upper corner", "O'", "centre of mass")

#: What both schemes do, from top to bottom, and what they do in words of their own: `limit` and `over`.
_SPINE: Final[dict[str, tuple[str, Literal["step", "decision", "end"]]]] = {
    "start": ("block at rest", "end"),
    "limit": ("", "step"),
    "uplift": ("next uplift: first time at which $\\ddot u_g$\npasses the threshold of a side", "step"),
    "lifts": ("before the end of the analysis?", "decision"),
    "arc": ("arc: Taylor series about the last event;\nits first root is the next impact", "step"),
    "lands": ("impact before the end,\nand before the block overturns?", "decision"),
    "strike": ("impact $n$ at $t_n$:  $\\dot\\theta \\leftarrow \\eta\\,\\dot\\theta$, the other pivot", "step"),
    "over": ("", "decision"),
    "still": ("no speed left,\nor time no longer advances?", "decision"),
    "rest": ("rest:  $\\theta = \\dot\\theta = 0$", "step"),
}
_END: Final = "end"

_WIDTH: Final = 2.14
_HEIGHT: Final = 0.4
_STEP: Final = 0.62

#: How far from the middle the ways run that pass other boxes by: to end and rest, to the next arc, to the next uplift.
_LEFT: Final = -1.58
_NEXT_ARC: Final = 1.32
_NEXT_UPLIFT: Final = 1.48


def figure_1(*, alpha: float = ALPHA) -> PaperFigure:
    """Sketch of the block, in its true proportions."""
    case = Case(alpha=alpha)
    upright = _points(alpha)
    rocking = _rotated(upright, min(_ROTATION * alpha, _LARGEST_ROTATION))
    columns = {
        f"{axis}_{state}_over_R": places[:, k]
        for state, places in (("upright", upright), ("rocking", rocking))
        for k, axis in enumerate("xy")
    }
    return PaperFigure(
        1,
        "rigid rocking block",
        case.words("alpha"),
        {"points": {"point": np.array(_POINTS), **columns}},
        (),
        {"block": partial(block_figure, upright=upright, rocking=rocking, title=case.symbols("alpha"))},
    )


def figure_8() -> PaperFigure:
    """Flowcharts of the schemes of Fig. 8a and 8b as `simulate` follows them."""
    charts = (
        _flowchart(
            '(a) chattering="time"',
            limit="$\\tau_{ch}$ by Eq. 65 where $1 \\leq a < a_{cr}$,\nelse infinite;  $a_{cr}$ by Eq. 76",
            over="time since uplift:\n$p\\,(t_n - t_{uplift}) \\geq \\tau_{ch}$?",
        ),
        _flowchart(
            '(b) chattering="velocity"',
            limit="threshold  $VelTol$",
            over="speed after the impact:\n$|\\dot\\theta| \\leq VelTol$?",
        ),
    )
    return PaperFigure(
        8, "flowcharts of the two schemes", "", {}, (), {"flowcharts": partial(flowchart_figure, charts)}
    )


def _flowchart(title: str, *, limit: str, over: str) -> Flowchart:
    own = {"limit": limit, "over": over}
    boxes = {
        name: Box(own.get(name, text), kind, (0.0, -_STEP * k), (_WIDTH, _HEIGHT))
        for k, (name, (text, kind)) in enumerate(_SPINE.items())
    }
    row = boxes["lands"].at[1]
    boxes[_END] = Box("end", "end", (_LEFT, row), (0.44, 0.26))
    ways = (
        Way("start", "limit"),
        Way("limit", "uplift"),
        Way("uplift", "lifts"),
        Way("lifts", "arc", "yes"),
        Way("lifts", _END, "no"),
        Way("arc", "lands"),
        Way("lands", "strike", "yes"),
        Way("lands", _END, "no"),
        Way("strike", "over"),
        Way("over", "still", "no"),
        Way("over", "rest", "yes", _LEFT),
        Way("still", "rest", "yes"),
        Way("still", "arc", "no", _NEXT_ARC),
        Way("rest", "uplift", "", _NEXT_UPLIFT),
    )
    return Flowchart(title, boxes, ways)


def _points(alpha: float) -> Floats:
    """Pivots, corners and centre of mass of an upright block, over R."""
    b, h = math.sin(alpha), math.cos(alpha)
    return np.array([(b, 0.0), (b, 2.0 * h), (-b, 2.0 * h), (-b, 0.0), (0.0, h)])


def _rotated(points: Floats, theta: float) -> Floats:
    """Return the points turned clockwise by theta about the first one."""
    cosine, sine = math.cos(theta), math.sin(theta)
    turned: Floats = points[0] + (points - points[0]) @ np.array([[cosine, -sine], [sine, cosine]])
    return turned
