"""Figs 4, 9, 10 and 11: the excitation, and responses by the schemes of Fig. 8 beside the certified one."""

from __future__ import annotations

from functools import partial
from typing import Final, NamedTuple

import numpy as np

from rocking.arrays import Floats
from rocking.chattering.paper.case import CYCLES, ETA, OMEGA, PERIOD, block, dense_times, excitation, simulated
from rocking.chattering.paper.figure import PaperFigure, Statement, Table
from rocking.chattering.theory.amplitude import critical_amplitude
from rocking.chattering.theory.duration import chattering_time
from rocking.plot.histories import Detail, Mark, excitation_figure, history_figure
from rocking.response import Response
from rocking.treatment import AsymptoticTime, Certified, Treatment, VelocityThreshold

_COMPLETE: Final = 1.03
_INCOMPLETE: Final = 1.05

#: Arcs of less than this share of the period are not drawn point by point.
_SHORTEST: Final = 1e-4


class _Scheme(NamedTuple):
    """A scheme by its name in tables and its label in figures."""

    label: str
    treatment: Treatment


_SCHEMES: Final = {
    "certified": _Scheme("certified", Certified()),
    "chattering_threshold": _Scheme("chattering threshold (Eq. 65)", AsymptoticTime()),
    "veltol_5e-10": _Scheme(r"$VelTol/(p\alpha) = 5\cdot 10^{-10}$", VelocityThreshold(5e-10)),
    "veltol_5e-2": _Scheme(r"$VelTol/(p\alpha) = 5\cdot 10^{-2}$", VelocityThreshold(5e-2)),
}


class _View(NamedTuple):
    """What is shown of a history: limits of the rotation, and the inset."""

    limits: tuple[float, float]
    detail: Detail


_VIEWS: Final = {
    9: _View((-1.15e-3, 2.7e-3), Detail((0.44, 0.6), (-1.5e-4, 1.5e-4), (0.3, 0.66, 0.62, 0.32))),
    10: _View((-1.15e-3, 2.7e-3), Detail((0.552, 0.574), (-3e-6, 3e-6), (0.3, 0.66, 0.62, 0.32))),
    11: _View((-17e-3, 9.5e-3), Detail((0.36, 0.8), (-1.6e-3, 1.6e-3), (0.06, 0.13, 0.38, 0.34))),
}


def figure_4() -> PaperFigure:
    """Excitation of amplitude 1.03, with the first two initiations and the time to rest between them."""
    response = simulated(_COMPLETE, "certified")
    time = np.linspace(0.0, CYCLES, 1001)
    uplifts, rests = (response.events["time"][response.events["kind"] == kind] / PERIOD for kind in ("uplift", "rest"))
    statements = (
        Statement("from the 1st to the 2nd initiation, over T/2", 1.0, 2.0 * float(uplifts[1] - uplifts[0])),
        Statement("chattering time over T/2", "below 1", 2.0 * float(rests[0] - uplifts[0])),
    )
    acceleration = _acceleration(_COMPLETE, time)
    return PaperFigure(
        4,
        "excitation",
        {"excitation": {"time_over_period": time, "acceleration_over_g_alpha": acceleration}},
        statements,
        partial(
            excitation_figure,
            time=time,
            acceleration=acceleration,
            marks=_initiations({"certified": response}),
            rest=float(rests[0]),
            title=_title(_COMPLETE),
        ),
    )


def figure_9() -> PaperFigure:
    """Response at a = 1.03 by the scheme that rests after Eq. 65's time."""
    responses = _responses(_COMPLETE, ("certified", "chattering_threshold"))
    time = float(chattering_time(_COMPLETE, OMEGA, ETA, method="asymptotic"))
    scheme = _first(responses["chattering_threshold"])
    statements = (
        Statement("a_cr (paper: Eq. 76)", 1.038, float(critical_amplitude(OMEGA, ETA))),
        Statement("time from uplift to rest (paper: Eq. 65)", time, float(chattering_time(_COMPLETE, OMEGA, ETA))),
        Statement("rest of the scheme, at its first impact past Eq. 65", "approximately after tau_ch", scheme),
        Statement("rests in 2.5 T, though the excitation goes on", "shown", float(_rests(responses["certified"]))),
    )
    return _history(9, "response with the chattering threshold", _COMPLETE, responses, statements)


