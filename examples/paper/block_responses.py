"""Figs 1, 4 and 8 to 11: the block, the excitation, two schemes that end chattering, and responses by them."""

from __future__ import annotations

import math
from functools import partial
from typing import Final, Literal, NamedTuple

import numpy as np
from figure import (
    ALPHA,
    CYCLES,
    ETA,
    OMEGA,
    A,
    BlockUnderSine,
    Columns,
    P,
    PaperFigure,
    Statement,
    dense_times,
    yes_or_no,
)
from histories import Detail, Mark, excitation_figure, history_figure
from sketches import Box, Flowchart, Way, block_figure, flowchart_figure

from rocking.chattering.duration import chattering_time, critical_amplitude
from rocking.core.arrays import Floats
from rocking.engine.schemes import AsymptoticTime, Certified, ChatteringScheme, VelocityThreshold
from rocking.response import Response

#: Amplitude of Fig. 11.
_INCOMPLETE: Final = 1.05

#: Arcs of less than this share of the period, or of a detail where that is very short, are not drawn point by point.
_SHORTEST: Final = 1e-4
_SHORTEST_IN_DETAIL: Final = 1e-2

#: What the details show: from and to, counted from uplift, over the chattering time (half a period where incomplete).
_DETAILS: Final = {9: (0.64, 1.09), 10: (0.955, 1.015), 11: (0.38, 1.2)}

_SINE: Final = ("a", "omega", "eta")
_BLOCK: Final = ("p", "alpha")


class _Scheme(NamedTuple):
    """Chattering scheme, with its names in statements and in legends."""

    words: str
    label: str
    scheme: ChatteringScheme


_SCHEMES: Final = {
    "certified": _Scheme("certified", "certified", Certified()),
    "chattering_threshold": _Scheme("chattering threshold", "chattering threshold (Eq. 65)", AsymptoticTime()),
    "veltol_5e-10": _Scheme(
        "VelTol/(p alpha) = 5e-10", r"$VelTol/(p\alpha) = 5\cdot 10^{-10}$", VelocityThreshold(5e-10)
    ),
    "veltol_5e-2": _Scheme("VelTol/(p alpha) = 5e-2", r"$VelTol/(p\alpha) = 5\cdot 10^{-2}$", VelocityThreshold(5e-2)),
}


def figure_4(*, a: float = A, omega: float = OMEGA, eta: float = ETA) -> PaperFigure:
    """Excitation, with the initiations and, where chattering is complete, the time to rest between them."""
    case = BlockUnderSine(a, omega, eta)
    response = case.simulated("certified")
    time = np.linspace(0.0, CYCLES, 1001)
    marks = _initiations(case, {"certified": response})
    half_periods = _none(float(np.diff([mark.time for mark in marks])[0]) * 2.0 if len(marks) > 1 else math.nan)
    complete = not math.isnan(case.rest)
    statements = (
        Statement("from the 1st to the 2nd initiation, over T/2", 1.0 if complete else None, half_periods),
        Statement("chattering time over T/2", "below 1" if complete else None, _none(2.0 * case.rest)),
    )
    acceleration = _acceleration(case, time)
    return PaperFigure(
        4,
        "excitation",
        case.words(*_SINE),
        {"excitation": {"time_over_period": time, "acceleration_over_g_alpha": acceleration}},
        statements,
        {
            "excitation": partial(
                excitation_figure,
                time=time,
                acceleration=acceleration,
                marks=marks,
                chattering_time=case.rest,
                title=case.symbols(*_SINE),
            )
        },
    )


def figure_9(
    *, a: float = A, omega: float = OMEGA, eta: float = ETA, p: float = P, alpha: float = ALPHA
) -> PaperFigure:
    """Response by the scheme that rests after Eq. 65's time."""
    case = BlockUnderSine(a, omega, eta, p, alpha)
    responses = _responses(case, ("certified", "chattering_threshold"))
    scheme, certified = responses["chattering_threshold"], responses["certified"]
    stated = [Statement("a_cr", 1.038, case.critical)]
    statements = (
        *(stated if (omega, eta) == (OMEGA, ETA) else []),
        *(
            Statement(
                "a_cr", float(critical_amplitude(omega, eta, method=f"eq{fit}")), case.critical, formula=f"Eq. {fit}"
            )
            for fit in (76, 77)
        ),
        Statement(
            "time from uplift to rest, p t",
            float(chattering_time(a, omega, eta, method="asymptotic")),
            _none(float(chattering_time(a, omega, eta))),
            formula="Eq. 65",
        ),
        Statement(
            "rest of the scheme, p t, at its first impact past Eq. 65",
            "approximately after tau_ch",
            _none(p * _first(scheme)),
        ),
        Statement("rests in 2.5 T, though the excitation goes on", _shown(case, A), float(_rests(certified))),
    )
    return _history(9, "response with the chattering threshold", case, responses, statements)


