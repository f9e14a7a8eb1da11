"""Figs 2 and 3: one chattering sequence, and the ratios of its intervals."""

from __future__ import annotations

import math
from functools import partial
from typing import Final

import numpy as np

from rocking.chattering.paper.case import ETA, OMEGA, dense_times, simulated
from rocking.chattering.paper.figure import PaperFigure, Statement
from rocking.chattering.theory.asymptotic import first_impact_speed, first_interval
from rocking.chattering.theory.duration import interval_ratios, sequence
from rocking.plot.sequences import Ratios, chattering_figure, ratio_figure

#: Impact at which the detail of Fig. 2(c) starts, and the one from which the paper calls the ratios of Fig. 3 constant.
_LATE: Final = 60

_A: Final = 1.03

_RATIOS: Final = 100
_CASES: Final = ((1.01, 5.0, 0.92), (1.03, 2.0, 0.86))


def figure_2() -> PaperFigure:
    """Chattering oscillations at a = 1.03, omega = 2, eta = 0.92, from uplift to rest."""
    chattering = sequence(_A, OMEGA, ETA)
    response = simulated(_A, "certified")
    uplift = response.events["time"][0]
    time = dense_times(chattering.impacts["time"], chattering.time)
    rotation = response.rotation(uplift + time) / response.block.sides[0].alpha
    first = chattering.impacts[0]
    statements = (
        Statement("complete chattering: at rest in finite time", "yes", _yes(chattering.complete)),
        Statement("chattering time", '"finite"', chattering.time, digits=13),
        Statement("bracket on it narrower than 2e-12", "none given", _yes(chattering.upper - chattering.lower < 2e-12)),
        Statement(
            "first interval (paper: Eq. 32 as printed)", _eq32_as_printed(_A - 1.0, OMEGA), float(first["interval"])
        ),
        Statement("the same (paper: Eq. 32 mended)", float(first_interval(_A, OMEGA)), float(first["interval"])),
        Statement(
            "speed at the first impact (paper: Eq. 34)",
            float(first_impact_speed(_A, OMEGA)),
            float(first["speed_before"]),
        ),
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
            Statement(
                f"{name}: largest relative distance from it for n >= {_LATE}", '"constant"', float(apart), digits=2
            ),
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


def _eq32_as_printed(eps: float, omega: float) -> float:
    """Eq. 32 with the paper's 32/5, where 32/15 is right: Phi^(6) enters at the same order as Phi^(5)."""
    second = 1.0 - 32.0 * (omega**2 - 1.0) / (5.0 * omega**2)
    return math.sqrt(2.0 * eps) / omega * (4.0 + second * eps)


def _yes(truth: bool) -> str:
    return "yes" if truth else "no"
