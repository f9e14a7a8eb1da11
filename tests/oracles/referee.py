"""Random ensembles over wide ranges, and the differences between an ensemble and single simulations.

A batch is many blocks under one motion, drawn from a seed and a number: `batch(seed, number)` gives the same one
again. `compare` simulates it both ways. A difference counts unless the single simulation calls itself ambiguous or
the last digits of the problem explain it: then a neighbour (motion or block changed by few ulps) differs as much.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from math import tan
from typing import Any

import numpy as np
from numpy.typing import NDArray

import rocking
from rocking.core.arrays import Floats
from rocking.motion.motion import find_exceedances

GRAVITY = 9.80665
ULP = 2.0**-52
TOLERANCE = 1e-9
"""Of the peak; and of the duration, for times, with as many seconds at least."""
EXPLAINED = 0.05
"""A difference is the problem's own where a neighbour differs by this share of it."""
TOUCH = 2.0**-40
"""A motion that falls to a threshold by less than this share of it does not leave it."""
VISIBLE = 1e3
"""A change by this many tolerances makes a response ambiguous, by its own definition."""

Drawn = np.random.Generator


@dataclass(frozen=True)
class Batch:
    """Blocks under one motion, and the options of the ensemble."""

    seed: int
    number: int
    kind: str
    model: str
    blocks: rocking.Blocks
    motion: rocking.Motion
    duration: float | None
    ends: str
    factor: float | None
    polarity: str

    @property
    def options(self) -> dict[str, Any]:
        scaled = {} if self.factor is None else {"levels": [self.factor]}
        return {"model": self.model, "duration": self.duration, "polarity": self.polarity, **scaled}

    @property
    def motions(self) -> list[rocking.Motion]:
        """The motion as each polarity of the ensemble has it."""
        scaled = self.motion if self.factor is None else self.motion.scaled(self.factor)
        return {"+": [scaled], "-": [-scaled], "both": [scaled, -scaled]}[self.polarity]

    def together(self, **options: Any) -> dict[str, NDArray[Any]]:
        """Outcomes of the ensemble, each of shape (polarity, block)."""
        result = rocking.simulate_many(self.blocks, self.motion, **{**self.options, **options})
        shape = (len(self.motions), len(self.blocks))
        return {str(name): values.values.reshape(shape) for name, values in result.data_vars.items()}

    def alone(self, sign: int, k: int) -> rocking.Response:
        return rocking.simulate(self.blocks[k], self.motions[sign], model=self.model, duration=self.duration)

    def describe(self, sign: int, k: int) -> str:
        p, alpha, restitution = (values[k].tolist() for values, _ in self.blocks.parameters().values())
        return (
            f"batch({self.seed}, {self.number}{', vertical=True' * (self.motion.vertical is not None)}), "
            f"polarity {sign}, block {k}: {self.kind}, {self.model}, "
            f"p={p!r}, alpha={alpha!r}, restitution={restitution!r}, "
            f"step={self.motion.breakpoints[1]:.6g}, pga={self.motions[sign].pga:.6g}, duration={self.duration!r}"
        )


# --- what is drawn --------------------------------------------------------------------------------------------


def batch(seed: int, number: int, *, most: int = 64, vertical: bool = False) -> Batch:
    """Batch of that number: dt 1e-6 to 0.1 s, p 0.05 to 100 rad/s, alpha 1e-4 to 1.4, restitution 0.05 to 0.999.

    With a vertical component dt goes down to 2e-8 s, and so p dt to 1e-9.
    """
    rng = np.random.default_rng([seed, number])
    model = str(rng.choice(["linear", "nonlinear"]))
    shortest = 2e-8 if vertical else 1e-6
    dt = _log_uniform(rng, shortest, 0.1) if rng.random() < 0.5 else float(rng.choice([0.001, 0.005, 0.01, 0.02, 0.1]))
    alpha = _log_uniform(rng, 1e-4, 1.4) if rng.random() < 0.5 else float(rng.uniform(0.05, 0.5))
    kind = str(rng.choice(list(KINDS)))
    polarity = str(rng.choice(["+", "-", "both"], p=[0.6, 0.2, 0.2]))
    count = most // 2 if polarity == "both" else most
    blocks = _blocks(rng, count, dt, alpha)
    threshold = GRAVITY * (alpha if model == "linear" else tan(alpha))
    motion = KINDS[kind](rng, dt, threshold)
    if vertical:
        kind, motion = _lifted(rng, kind, motion, dt)
    duration, ends = _duration(rng, motion)
    factor = None if rng.random() < 0.7 else float(rng.choice([0.5, 1.0, 1.0 / 3.0, 2.0, 1.7]))
    return Batch(seed, number, kind, model, blocks, motion, duration, ends, factor, polarity)


