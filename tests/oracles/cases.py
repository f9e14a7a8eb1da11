"""Random blocks under random motions, stated for the package and for the oracles alike."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from hypothesis import strategies as st

import rocking
from oracles.problem import Problem

Pair = tuple[float, float]
GRAVITY = 9.80665


@dataclass(frozen=True)
class Case:
    """A block and a motion; pairs are (side +, side -)."""

    model: str
    p: Pair
    alpha: Pair
    restitution: Pair
    motion: rocking.Motion | None

    @property
    def block(self) -> rocking.Block:
        return rocking.Block.from_parameters(p=self.p, alpha=self.alpha, restitution=self.restitution)

    @property
    def problem(self) -> Problem:
        motion = self.motion
        return Problem(
            self.model,
            self.p,
            self.alpha,
            self.restitution,
            np.array([0.0]) if motion is None else motion.breakpoints,
            np.zeros((0, 1)) if motion is None else motion.coefficients,
        )

    def simulate(self, **options: Any) -> rocking.Response:
        return rocking.simulate(self.block, self.motion, model=self.model, **options)


def events_of(response: rocking.Response) -> list[tuple[float, str, int]]:
    return [(float(e["time"]), str(e["kind"]), int(e["side"])) for e in response.events]


def impacts_of(response: rocking.Response) -> list[tuple[float, int, float, float]]:
    return [
        (float(i["time"]), int(i["side"]), float(i["speed_before"]), float(i["speed_after"])) for i in response.impacts
    ]


def between(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False, allow_subnormal=False)


def pairs(low: float, high: float, *, symmetric: bool | None = None) -> st.SearchStrategy[Pair]:
    """Equal sides, different sides, or (None) either."""
    equal = between(low, high).map(lambda x: (x, x))
    different = st.tuples(between(low, high), between(low, high))
    if symmetric is None:
        return equal | different
    return equal if symmetric else different


def amplitudes() -> st.SearchStrategy[float]:
    """Largest acceleration over the threshold of uplift: a few times, or hardly more."""
    return between(1.05, 4.0) | between(-8.0, -1.0).map(lambda exponent: 1.0 + 10.0**exponent)


@st.composite
def records(draw: st.DrawFn, threshold: float, *, dt: float | None = None) -> rocking.Motion:
    """Filtered noise between samples joined by lines, a few times the acceleration that uplifts the block."""
    seed = draw(st.integers(0, 2**32 - 1))
    samples = draw(st.integers(20, 120))
    step = draw(st.sampled_from([0.005, 0.01, 0.02, 1.0 / 64.0])) if dt is None else dt
    smooth = draw(st.integers(1, 8))
    noise = np.random.default_rng(seed).normal(size=samples + smooth)
    acceleration = np.convolve(noise, np.ones(smooth), mode="valid")[:samples]
    pga = draw(amplitudes()) * threshold
    return rocking.Motion.from_samples(acceleration * (pga / np.max(np.abs(acceleration))), step)


@st.composite
def pulses(draw: st.DrawFn, threshold: float) -> rocking.Motion:
    amplitude = draw(amplitudes()) * threshold * draw(st.sampled_from([1.0, -1.0]))
    frequency = draw(between(0.4, 4.0))
    family = draw(st.sampled_from(["sine", "half_sine", "one_cosine", "ricker", "triangular", "rectangular"]))
    if family == "sine":
        return rocking.pulses.sine(amplitude, frequency, cycles=draw(between(0.5, 3.0)), phase=draw(between(0.0, 6.0)))
    if family in ("triangular", "rectangular"):
        return getattr(rocking.pulses, family)(amplitude, 1.0 / frequency)
    return getattr(rocking.pulses, family)(amplitude, frequency)


@st.composite
def cases(
    draw: st.DrawFn,
    *,
    model: str | None = None,
    symmetric: bool | None = None,
    motion: str | None = None,
    restitution: Pair = (0.4, 0.96),
) -> Case:
    """Cases of a model ("linear", "nonlinear") and a kind of motion ("record", "pulse"); None: any."""
    model = model or draw(st.sampled_from(["linear", "nonlinear"]))
    alpha = draw(pairs(0.05, 0.4, symmetric=symmetric))
    threshold = GRAVITY * float(np.tan(min(alpha)))
    kinds = {"record": records(threshold), "pulse": pulses(threshold)}
    return Case(
        model,
        draw(pairs(1.0, 6.0, symmetric=symmetric)),
        alpha,
        draw(pairs(*restitution, symmetric=symmetric)),
        draw(kinds[motion or draw(st.sampled_from(["record", "pulse"]))]),
    )


def wave(amplitude: float, seed: int, dt: float = 0.02, count: int = 200) -> rocking.Motion:
    """Smooth random motion, linear between even samples."""
    random = np.random.default_rng(seed)
    t = dt * np.arange(count + 1)
    parts = [random.normal() * np.sin(f * t + random.uniform(0.0, 6.0)) for f in random.uniform(2.0, 25.0, 6)]
    return rocking.Motion.from_samples(amplitude * np.sum(parts, axis=0) * np.sin(np.pi * t / t[-1]), dt)
