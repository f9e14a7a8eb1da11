"""Random blocks under horizontal and vertical motion, and single responses judged by many digits.

A case is drawn from a seed and a number: `case(seed, number)` gives the same one again. `judge` simulates it, follows
it in 32 digits by `multiprecision`, and compares all that a response says. Errors may be as large as a few units in
the last place of what was given explain, by the response's own sensitivity; what calls itself ambiguous is not judged.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from math import tan
from typing import Any

import numpy as np
from numpy.typing import NDArray

import rocking
from oracles import multiprecision
from oracles.multiprecision import Course
from oracles.problem import Problem

GRAVITY = 9.80665
ULP = 2.0**-52
DIGITS = 32
"""Errors of the oracle grow along a response as the response's own do: by less than 1e10 unless it is ambiguous."""
UNITS = 8.0
"""Errors are at most this many times what one unit in the last place of all that was given changes."""
MOST_IMPACTS = 1500
TIMES = 4
"""Instants at which rotations are compared."""
TIE = 2.0**-48
"""A motion that passes a threshold by less than this share of it may count as within it."""
ROUNDED_TIE = 1.25 * TIE
"""The same, with what four roundings of the threshold add where the weight takes nearly all of it away."""
NOTHING = 2.0**-44
"""A block that lifts off by less than this share of its slenderness, and comes to rest again, may count as at rest."""
Drawn = np.random.Generator
Pair = tuple[float, float]


@dataclass(frozen=True)
class Case:
    """One block under one motion, with a vertical component or without."""

    seed: int
    number: int
    kind: str
    model: str
    p: Pair
    alpha: Pair
    restitution: Pair
    motion: rocking.Motion
    rotation: float = 0.0
    velocity: float = 0.0

    @property
    def block(self) -> rocking.Block:
        return rocking.Block.from_parameters(p=self.p, alpha=self.alpha, restitution=self.restitution)

    @property
    def problem(self) -> Problem:
        vertical = self.motion.vertical
        pieces = None if vertical is None else (vertical.breakpoints, vertical.coefficients)
        numbers = self.p, self.alpha, self.restitution
        return Problem(self.model, *numbers, self.motion.breakpoints, self.motion.coefficients, vertical=pieces)

    def simulate(self) -> rocking.Response:
        initial = {"initial_rotation": self.rotation, "initial_velocity": self.velocity}
        return rocking.simulate(self.block, self.motion, model=self.model, **initial)

    def __str__(self) -> str:
        initial = f"rotation={self.rotation!r}, velocity={self.velocity!r}"
        return (
            f"case({self.seed}, {self.number}): {self.kind}, {self.model}, p={self.p!r}, alpha={self.alpha!r}, "
            f"restitution={self.restitution!r}, {initial}"
        )


# --- what is drawn --------------------------------------------------------------------------------------------


def case(seed: int, number: int, *, vertical: bool = True) -> Case:
    """Case of that number: p 0.5 to 20 rad/s, alpha 0.02 to 0.6, restitution 0.3 to 0.95, motions of all kinds.

    Without a vertical component the motion is a record or a pulse.
    """
    rng = np.random.default_rng([seed, number])
    model = str(rng.choice(["linear", "nonlinear"]))
    p = _log_uniform(rng, 0.5, 20.0)
    alpha = float(rng.uniform(0.02, 0.6))
    one = rng.random() < 0.6
    sides = (
        _pair(rng, one, p, p * float(np.exp(rng.uniform(-0.3, 0.3)))),
        _pair(rng, one, alpha, float(np.clip(alpha * np.exp(rng.uniform(-0.6, 0.6)), 0.02, 0.6))),
        _pair(rng, one, float(rng.uniform(0.3, 0.95)), float(rng.uniform(0.3, 0.95))),
    )
    threshold = GRAVITY * (min(sides[1]) if model == "linear" else tan(min(sides[1])))
    across = str(rng.choice(list(ACROSS) if vertical else ["record", "pulse"]))
    up = str(rng.choice(list(UP))) if vertical else "no vertical component"
    unit = 1.0 / p
    horizontal = ACROSS[across](rng, unit, threshold)
    lift = UP[up](rng, unit, horizontal) if vertical else None
    push = abs(horizontal.acceleration(0.0)) / threshold
    pressed = 1.0 + (lift.acceleration(0.0) / GRAVITY if lift else 0.0) - push
    rotation, velocity = _start(rng, sides, often=across in STILL, pressed=pressed)
    motion = horizontal.with_vertical(lift) if lift else horizontal
    return Case(seed, number, f"{across}, {up}", model, *sides, motion, rotation, velocity)