def _log_uniform(rng: Drawn, low: float, high: float, count: int | None = None) -> Any:
    drawn = np.exp(rng.uniform(np.log(low), np.log(high), count))
    return float(drawn) if count is None else drawn


def _blocks(rng: Drawn, count: int, dt: float, alpha: float) -> rocking.Blocks:
    """Blocks that an acceleration near one threshold uplifts, some of them of exactly that slenderness."""
    shape = (count, 2 if rng.random() < 0.4 else 1)
    if rng.random() < 0.6:
        p = np.clip(_log_uniform(rng, 1e-3, 0.5, shape) / dt, 0.05, 100.0)
    else:
        p = _log_uniform(rng, 0.05, 100.0, shape)
    spread = float(rng.choice([0.05, 0.7, 3.0]))
    slender = np.clip(alpha * np.exp(rng.uniform(-spread, spread, shape)), 1e-4, 1.4)
    slender[rng.random(count) < 0.2] = alpha
    restitution = rng.uniform(0.05, 0.98, shape)
    lively = rng.random(shape) < 0.06
    restitution[lively] = 1.0 - _log_uniform(rng, 1e-3, 0.05, int(lively.sum()))
    both = (count, 2)
    p, slender, restitution = (np.broadcast_to(values, both) for values in (p, slender, restitution))
    return rocking.Blocks(p=p, alpha=slender, restitution=restitution)


def _duration(rng: Drawn, motion: rocking.Motion) -> tuple[float | None, str]:
    instants = motion.breakpoints
    how = str(rng.choice(["to rest", "on a sample", "off samples", "first sample", "after the motion"], p=_ENDS))
    on = float(instants[rng.integers(1, len(instants))])
    inside = float(rng.uniform(0.0, instants[-1]))
    return {
        "to rest": None,
        "on a sample": on,
        "off samples": inside,
        "first sample": float(instants[1] * rng.uniform(1e-3, 1.0)),
        "after the motion": float(instants[-1] * rng.uniform(1.0, 3.0)),
    }[how], how


_ENDS = [0.5, 0.2, 0.15, 0.03, 0.12]


def _count(rng: Drawn) -> int:
    return int(rng.integers(20, 400))


def _times(rng: Drawn) -> float:
    """Peak acceleration over the threshold."""
    if rng.random() < 0.2:
        return 1.0 + 10.0 ** float(rng.uniform(-9.0, -1.0))
    return float(rng.uniform(1.05, 6.0))


def _scaled(values: Floats, peak: float) -> Floats:
    return values * (peak / np.max(np.abs(values)))


def _smooth(rng: Drawn, count: int) -> Floats:
    width = int(rng.integers(1, 12))
    return np.convolve(rng.normal(size=count + width), np.ones(width), mode="valid")[:count]


def _noise(rng: Drawn, dt: float, threshold: float) -> rocking.Motion:
    return rocking.Motion.from_samples(_scaled(_smooth(rng, _count(rng)), _times(rng) * threshold), dt)


def _stretches(rng: Drawn, dt: float, threshold: float) -> rocking.Motion:
    levels = rng.choice([-1.0, 1.0], 40) * rng.choice([0.0, 0.5, 1.0, 1.2, 2.0], 40) * threshold
    samples = np.repeat(levels, rng.integers(1, 20, 40))[: _count(rng)]
    return rocking.Motion.from_samples(samples, dt)