def figure_10(
    *, a: float = A, omega: float = OMEGA, eta: float = ETA, p: float = P, alpha: float = ALPHA
) -> PaperFigure:
    """Responses by both schemes where chattering is complete: they rest, as they should."""
    case = BlockUnderSine(a, omega, eta, p, alpha)
    names = ("chattering_threshold", "veltol_5e-10")
    responses = _responses(case, ("certified", *names))
    certified = responses["certified"]
    fitted = float(critical_amplitude(omega, eta, method="eq76"))
    statements = [
        Statement(
            "complete chattering, a below a_cr",
            yes_or_no(a < fitted),
            yes_or_no(not math.isnan(case.rest)),
            formula="Eq. 76",
        )
    ]
    for name in names:
        response = responses[name]
        statements += [
            Statement(
                f"{_SCHEMES[name].words}: rests in 2.5 T (certified: {_rests(certified)})",
                _shown(case, A),
                float(_rests(response)),
            ),
            _first_rest(name, response, certified, '"properly"' if _is_papers(case, A) else None),
        ]
    return _history(10, "response by both schemes", case, responses, tuple(statements))


def figure_11(
    *, a: float = _INCOMPLETE, omega: float = OMEGA, eta: float = ETA, p: float = P, alpha: float = ALPHA
) -> PaperFigure:
    """Responses where chattering is incomplete: a coarse velocity threshold rests where the block does not."""
    case = BlockUnderSine(a, omega, eta, p, alpha)
    responses = _responses(case, tuple(_SCHEMES))
    coarse, certified = responses["veltol_5e-2"], responses["certified"]
    papers = _is_papers(case, _INCOMPLETE)
    none = 0.0 if papers else None
    statements = (
        Statement(
            "rests in 2.5 T, as a is above a_cr: incomplete chattering" if papers else "rests in 2.5 T",
            none,
            float(_rests(certified)),
        ),
        *(
            Statement(f"{_SCHEMES[name].words}: rests in 2.5 T", none, float(_rests(responses[name])))
            for name in ("chattering_threshold", "veltol_5e-10")
        ),
        Statement(
            f"{_SCHEMES['veltol_5e-2'].words}: rests in 2.5 T{', all wrong' if papers else ''}",
            _shown(case, _INCOMPLETE),
            float(_rests(coarse)),
        ),
        Statement(
            f"{_SCHEMES['veltol_5e-2'].words}: first {'wrong ' if papers else ''}rest, s after uplift",
            _shown(case, _INCOMPLETE),
            _none(_first(coarse)),
        ),
        Statement(
            f"{_SCHEMES['veltol_5e-2'].words}: peak rotation over the certified one",
            '"completely different"' if papers else None,
            coarse.peak_rotation / certified.peak_rotation,
            digits=4,
        ),
    )
    return _history(11, "response by both schemes, and by a coarse velocity threshold", case, responses, statements)


def _responses(case: BlockUnderSine, names: tuple[str, ...]) -> dict[str, Response]:
    return {name: case.simulated(_SCHEMES[name].scheme) for name in names}


def _history(
    number: int, title: str, case: BlockUnderSine, responses: dict[str, Response], statements: tuple[Statement, ...]
) -> PaperFigure:
    end, shown = CYCLES * case.period, _shown_closely(case, _DETAILS[number])
    shortest = case.period * min(_SHORTEST, _SHORTEST_IN_DETAIL * (shown[1] - shown[0]))
    dense = [dense_times(response.impacts["time"], end, shortest=shortest) for response in responses.values()]
    seconds = np.unique(np.concatenate(dense))
    time = seconds / case.period
    rotations = {name: response.rotation(seconds) for name, response in responses.items()}
    scaled = {name: rotation / case.alpha for name, rotation in rotations.items()}
    acceleration = _acceleration(case, time)
    history = {"time_over_period": time, "time_s": seconds, "acceleration_over_g_alpha": acceleration}
    history |= {f"rotation_over_alpha_{name}": rotation for name, rotation in scaled.items()}
    history |= {f"rotation_{name}_rad": rotation for name, rotation in rotations.items()}
    return PaperFigure(
        number,
        title,
        case.words(*_SINE, *_BLOCK),
        {"history": history, "events": _events(case, responses)},
        statements,
        {
            "history": partial(
                history_figure,
                time=time,
                rotations={_SCHEMES[name].label: rotation for name, rotation in scaled.items()},
                acceleration=acceleration,
                detail=_detail(case, shown, time, list(scaled.values())),
                marks=_initiations(case, responses),
                title=f"{case.symbols(*_SINE)}; {case.symbols(*_BLOCK)}",
            )
        },
    )