def _log_uniform(rng: Drawn, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _pair(rng: Drawn, one: bool, this: float, other: float) -> Pair:
    if one:
        return this, this
    return (this, other) if rng.random() < 0.5 else (other, this)


def _start(rng: Drawn, sides: tuple[Pair, Pair, Pair], *, often: bool, pressed: float) -> tuple[float, float]:
    """Initial rotation and velocity, mostly none; in proportion to what presses the block down where that is little."""
    p, alpha, _ = sides
    if rng.random() > (0.5 if often else 0.2):
        return 0.0, 0.0
    k = int(rng.integers(2))
    sign = 1.0 - 2.0 * k
    share = _log_uniform(rng, 1e-4, 0.9) if rng.random() < 0.5 else float(rng.uniform(0.1, 0.9))
    if 0.0 < pressed < 0.1:
        share = pressed * _log_uniform(rng, 1e-3, 1.0)
    velocity = float(rng.normal()) * min(0.3, share) * p[k] * alpha[k] if rng.random() < 0.3 else 0.0
    return sign * alpha[k] * share, velocity


def _step(rng: Drawn, unit: float) -> float:
    """Sampling step, next to the block's own unit of time or a usual one."""
    if rng.random() < 0.5:
        return _log_uniform(rng, 0.02, 0.5) * unit
    usual = np.array([0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5])
    return float(rng.choice(usual[(usual > 0.01 * unit) & (usual < 0.7 * unit)]))


def _smooth(rng: Drawn, count: int, peak: float) -> NDArray[np.float64]:
    width = int(rng.integers(1, 8))
    values = np.convolve(rng.normal(size=count + width), np.ones(width), mode="valid")[:count]
    return values * (peak / np.max(np.abs(values)))


def _times(rng: Drawn) -> float:
    """Peak acceleration over the threshold."""
    return 1.0 + 10.0 ** float(rng.uniform(-8.0, -1.0)) if rng.random() < 0.2 else float(rng.uniform(0.3, 4.0))


def _record(rng: Drawn, unit: float, threshold: float) -> rocking.Motion:
    count = int(rng.integers(10, 61))
    return rocking.Motion.from_samples(_smooth(rng, count, _times(rng) * threshold), _step(rng, unit))


def _pulse(rng: Drawn, unit: float, threshold: float) -> rocking.Motion:
    amplitude = _times(rng) * threshold * float(rng.choice([-1.0, 1.0]))
    frequency = _log_uniform(rng, 0.05, 0.8) / unit
    family = str(rng.choice(["sine", "half_sine", "one_cosine", "ricker", "triangular", "rectangular"]))
    if family == "sine":
        cycles, phase = float(rng.uniform(0.5, 3.0)), float(rng.uniform(0.0, 6.0))
        return rocking.pulses.sine(amplitude, frequency, cycles=cycles, phase=phase)
    if family in ("triangular", "rectangular"):
        return getattr(rocking.pulses, family)(amplitude, 1.0 / frequency)
    return getattr(rocking.pulses, family)(amplitude, frequency)


def _none(rng: Drawn, unit: float, threshold: float) -> rocking.Motion:
    return rocking.Motion.from_samples([0.0, 0.0], float(rng.uniform(0.5, 5.0)) * unit)


def _about_zero(rng: Drawn, unit: float, threshold: float) -> rocking.Motion:
    """A billionth of a millionth of gravity."""
    span, push = float(rng.uniform(0.5, 5.0)) * unit, 1e-15 * GRAVITY * float(rng.choice([-1.0, 1.0]))
    if rng.random() < 0.5:
        return rocking.Motion([0.0, span], [[push]])
    count = int(rng.integers(2, 20))
    return rocking.Motion.from_samples(push * rng.normal(size=count), span / count)


def _constant(rng: Drawn, unit: float, threshold: float) -> rocking.Motion:
    """Any level up to one and a half times the threshold, or just below the threshold."""
    below = float(rng.choice([-1.0, 1.0])) * (1.0 - _log_uniform(rng, 1e-10, 0.1))
    level = below if rng.random() < 0.3 else float(rng.uniform(-1.5, 1.5))
    return rocking.Motion([0.0, float(rng.uniform(0.5, 5.0)) * unit], [[level * threshold]])


ACROSS: dict[str, Callable[[Drawn, float, float], rocking.Motion]] = {
    "record": _record,
    "pulse": _pulse,
    "none": _none,
    "about zero": _about_zero,
    "constant": _constant,
}
STILL = ("none", "about zero", "constant")


def _even(horizontal: rocking.Motion, unit: float) -> float:
    return float(horizontal.breakpoints[1]) if len(horizontal.breakpoints) > 4 else 0.1 * unit


def _record_up(rng: Drawn, unit: float, horizontal: rocking.Motion) -> rocking.Motion:
    """On the same samples, a few of a record's own or of another step; up to three times gravity."""
    step = _even(horizontal, unit) * float(rng.choice([1.0, 1.0, 0.5, 1.0 / 3.0, 2.0, rng.uniform(0.3, 2.0)]))
    count = int(rng.integers(10, 61))
    return rocking.Motion.from_samples(_smooth(rng, count, _log_uniform(rng, 0.05, 3.0) * GRAVITY), step)


def _ramp(rng: Drawn, unit: float, horizontal: rocking.Motion) -> rocking.Motion:
    """The weight passes zero on a straight line, from exactly zero at a corner or between corners."""
    times = np.cumsum([0.0, *(rng.uniform(0.05, 0.6, 4) * unit)])
    deepest = -float(rng.choice([rng.uniform(1.001, 2.0), rng.uniform(2.0, 7.0)])) * GRAVITY
    corner = -GRAVITY if rng.random() < 0.6 else float(rng.uniform(-0.9, 0.5)) * GRAVITY
    start = float(rng.choice([0.0, 0.0, -GRAVITY, rng.uniform(-1.0, 1.0) * GRAVITY]))
    return rocking.Motion.from_points(times, [start, corner, deepest, 0.0, 0.0])


def _plateau(rng: Drawn, unit: float, horizontal: rocking.Motion) -> rocking.Motion:
    """No weight at all for some time; then some again, or less than none first."""
    times = np.cumsum([0.0, *(rng.uniform(0.05, 0.8, 4) * unit)])
    start = float(rng.choice([0.0, -GRAVITY, rng.uniform(-1.0, 1.0) * GRAVITY]))
    after = float(rng.choice([0.0, rng.uniform(-3.0, 2.0) * GRAVITY]))
    return rocking.Motion.from_points(times, [start, -GRAVITY, -GRAVITY, after, 0.0])


def _from_zero(rng: Drawn, unit: float, horizontal: rocking.Motion) -> rocking.Motion:
    """The weight leaves zero like a power of time, upwards or downwards, after a plateau, a fall to zero or nothing."""
    power = int(rng.choice([1, 2, 3, 4, 5, 6]))
    upwards = rng.random() < 0.7
    span = float(rng.uniform(0.1, 1.0)) * unit
    away = np.zeros(power + 1)
    away[0] = -GRAVITY
    away[power] = (1.0 if upwards else -1.0) * float(rng.uniform(0.3, 3.0)) * GRAVITY / span**power
    before = str(rng.choice(["nothing", "plateau", "fall"]))
    rows, ends = [away], [span]
    if before != "nothing":
        length = float(rng.uniform(0.05, 0.6)) * unit
        row = np.zeros(power + 1)
        row[0] = -GRAVITY if before == "plateau" else 0.0
        row[1] = 0.0 if before == "plateau" else -GRAVITY / length
        rows, ends = [row, away], [length, length + span]
    return rocking.Motion([0.0, *ends], rows)


def _steps(rng: Drawn, unit: float, horizontal: rocking.Motion) -> rocking.Motion:
    count = int(rng.integers(2, 9))
    levels = rng.choice([-1.0, -1.0, 0.0, -1.5, 0.8, -0.5, float(rng.uniform(-3.0, 2.0))], count) * GRAVITY
    return rocking.Motion(np.cumsum([0.0, *(rng.uniform(0.05, 0.8, count) * unit)]), levels[:, np.newaxis])


def _swell(rng: Drawn, unit: float, horizontal: rocking.Motion) -> rocking.Motion:
    """Smooth pulses (1 - x^2)^n, -1 <= x <= 1, of a degree up to ten, one after the other."""
    rows, ends = [], [0.0]
    for _ in range(int(rng.integers(1, 4))):
        span = float(rng.uniform(0.2, 2.0)) * unit
        x = np.polynomial.Polynomial([-1.0, 2.0 / span])
        swell = (1.0 - x * x) ** int(rng.integers(1, 6))
        peak = float(rng.choice([-1.0, rng.uniform(-4.0, 1.0), rng.uniform(-4.0, 1.0)])) * GRAVITY
        rows.append(np.pad(peak * swell.coef, (0, 11 - len(swell.coef))))
        ends.append(ends[-1] + span)
    return rocking.Motion(ends, rows)


def _light(rng: Drawn, unit: float, horizontal: rocking.Motion) -> rocking.Motion:
    """Next to no weight for long, after as much as at rest or from the start."""
    level = -(1.0 - _log_uniform(rng, 1e-10, 0.3)) * GRAVITY
    span = float(rng.uniform(0.5, 5.0)) * unit
    if rng.random() < 0.5:
        return rocking.Motion([0.0, span], [[level]])
    length = float(rng.uniform(0.1, 1.0)) * unit
    return rocking.Motion.from_points([0.0, length, length + span], [0.0, level, level])


def _pulse_up(rng: Drawn, unit: float, horizontal: rocking.Motion) -> rocking.Motion:
    return _pulse(rng, unit, GRAVITY * float(rng.choice([1.0, rng.uniform(0.1, 1.0)])))


UP: dict[str, Callable[[Drawn, float, rocking.Motion], rocking.Motion]] = {
    "record": _record_up,
    "ramp": _ramp,
    "plateau": _plateau,
    "from zero": _from_zero,
    "steps": _steps,
    "swell": _swell,
    "light": _light,
    "pulse": _pulse_up,
}


# --- how it is judged -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Fault:
    """Of one case: what is wrong, both values, and the error over its tolerance."""

    where: str
    measure: str
    found: Any
    true: Any
    excess: float = np.inf

    def __str__(self) -> str:
        return f"{self.measure}: {self.found!r}, true {self.true!r} ({self.excess:.3g} tolerances)\n    {self.where}"


@dataclass
class Verdict:
    """Counts over all cases that were judged, and every fault."""

    cases: int = 0
    judged: int = 0
    ambiguous: int = 0
    skipped: Counter[str] = field(default_factory=Counter)
    overturned: int = 0
    never_up: int = 0
    impacts: int = 0
    rotations: int = 0
    brackets: int = 0
    unproven: int = 0
    not_followed: int = 0
    ties: int = 0
    units: float = 0.0
    faults: list[Fault] = field(default_factory=list)

    def add(self, other: Verdict) -> None:
        for name, value in vars(other).items():
            if name == "units":
                self.units = max(self.units, value)
            elif name == "faults":
                self.faults.extend(value)
            else:
                setattr(self, name, getattr(self, name) + value)


def judge(given: Case) -> Verdict:
    """Simulate a case, follow it in many digits, and compare."""
    verdict = Verdict(cases=1)
    try:
        response = given.simulate()
    except rocking.RockingError as error:
        verdict.skipped[f"refused: {type(error).__name__}"] += 1
        return verdict
    if response.ambiguous:
        verdict.ambiguous = 1
        return verdict
    if response.unfinished:
        verdict.skipped["unfinished"] += 1
        return verdict
    try:
        _compare(given, response, verdict)
    except AssertionError as error:
        verdict.skipped[f"not followed: {error}"] += 1
    return verdict


def _compare(given: Case, response: rocking.Response, verdict: Verdict) -> None:
    times = _times_to_compare(given, response)
    for slack in (0.0, TIE, ROUNDED_TIE):
        course = multiprecision.follow(
            given.problem,
            rotation=given.rotation,
            velocity=given.velocity,
            most_impacts=MOST_IMPACTS,
            closest=_closest(response),
            slack=slack,
            digits=DIGITS,
            at=times,
        )
        judged = Verdict(judged=1, overturned=int(course.overturned), never_up=int(course.peak == 0))
        _Judge(given, response, course, judged).everything()
        judged.ties |= int(slack > 0.0)
        if slack == 0.0:
            first = judged
        if not judged.faults:
            verdict.add(judged)
            return
    verdict.add(first)


def _times_to_compare(given: Case, response: rocking.Response) -> list[float]:
    """A few instants of the response, drawn from the case's own seed."""
    shares = np.random.default_rng([given.seed, given.number, 1]).uniform(0.0, 1.0, TIMES)
    return [float(share) * response.duration for share in shares]


def _closest(response: rocking.Response) -> float:
    """Time that is left after the last impact that a response resolves, of all sequences the shortest; a half of it."""
    ends, times = response.sequences["end"], response.impacts["time"]
    left = [end - np.max(times[times <= end], initial=0.0) for end in ends]
    return 0.5 * max(min(left, default=1.0), 1e-9)


def _cancellation(motion: rocking.Motion | None) -> float:
    """How much larger than a motion the terms of its polynomials are: an ulp of each of them counts."""
    if motion is None or motion.pga == 0.0:
        return 1.0
    powers = np.diff(motion.breakpoints)[:, np.newaxis] ** np.arange(motion.coefficients.shape[1])
    return max(1.0, float(np.max(np.sum(np.abs(motion.coefficients) * powers, axis=1))) / motion.pga)


@dataclass(frozen=True)
class Event:
    """An event or impact; how a relative change of all that is given changes its time; of a rest its bracket."""

    time: Any
    kind: str
    side: int
    change: float = 0.0
    bracket: Pair = (0.0, 0.0)


@dataclass(frozen=True)
class Rocking:
    """What happens from an uplift to the next rest."""

    height: float
    events: list[Event]
    impacts: list[Event]

    @property
    def kinds(self) -> list[tuple[str, int]]:
        return [(event.kind, event.side) for event in self.events]


class _Judge:
    """Compares one response with what is true."""

    def __init__(self, given: Case, response: rocking.Response, course: Course, verdict: Verdict) -> None:
        self.given, self.response, self.course, self.verdict = given, response, course, verdict
        sensitivity = response.sensitivity
        cancels = max(_cancellation(given.motion), _cancellation(given.motion.vertical)) - 1.0
        self.cancels = cancels
        self.peak, self.impacts, self.events = (
            np.sum([np.abs(table[name]) for name in table.dtype.names], axis=0)
            for table in (sensitivity.peak, sensitivity.impacts, sensitivity.events)
        )
        # What parts of the motion change may cancel in the sum, and yet count: as much as at any earlier impact.
        motion = np.maximum.accumulate(np.abs([0.0, *sensitivity.impacts["motion"]]))
        self.peak += cancels * np.abs(sensitivity.peak["motion"])
        self.impacts += cancels * motion[1:]
        before = np.searchsorted(response.impacts["time"], response.events["time"], side="right")
        self.events += cancels * np.maximum(np.abs(sensitivity.events["motion"]), motion[before])

    def everything(self) -> None:
        response, course = self.response, self.course
        if response.overturned != course.overturned:
            self.fault("verdict", response.overturned, course.overturned)
        if max(response.peak_rotation, course.peak) > self.nothing:
            self.value("peak", response.peak_rotation, course.peak, self.peak[0])
        if self.given.rotation == self.given.velocity == 0.0:
            self.ensemble()
        for sequence in response.solution.sequences:
            self.bracket(sequence)
        mine, theirs = self.found_rockings(), self.true_rockings()
        visible = [[rocking for rocking in side if rocking.height > self.nothing] for side in (mine, theirs)]
        self.verdict.ties = int(len(mine) != len(theirs))
        if [rocking.kinds for rocking in visible[0]] != [rocking.kinds for rocking in visible[1]]:
            self.fault("events", response.events.tolist(), [(float(t), *event) for t, *event in course.events])
            return
        for found, true in zip(*visible, strict=True):
            self.compare(found, true)
        if not self.verdict.ties:
            self.rotations()

    def rotations(self) -> None:
        """Rotations at a few times, but not where the last impacts before a rest are not followed one by one."""
        response, course = self.response, self.course
        times = np.array(_times_to_compare(self.given, response))
        states, changes = response.states(times), response.sensitivity.rotation(times)
        size = np.sum([np.abs(values) for values in changes.values()], axis=0)
        # A time is known to a unit in its last place, and terms of a motion may cancel.
        size += self.cancels * np.abs(changes["motion"]) + response.duration * np.abs(states[:, 1])
        highest = max(response.peak_rotation, float(course.peak))
        for time, (rotation, _, _), change in zip(times, states, size, strict=True):
            if (true := course.states.get(float(time), (0, 0) if self.rests(time) else None)) is not None:
                self.verdict.rotations += 1
                self.value("rotation", float(rotation), true[0], change + highest)

    def rests(self, time: float) -> bool:
        """Whether the block is truly at rest at a time."""
        before = [kind for at, kind, _ in self.course.events if at <= time]
        starts_at_rest = self.given.rotation == self.given.velocity == 0.0
        return before[-1] == "rest" if before else starts_at_rest

    def ensemble(self) -> None:
        """An ensemble of this block alone says the same, also where it steps in lanes."""
        with rocking.set_options(threads=1):
            together = rocking.simulate_many(self.given.block, self.given.motion, model=self.given.model)
        overturned, peak = bool(together.overturned.item()), float(together.peak_rotation.item())
        if overturned != self.course.overturned:
            self.fault("verdict of an ensemble", overturned, self.course.overturned)
        if max(peak, self.course.peak) > self.nothing:
            self.value("peak of an ensemble", peak, self.course.peak, self.peak[0])

    @property
    def nothing(self) -> float:
        """A rotation that is nothing beside the slenderness."""
        return NOTHING * min(self.given.alpha)

    def found_rockings(self) -> list[Rocking]:
        """From uplift to rest each."""
        response = self.response
        brackets = iter(response.sequences[["lower", "upper"]].tolist())
        rockings, events, start = [], [], 0.0
        for k, (time, kind, side) in enumerate(response.events.tolist()):
            events.append(Event(time, kind, side, self.events[k], next(brackets) if kind == "rest" else (time, time)))
            if kind == "uplift":
                start = time
                continue
            height = float(np.max(np.abs(response.rotation(np.linspace(start, min(time, response.duration), 129)))))
            within = np.flatnonzero((response.impacts["time"] >= start) & (response.impacts["time"] <= time))
            table = response.impacts[within]
            impacts = [
                Event(float(impact["time"]), "impact", int(impact["side"]), self.impacts[n])
                for n, impact in zip(within, table, strict=True)
            ]
            rockings.append(Rocking(height, events, impacts))
            events = []
        return rockings

    def true_rockings(self) -> list[Rocking]:
        rockings, events, start, heights = [], [], 0, iter(self.course.peaks)
        for time, kind, side in self.course.events:
            events.append(Event(time, kind, side))
            if kind == "uplift":
                start = time
                continue
            within = [Event(t, "impact", entered) for t, entered, _, _ in self.course.impacts if start <= t <= time]
            rockings.append(Rocking(float(next(heights)), events, within))
            events = []
        return rockings

    def compare(self, found: Rocking, true: Rocking) -> None:
        for mine, theirs in zip(found.events, true.events, strict=True):
            lower, upper = mine.bracket
            self.value(f"time of {mine.kind}", mine.time, theirs.time, mine.change, float(np.nan_to_num(upper - lower)))
            if mine.kind == "rest" and (theirs.time < lower or theirs.time > upper):
                self.fault("bracket", (lower, upper), float(theirs.time), self.outside(theirs.time, lower, upper))
        rests = true.events[-1].kind == "rest"
        if len(true.impacts) < len(found.impacts) if rests else len(true.impacts) != len(found.impacts):
            self.fault("impacts", len(found.impacts), len(true.impacts))
            return
        for mine, theirs in zip(
            found.impacts, true.impacts, strict=False
        ):  # the last ones before a rest are not resolved
            self.verdict.impacts += 1
            if mine.side != theirs.side:
                self.fault("side of an impact", mine.side, theirs.side)
            self.value("time of an impact", mine.time, theirs.time, mine.change)

    def bracket(self, sequence: Any) -> None:
        """What is proven holds from the state at the impact where it was proven, whatever came before."""
        lower, upper = float(sequence["lower"]), float(sequence["upper"])
        if np.isnan(lower):
            self.verdict.unproven += 1
            return
        impacts = self.response.impacts
        last = impacts[impacts["time"] <= sequence["end"]][-1]
        state = float(last["time"]), int(last["side"]), float(last["speed_after"])
        try:
            rest = multiprecision.rest_time(self.given.problem, *state, most_impacts=MOST_IMPACTS, digits=DIGITS)
        except AssertionError as error:
            self.verdict.not_followed += 1
            if "overturns" in str(error):
                self.fault("bracket", (state, lower, upper), "overturns")
            return
        self.verdict.brackets += 1
        if not lower <= rest <= upper:
            self.fault("bracket", (state, lower, upper), float(rest), self.outside(rest, lower, upper))

    @staticmethod
    def outside(rest: Any, lower: float, upper: float) -> float:
        return float(max(lower - rest, rest - upper)) / max(upper - lower, 1e-300)

    def value(self, measure: str, found: float, true: Any, change: float, known: float = 0.0) -> None:
        """One number, and what a relative change of all that is given changes it by; it is known to ``known``."""
        size = (
            max(self.response.duration, 1.0 / min(self.given.p))
            if measure.startswith("time")
            else max(float(found), float(true), 1e-300)
        )
        unit = ULP * (float(change) + size)
        error = max(0.0, abs(float(true - float(found))) - known)
        units = error / unit if error > 0.0 else 0.0
        self.verdict.units = max(self.verdict.units, units)
        if not units <= UNITS:
            self.fault(measure, float(found), float(true), units / UNITS)

    def fault(self, measure: str, found: Any, true: Any, excess: float = np.inf) -> None:
        self.verdict.faults.append(Fault(str(self.given), measure, found, true, excess))