def _jumps(rng: Drawn, dt: float, threshold: float) -> rocking.Motion:
    """Pieces of even length and of a degree from 0 to 3 that do not meet; said to be samples where that is taken."""
    count, degree = _count(rng), int(rng.integers(0, 4))
    instants = dt * np.arange(count + 1)
    coefficients = rng.normal(size=(count, degree + 1)) * dt ** -np.arange(degree + 1.0)
    coefficients *= _times(rng) * threshold / np.max(np.abs(coefficients[:, 0]))
    if degree == 1 and rng.random() < 0.5:
        try:
            return rocking.Motion(instants, coefficients)
        except rocking.RockingError:
            pass
    return rocking.Motion(instants, coefficients)


def _at_the_threshold(rng: Drawn, dt: float, threshold: float) -> rocking.Motion:
    samples = rng.choice([-1.0, -0.3, 0.0, 0.9, 1.0, 1.0 + ULP, 1.0 - ULP, 1.5, -2.0], _count(rng)) * threshold
    return rocking.Motion.from_samples(samples, dt)


def _spikes(rng: Drawn, dt: float, threshold: float) -> rocking.Motion:
    count = _count(rng)
    samples = np.zeros(count)
    at = rng.integers(0, count, int(rng.integers(1, 5)))
    samples[at] = rng.choice([-1.0, 1.0], len(at)) * threshold * _log_uniform(rng, 1.001, 300.0, len(at))
    return rocking.Motion.from_samples(samples, dt)


def _huge(rng: Drawn, dt: float, threshold: float) -> rocking.Motion:
    samples = _smooth(rng, _count(rng))
    if rng.random() < 0.5:
        samples = samples * (rng.random(len(samples)) < 0.1)
        samples[int(rng.integers(len(samples)))] = 1.0
    return rocking.Motion.from_samples(_scaled(samples, _log_uniform(rng, 10.0, 1e3) * GRAVITY), dt)


def _barely(rng: Drawn, dt: float, threshold: float) -> rocking.Motion:
    samples = _scaled(_smooth(rng, _count(rng)), threshold)
    return rocking.Motion.from_samples(samples * (1.0 + 10.0 ** float(rng.uniform(-14.0, -2.0))), dt)


def _long_rests(rng: Drawn, dt: float, threshold: float) -> rocking.Motion:
    parts: list[Floats] = []
    for _ in range(int(rng.integers(2, 5))):
        parts += [_scaled(_smooth(rng, 12), _times(rng) * threshold), np.zeros(int(rng.integers(5, 80)))]
    return rocking.Motion.from_samples(np.concatenate(parts), dt)


def _alternating(rng: Drawn, dt: float, threshold: float) -> rocking.Motion:
    """Strong accelerations of changing sign from sample to sample: rotations turn round within one."""
    count = _count(rng)
    samples = np.where(np.arange(count) % int(rng.integers(2, 7)) == 0, -1.0, 1.0) * rng.uniform(0.5, 1.0, count)
    return rocking.Motion.from_samples(samples * threshold * _log_uniform(rng, 1.1, 60.0), dt)


def _sine(rng: Drawn, dt: float, threshold: float) -> rocking.Motion:
    count = _count(rng)
    cycles = float(rng.uniform(0.5, count / 8.0))
    samples = _times(rng) * threshold * np.sin(2.0 * np.pi * cycles * np.arange(count) / count)
    return rocking.Motion.from_samples(samples, dt)


def _sum(rng: Drawn, dt: float, threshold: float) -> rocking.Motion:
    """A record and a pulse whose pieces end at its samples, or elsewhere."""
    each = 8 if rng.random() < 0.5 else float(rng.uniform(4.0, 12.0))
    cycles = int(rng.integers(1, 6))
    pulse = rocking.pulses.sine(_times(rng) * threshold, min(1e6, 1.0 / (each * dt)), cycles=cycles)
    samples = _scaled(_smooth(rng, 8 * cycles + 1), 0.5 * threshold) * float(rng.choice([0.0, 1.0]))
    return rocking.Motion.from_samples(samples, dt) + pulse


KINDS: dict[str, Callable[[Drawn, float, float], rocking.Motion]] = {
    "noise": _noise,
    "stretches": _stretches,
    "jumps": _jumps,
    "at the threshold": _at_the_threshold,
    "spikes": _spikes,
    "huge": _huge,
    "barely": _barely,
    "long rests": _long_rests,
    "alternating": _alternating,
    "sine": _sine,
    "sum": _sum,
}