def _chattering(case: BlockUnderSine) -> tuple[float, float]:
    """Start and length of the first chattering, over the period; of half a period where it is incomplete."""
    return _uplift(case), 0.5 if math.isnan(case.rest) else case.rest


def _shown_closely(case: BlockUnderSine, shares: tuple[float, float]) -> tuple[float, float]:
    """Start and end of a detail, which are at these shares of the first chattering, over the period."""
    uplift, length = _chattering(case)
    return uplift + shares[0] * length, uplift + shares[1] * length


def _detail(case: BlockUnderSine, shown: tuple[float, float], time: Floats, rotations: list[Floats]) -> Detail:
    """Return what a detail shows: all rotations within its limits of time, up to the end of chattering."""
    start, end = shown
    inside = (time >= start) & (time <= min(end, sum(_chattering(case))))
    reach = 1.2 * max(float(np.max(np.abs(rotation[inside]))) for rotation in rotations)
    return Detail((start, end), (-reach, reach))


def _events(case: BlockUnderSine, responses: dict[str, Response]) -> Columns:
    """Uplifts and rests of all schemes in one table."""
    names = [name for name, response in responses.items() for _ in response.events]
    events = np.concatenate([response.events for response in responses.values()])
    times = {"time_over_period": events["time"] / case.period, "time_s": events["time"]}
    return {"scheme": np.array(names), "kind": events["kind"], **times}


def _initiations(case: BlockUnderSine, responses: dict[str, Response]) -> tuple[Mark, ...]:
    """First two uplifts from rest, of the scheme that rests most often; only one where none comes to rest.

    The first response is the certified one: what it has not got is another scheme's.
    """
    most = max(responses, key=lambda name: _rests(responses[name]))
    first, times = (_uplifts(response) for response in (next(iter(responses.values())), responses[most]))
    times = times[:2] / case.period
    whose = "" if len(first) >= len(times) else f", by {_SCHEMES[most].label} alone"
    texts = ("1st initiation", f"2nd initiation{whose}")
    return tuple(Mark(float(time), text) for time, text in zip(times, texts, strict=False))


def _uplift(case: BlockUnderSine) -> float:
    """Time of the first uplift, over the period (Eq. 12)."""
    return math.asin(1.0 / case.a) / (2.0 * math.pi)


def _acceleration(case: BlockUnderSine, time_over_period: Floats) -> Floats:
    acceleration: Floats = case.excitation().acceleration(time_over_period * case.period)
    return acceleration / (case.block().gravity * case.alpha)


def _first(response: Response) -> float:
    """Time from the first uplift to the first rest; NaN where there is none."""
    events = response.events
    rests = events["time"][events["kind"] == "rest"]
    return float(rests[0] - events["time"][0]) if rests.size else math.nan


def _uplifts(response: Response) -> Floats:
    times: Floats = response.events["time"][response.events["kind"] == "uplift"]
    return times


def _rests(response: Response) -> int:
    return int(np.sum(response.events["kind"] == "rest"))


def _is_papers(case: BlockUnderSine, a: float) -> bool:
    """Whether a figure is the paper's own, at this amplitude; of others it states nothing."""
    return case == BlockUnderSine(a)


def _shown(case: BlockUnderSine, a: float) -> str | None:
    return "shown" if _is_papers(case, a) else None


def _first_rest(name: str, response: Response, certified: Response, paper: str | None) -> Statement:
    """Say how long before or after the certified response a scheme comes to rest for the first time."""
    late = _first(response) - _first(certified)
    if math.isnan(late):
        rest = f"only {_SCHEMES[name].words} rests" if _rests(response) else "only certified rests"
        here = rest if _rests(response) or _rests(certified) else "neither rests"
        return Statement(f"{_SCHEMES[name].words}: first rest, beside that of certified", paper, here)
    side = "before" if late < 0.0 else "after"
    return Statement(f"{_SCHEMES[name].words}: first rest, s {side} that of certified", paper, abs(late), digits=3)


def _none(value: float) -> float | str:
    return "none" if math.isnan(value) else value


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
    "impact": ("impact $n$ at $t_n$:  $\\dot\\theta \\leftarrow \\eta\\,\\dot\\theta$, the other pivot", "step"),
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
    case = BlockUnderSine(alpha=alpha)
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
        Way("lands", "impact", "yes"),
        Way("lands", _END, "no"),
        Way("impact", "over"),
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