def figure_10() -> PaperFigure:
    """Complete chattering at a = 1.03: both schemes rest, as they should."""
    names = ("chattering_threshold", "veltol_5e-10")
    responses = _responses(_COMPLETE, ("certified", *names))
    certified = responses["certified"]
    statements = [Statement("complete chattering, as a is below a_cr", "yes", "yes" if _rests(certified) else "no")]
    for name in names:
        response = responses[name]
        statements += [
            Statement(
                f"{_words(name)}: rests in 2.5 T (certified: {_rests(certified)})", "shown", float(_rests(response))
            ),
            Statement(
                f"{_words(name)}: first rest, after certified, s",
                '"properly"',
                _first(response) - _first(certified),
                digits=3,
            ),
        ]
    return _history(10, "complete chattering by both schemes", _COMPLETE, responses, tuple(statements))


def figure_11() -> PaperFigure:
    """Incomplete chattering at a = 1.05: a coarse velocity threshold rests where the block does not."""
    responses = _responses(_INCOMPLETE, tuple(_SCHEMES))
    coarse, certified = responses["veltol_5e-2"], responses["certified"]
    statements = (
        Statement("rests in 2.5 T, as a is above a_cr: incomplete chattering", 0.0, float(_rests(certified))),
        *(
            Statement(f"{_words(name)}: rests in 2.5 T", 0.0, float(_rests(responses[name])))
            for name in ("chattering_threshold", "veltol_5e-10")
        ),
        Statement(f"{_words('veltol_5e-2')}: rests in 2.5 T, all wrong", "shown", float(_rests(coarse))),
        Statement(f"{_words('veltol_5e-2')}: first wrong rest, s after uplift", "shown", _first(coarse)),
        Statement(
            f"{_words('veltol_5e-2')}: peak rotation over the certified one",
            '"completely different"',
            coarse.peak_rotation / certified.peak_rotation,
            digits=4,
        ),
    )
    return _history(11, "incomplete chattering, and a wrong rest", _INCOMPLETE, responses, statements)


def _responses(a: float, names: tuple[str, ...]) -> dict[str, Response]:
    return {name: simulated(a, _SCHEMES[name].treatment) for name in names}


def _history(
    number: int, title: str, a: float, responses: dict[str, Response], statements: tuple[Statement, ...]
) -> PaperFigure:
    end, shortest = CYCLES * PERIOD, _SHORTEST * PERIOD
    dense = [dense_times(response.impacts["time"], end, shortest=shortest) for response in responses.values()]
    seconds = np.unique(np.concatenate(dense))
    time = seconds / PERIOD
    rotations = {name: r.rotation(seconds) / r.block.sides[0].alpha for name, r in responses.items()}
    acceleration = _acceleration(a, time)
    history = {"time_over_period": time, "acceleration_over_g_alpha": acceleration}
    history |= {f"rotation_over_alpha_{name}": rotation for name, rotation in rotations.items()}
    view = _VIEWS[number]
    return PaperFigure(
        number,
        title,
        {"history": history, "events": _events(responses)},
        statements,
        partial(
            history_figure,
            time=time,
            rotations={_SCHEMES[name].label: rotation for name, rotation in rotations.items()},
            acceleration=acceleration,
            limits=view.limits,
            detail=view.detail,
            marks=_initiations(responses),
            title=_title(a),
        ),
    )


def _events(responses: dict[str, Response]) -> Table:
    """Uplifts and rests of all schemes in one table."""
    names = [name for name, response in responses.items() for _ in response.events]
    events = np.concatenate([response.events for response in responses.values()])
    return {"scheme": np.array(names), "kind": events["kind"], "time_over_period": events["time"] / PERIOD}


def _initiations(responses: dict[str, Response]) -> tuple[Mark, ...]:
    """First two uplifts from rest, of the scheme that rests most often."""
    most = max(responses.values(), key=_rests)
    times = most.events["time"][most.events["kind"] == "uplift"][:2] / PERIOD
    return tuple(
        Mark(float(time), text) for time, text in zip(times, ("1st initiation", "2nd initiation"), strict=True)
    )


def _acceleration(a: float, time_over_period: Floats) -> Floats:
    rocking = block()
    return excitation(a).acceleration(time_over_period * PERIOD) / (rocking.gravity * rocking.sides[0].alpha)


def _first(response: Response) -> float:
    """Time from the first uplift to the first rest."""
    events = response.events
    return float(events["time"][events["kind"] == "rest"][0] - events["time"][0])


def _rests(response: Response) -> int:
    return int(np.sum(response.events["kind"] == "rest"))


def _words(name: str) -> str:
    return name.replace("_", " ").replace("veltol", "VelTol/(p alpha) =")


def _title(a: float) -> str:
    return rf"$a$ = {a:g}, $\omega$ = {OMEGA:g}, $\eta$ = {ETA:g}"