def _lifted(rng: Drawn, kind: str, motion: rocking.Motion, dt: float) -> tuple[str, rocking.Motion]:
    """Give a motion a vertical component; the kind of both."""
    lift = str(rng.choice(list(LIFTS)))
    return f"{kind}, {lift}", motion.with_vertical(LIFTS[lift](rng, dt, len(motion.coefficients)))


def _record_up(rng: Drawn, dt: float, count: int) -> rocking.Motion:
    """Next to nothing up to a few g, on the same samples or twice as many, ending earlier or later."""
    finer = int(rng.choice([1, 1, 1, 2]))
    samples = _smooth(rng, finer * max(2, int(count * rng.choice([1.0, 0.7, 1.3]))) + 1)
    return rocking.Motion.from_samples(_scaled(samples, _log_uniform(rng, 1e-6, 4.0) * GRAVITY), dt / finer)


def _near_lift_off(rng: Drawn, dt: float, count: int) -> rocking.Motion:
    """The weight goes down to next to nothing, to nothing, or a little below."""
    samples = _smooth(rng, count + 1)
    short = float(rng.choice([0.0, 1.0])) * 10.0 ** float(rng.uniform(-12.0, -1.0)) * float(rng.choice([-1.0, 1.0]))
    samples *= -(1.0 - short) * GRAVITY / np.min(samples) if np.min(samples) < 0.0 else 1.0
    return rocking.Motion.from_samples(samples, dt)


def _in_free_fall(rng: Drawn, dt: float, count: int) -> rocking.Motion:
    """Stretches without any weight, and with other ones, joined within a sample."""
    levels = np.repeat(rng.choice([-1.0, 0.0, -1.5, 1.0], count + 1) * GRAVITY, rng.integers(1, 20, count + 1))
    return rocking.Motion.from_samples(levels[: count + 1], dt)


def _jumps_up(rng: Drawn, dt: float, count: int) -> rocking.Motion:
    """Pieces that do not meet, of a degree from 0 to 2; of straight lines mostly."""
    degree = int(rng.choice([0, 1, 1, 1, 2]))
    coefficients = rng.normal(size=(count, degree + 1)) * dt ** -np.arange(degree + 1.0)
    coefficients *= _log_uniform(rng, 0.01, 2.0) * GRAVITY / np.max(np.abs(coefficients[:, 0]))
    return rocking.Motion(dt * np.arange(count + 1), coefficients)


def _spike_up(rng: Drawn, dt: float, count: int) -> rocking.Motion:
    samples = np.zeros(count + 1)
    samples[int(rng.integers(count + 1))] = float(rng.choice([-1.0, 1.0])) * _log_uniform(rng, 1.0, 100.0) * GRAVITY
    return rocking.Motion.from_samples(samples, dt)


def _pulse_up(rng: Drawn, dt: float, count: int) -> rocking.Motion:
    return rocking.pulses.sine(_log_uniform(rng, 0.05, 1.5) * GRAVITY, min(1e6, 1.0 / (12.0 * dt)), cycles=2)


def _level_up(rng: Drawn, dt: float, count: int) -> rocking.Motion:
    return rocking.Motion(dt * np.arange(count + 1), [[float(rng.uniform(-0.99, 2.0)) * GRAVITY, 0.0]] * count)


LIFTS: dict[str, Callable[[Drawn, float, int], rocking.Motion]] = {
    "record up": _record_up,
    "near lift-off": _near_lift_off,
    "free fall": _in_free_fall,
    "jumps up": _jumps_up,
    "spike up": _spike_up,
    "pulse up": _pulse_up,
    "level up": _level_up,
}


# --- how it is judged -----------------------------------------------------------------------------------------

MEASURES = (
    *("overturned", "peak_rotation", "peak_time", "uplifts", "rests", "time_at_rest", "complete_chattering"),
    *("unfinished",),
)


