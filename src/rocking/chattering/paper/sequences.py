"""Figs 2 and 3: one chattering sequence, and the ratios of its intervals."""

from __future__ import annotations

from functools import partial
from typing import Final

import numpy as np

from rocking.chattering.asymptotic import first_impact_speed, first_interval
from rocking.chattering.duration import interval_ratios, sequence
from rocking.chattering.paper.case import dense_times, simulated
from rocking.chattering.paper.figure import PaperFigure, Statement
from rocking.plot.sequences import Ratios, chattering_figure, ratio_figure

#: Impact at which the detail of Fig. 2(c) starts, and the one from which the paper calls the ratios of Fig. 3 constant.
_LATE: Final = 60

_RATIOS: Final = 100
_CASES: Final = ((1.01, 5.0, 0.92), (1.03, 2.0, 0.86))


def figure_2() -> PaperFigure:
    """Chattering oscillations at a = 1.03, omega = 2, eta = 0.92, from uplift to rest."""
    chattering = sequence(1.03, 2.0, 0.92)
    response = simulated(1.03, "certified")
    uplift = response.events["time"][0]
    time = dense_times(chattering.impacts["time"], chattering.time)
    rotation = response.rotation(uplift + time) / response.block.sides[0].alpha
    first = chattering.impacts[0]
    statements = (
        Statement("complete chattering: at rest in finite time", "yes", _yes(chattering.complete)),
        Statement("impacts until rest", "infinitely many", f"{chattering.impacts.size} resolved, the rest summed"),
        Statement("chattering time", "finite", chattering.time),
        Statement("width of the bracket on it", "none given", chattering.upper - chattering.lower),
        Statement("first interval (Eq. 32, mended)", float(first_interval(1.03, 2.0)), float(first["interval"])),
        Statement("speed at the first impact (Eq. 34)", float(first_impact_speed(1.03, 2.0)), first["speed_before"]),
    )
    return PaperFigure(
        2,
        "chattering oscillations",
        {
            "history": {"tau": time, "phi": rotation},
            "impacts": {name: chattering.impacts[name] for name in chattering.impacts.dtype.names or ()},
        },
        statements,
        partial(
            chattering_figure,
            time=time,
            rotation=rotation,
            impact_times=chattering.impacts["time"],
            rest=chattering.time,
            late_impact=_LATE - 1,
        ),
    )


def figure_3() -> PaperFigure:
    """Ratios of the intervals between every second impact, which tend to eta^2."""
    ratios = [interval_ratios(*case, _RATIOS) for case in _CASES]
    titles = [rf"$a$ = {a:g}, $\omega$ = {omega:g}, $\eta$ = {eta:g}" for a, omega, eta in _CASES]
    statements = []
    for (a, omega, eta), values in zip(_CASES, ratios, strict=True):
        name = f"a = {a:g}, omega = {omega:g}, eta = {eta:g}"
        apart = np.max(np.abs(values[_LATE:] / eta**2 - 1.0))
        statements += [
            Statement(f"{name}: limit of the ratio, eta^2 (Eq. 73)", eta**2, float(values[-1])),
            Statement(f"{name}: largest relative distance from it for n >= {_LATE}", '"constant"', float(apart)),
        ]
    return PaperFigure(
        3,
        "ratio of intervals",
        {"ratios": {"n": np.arange(_RATIOS), "ratio_a": ratios[0], "ratio_b": ratios[1]}},
        tuple(statements),
        partial(
            ratio_figure,
            [Ratios(values, case[2] ** 2, title) for values, case, title in zip(ratios, _CASES, titles, strict=True)],
        ),
    )


def _yes(truth: bool) -> str:
    return "yes" if truth else "no"
