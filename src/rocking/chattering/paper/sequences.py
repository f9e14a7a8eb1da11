"""Figs 2 and 3: one chattering sequence, and the ratios of its intervals."""

from __future__ import annotations

import math
from functools import partial
from typing import Final

import numpy as np

from rocking.arrays import Floats
from rocking.chattering.paper.case import ALPHA, ETA, OMEGA, A, Case, P, dense_times, in_words
from rocking.chattering.paper.figure import PaperFigure, Statement
from rocking.chattering.theory.asymptotic import first_impact_speed, first_interval
from rocking.chattering.theory.duration import interval_ratios, sequence
from rocking.errors import InvalidOption
from rocking.plot.sequences import Ratios, chattering_figure, ratio_figure

#: Impact at which the detail of Fig. 2(c) starts, and the one from which the paper calls the ratios of Fig. 3 constant.
_LATE: Final = 60

#: Impacts that Fig. 2(c) shows after that one.
_AFTER: Final = 5

_RATIOS: Final = 100
_CASES: Final = (Case(a=1.01, omega=5.0, eta=0.92), Case(a=1.03, omega=2.0, eta=0.86))
_NAMES: Final = ("a", "omega", "eta")


def figure_2(
    *, a: float = A, omega: float = OMEGA, eta: float = ETA, p: float = P, alpha: float = ALPHA
) -> PaperFigure:
    """Chattering oscillations from uplift to rest."""
    case = Case(a, omega, eta, p, alpha)
    _require_complete(case, 2)
    chattering = sequence(a, omega, eta)
    response = case.simulated("certified")
    uplift, rest = response.events["time"][:2]
    tau = dense_times(chattering.impacts["time"], chattering.time)
    rotation = response.rotation(uplift + tau / p)
    first = chattering.impacts[0]
    resolved = int(np.sum(response.impacts["time"] <= rest))
    statements = (
        Statement("complete chattering: at rest in finite time", "yes", _yes(chattering.complete)),
        Statement("chattering time", '"finite"', chattering.time, digits=13),
        Statement("bracket on it narrower than 2e-12", None, _yes(chattering.upper - chattering.lower < 2e-12)),
        Statement(
            "first interval, p t",
            _eq32_as_printed(a - 1.0, omega),
            float(first["interval"]),
            formula="Eq. 32 as printed",
        ),
        Statement(
            "first interval, p t",
            float(first_interval(a, omega)),
            float(first["interval"]),
            formula="Eq. 32 with its slip corrected",
        ),
        Statement(
            "speed at the first impact",
            float(first_impact_speed(a, omega)),
            float(first["speed_before"]),
            formula="Eq. 34",
        ),
    )
    return PaperFigure(
        2,
        "chattering oscillations",
        case.words(*_NAMES, "p", "alpha"),
        {
            "history": {"tau": tau, "phi": rotation / alpha, "time_s": uplift + tau / p, "rotation_rad": rotation},
            "impacts": {name: chattering.impacts[name] for name in chattering.impacts.dtype.names or ()},
        },
        statements,
        {
            "sequence": partial(
                chattering_figure,
                time=tau,
                rotation=rotation / alpha,
                impact_times=chattering.impacts["time"],
                rest=chattering.time,
                late_impact=max(0, min(_LATE, resolved - _AFTER) - 1),
                title=case.symbols(*_NAMES),
            )
        },
    )


def figure_3(*, a: float | None = None, omega: float | None = None, eta: float | None = None) -> PaperFigure:
    """Ratios of the intervals between every second impact, which tend to eta^2; the paper has two cases."""
    cases = list(
        dict.fromkeys(
            Case(
                case.a if a is None else a,
                case.omega if omega is None else omega,
                case.eta if eta is None else eta,
            )
            for case in _CASES
        )
    )
    for case in cases:
        _require_complete(case, 3)
    ratios = [interval_ratios(case.a, case.omega, case.eta, _RATIOS) for case in cases]
    conditions = [case.words(*_NAMES) for case in cases]
    columns = {f"ratio_{'ab'[k]}": values for k, values in enumerate(ratios)}
    return PaperFigure(
        3,
        "ratio of intervals",
        "; ".join(conditions),
        {"ratios": {"n": np.arange(_RATIOS), **columns}},
        tuple(
            statement
            for case, values, words in zip(cases, ratios, conditions, strict=True)
            for statement in _ratio_statements(case, values, words)
        ),
        {
            "ratios": partial(
                ratio_figure,
                [
                    Ratios(values, case.eta**2, case.symbols(*_NAMES))
                    for case, values in zip(cases, ratios, strict=True)
                ],
            )
        },
    )


def _ratio_statements(case: Case, ratios: Floats, words: str) -> list[Statement]:
    """Compare the ratios with their limit; those of intervals below the range of a double are NaN."""
    limit = case.eta**2
    known = np.flatnonzero(np.isfinite(ratios))
    last = int(known[-1])
    statements = [
        Statement(f"{words}: ratio at n = {last}, and its limit", limit, float(ratios[last]), formula="Eq. 73, eta^2")
    ]
    late = ratios[known[known >= _LATE]]
    if late.size:
        apart = float(np.max(np.abs(late / limit - 1.0)))
        statements.append(
            Statement(f"{words}: largest relative distance from it for n >= {_LATE}", '"constant"', apart, digits=2)
        )
    return statements


def _require_complete(case: Case, number: int) -> None:
    if math.isnan(case.rest):
        raise InvalidOption(
            f"Fig. {number} shows complete chattering: a must be below the critical amplitude {case.critical:.9g} at "
            f"{in_words({'omega': case.omega, 'eta': case.eta})}, not {case.a:.9g}"
        )


def _eq32_as_printed(eps: float, omega: float) -> float:
    """Eq. 32 with the paper's 32/5, where 32/15 is right: Phi^(6) enters at the same order as Phi^(5)."""
    second = 1.0 - 32.0 * (omega**2 - 1.0) / (5.0 * omega**2)
    return math.sqrt(2.0 * eps) / omega * (4.0 + second * eps)


def _yes(truth: bool) -> str:
    return "yes" if truth else "no"