@dataclass(frozen=True)
class Difference:
    """Of one pair and one measure: both values, and how far apart over the tolerance (counts: infinite)."""

    where: str
    kind: str
    model: str
    measure: str
    together: float
    alone: float
    excess: float
    explained: bool

    def __str__(self) -> str:
        return (
            f"{self.measure}: {self.together!r} together, {self.alone!r} alone ({self.excess:.3g} tolerances)\n"
            f"    {self.where}"
        )


@dataclass
class Verdict:
    """Counts over all pairs that were compared, and every difference."""

    pairs: int = 0
    ambiguous: int = 0
    refused: int = 0
    overturned: int = 0
    at_rest_throughout: int = 0
    differences: list[Difference] = field(default_factory=list)
    explained: list[Difference] = field(default_factory=list)

    @property
    def unsaid(self) -> list[Difference]:
        """Of the explained ones, those after which the single simulation should have called itself ambiguous."""
        told = [found for found in self.explained if found.measure not in ("peak_time", "complete_chattering")]
        return [found for found in told if found.excess > 20.0 * VISIBLE]

    def add(self, other: Verdict) -> None:
        self.pairs += other.pairs
        self.ambiguous += other.ambiguous
        self.refused += other.refused
        self.overturned += other.overturned
        self.at_rest_throughout += other.at_rest_throughout
        self.differences += other.differences
        self.explained += other.explained


def compare(given: Batch) -> Verdict:
    """Simulate every pair both ways."""
    verdict = Verdict()
    signs, blocks = len(given.motions), len(given.blocks)
    verdict.pairs = signs * blocks
    try:
        together = given.together()
    except rocking.RockingError:
        verdict.refused = verdict.pairs
        return verdict
    for sign in range(signs):
        for k in range(blocks):
            _judge(given, sign, k, {name: values[sign, k] for name, values in together.items()}, verdict)
    return verdict


def _judge(given: Batch, sign: int, k: int, together: dict[str, Any], verdict: Verdict) -> None:
    try:
        response = given.alone(sign, k)
    except rocking.RockingError:
        verdict.refused += 1
        return
    verdict.overturned += response.overturned
    verdict.at_rest_throughout += response.peak_rotation == 0.0
    if response.ambiguous:
        verdict.ambiguous += 1
        return
    excesses = excess(together, response)
    worst = max(excesses, key=lambda name: excesses[name])
    if excesses[worst] <= 1.0:
        return
    explained = excesses[worst] <= _of_neighbours(given, sign, k, response)[worst] / EXPLAINED
    found = Difference(
        given.describe(sign, k),
        given.kind,
        given.model,
        worst,
        float(together[worst]),
        outcomes(response)[worst],
        excesses[worst],
        explained,
    )
    (verdict.explained if explained else verdict.differences).append(found)


def outcomes(response: rocking.Response) -> dict[str, float]:
    """Outcomes of one response by the ensemble's names."""
    kinds = response.events["kind"]
    return {
        "overturned": float(response.overturned),
        "peak_rotation": response.peak_rotation,
        "peak_time": response.peak_time,
        "uplifts": float(np.sum(kinds == "uplift")),
        "rests": float(np.sum(kinds == "rest")),
        "time_at_rest": response.time_at_rest,
        "complete_chattering": float(_completes(response)),
        "unfinished": float(getattr(response, "unfinished", False)),
    }


def _completes(response: rocking.Response) -> bool:
    """Whether the motion was beyond a threshold only once until the first rest; to touch it from beyond is no end."""
    rests = response.events["time"][response.events["kind"] == "rest"]
    if response.motion is None or not len(rests):
        return False
    plus, minus = response.block.uplift_thresholds(response.model)
    touching = (1.0 - TOUCH) * plus, (1.0 - TOUCH) * minus
    starts = find_exceedances(response.motion, (plus, minus), response.block.gravity)[:, 0]
    # Thresholds are touched up to a share of themselves whatever the weight, also where there is none.
    stretches = find_exceedances(response.motion, touching, (1.0 - TOUCH) * response.block.gravity)[:, 0]
    return len(np.unique(np.searchsorted(stretches, starts[starts < rests[0]], side="right"))) == 1


def excess(together: dict[str, Any], response: rocking.Response) -> dict[str, float]:
    """Differences over their tolerances; once the verdicts differ, nothing else is looked at."""
    alone = outcomes(response)
    seconds = TOLERANCE * max(1.0, response.duration)
    found = dict.fromkeys(MEASURES, 0.0)
    for name in ("unfinished", "overturned"):
        if bool(together.get(name, 0.0)) != bool(alone[name]):
            return {**found, name: np.inf}
    if alone["unfinished"]:
        return found
    peak = alone["peak_rotation"]
    found["peak_rotation"] = _over(together["peak_rotation"], peak, TOLERANCE * peak)
    found["time_at_rest"] = _over(together["time_at_rest"], alone["time_at_rest"], seconds)
    found["peak_time"] = _over(together["peak_time"], alone["peak_time"], seconds)
    if found["peak_time"] > 1.0 and _tied(response, float(together["peak_time"])):
        found["peak_time"] = 0.0
    for name in ("uplifts", "rests", "complete_chattering"):
        found[name] = np.inf if together[name] != alone[name] else 0.0
    return found


def _over(one: float, other: float, tolerance: float) -> float:
    gap = abs(float(one) - other)
    if np.isnan(gap):
        return np.inf
    return gap / max(tolerance, 1e-300)


def _tied(response: rocking.Response, time: float) -> bool:
    """Whether another of several peaks of one height was taken: as high there, and lower between the two."""
    if not 0.0 <= time <= response.duration:
        return False
    high = response.peak_rotation * (1.0 - TOLERANCE)
    between = np.abs(response.rotation(np.linspace(time, response.peak_time, 34)))
    return bool(between[0] >= high and np.min(between) < high)


def _of_neighbours(given: Batch, sign: int, k: int, response: rocking.Response) -> dict[str, float]:
    """Greatest excess of each measure over neighbours: the problem with a few of its last digits changed."""
    found = dict.fromkeys(MEASURES, 0.0)
    for neighbour in _neighbours(given, sign, k):
        try:
            other = neighbour()
        except rocking.RockingError:
            continue
        for name, value in excess(outcomes(other), response).items():
            found[name] = max(found[name], value)
    return found


def _neighbours(given: Batch, sign: int, k: int) -> Iterator[Callable[[], rocking.Response]]:
    block, motion = given.blocks[k], given.motions[sign]
    p, alpha, restitution = (
        np.array(values) for values in (given.blocks.p, given.blocks.alpha, given.blocks.restitution)
    )

    def simulated(block: rocking.Block, motion: rocking.Motion) -> Callable[[], rocking.Response]:
        return lambda: rocking.simulate(block, motion, model=given.model, duration=given.duration)

    for ulps in (-4, -1, 1, 4):
        factor = 1.0 + ulps * ULP
        yield simulated(block, motion.scaled(factor))
        slenderness = np.minimum(alpha[k] * factor, np.nextafter(0.5 * np.pi, 0.0))
        for values in (
            (p[k], slenderness, restitution[k]),
            (p[k] * factor, alpha[k], restitution[k]),
            (p[k], alpha[k], np.minimum(restitution[k] * factor, 1.0)),
        ):
            yield simulated(rocking.Block.from_parameters(*(tuple(v) for v in values)), motion)
    # Where the motion is zero, its last digits are those of the threshold.
    push = ULP * min(block.uplift_thresholds(given.model))
    for sign in (-1.0, 1.0):
        yield simulated(block, motion + rocking.Motion(motion.breakpoints[[0, -1]], [[sign * push]]))


def batches(seed: int, pairs: int, *, first: int = 0, vertical: bool = False) -> Iterator[Batch]:
    """Batches of a seed until they hold that many pairs."""
    drawn = 0
    number = first
    while drawn < pairs:
        given = batch(seed, number, vertical=vertical)
        yield given
        drawn += len(given.motions) * len(given.blocks)
        number += 1


def shuffled(given: Batch, copies: int, rng: Drawn) -> tuple[Batch, NDArray[np.int64]]:
    """The blocks several times over in random order, and from where each comes."""
    order = rng.permutation(np.tile(np.arange(len(given.blocks)), copies))
    return replace(given, blocks=given.blocks.select(order)), order
