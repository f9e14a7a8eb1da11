"""Verdicts and peaks of whole analyses, many motions by many blocks, against another code.

The other code is `tests/oracles/leapfrog.py`: it shares neither equations, nor time stepping, nor event location with
the package. Motions are the records that ship and noise that anybody can make, each scaled so that many blocks rock.
A response that calls itself ambiguous is not judged, nor is one that the other code, with steps half as long, does not
itself give again: then rounding decides, and the other code cannot say.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

import rocking
from promises.promise import OF_NO_SIMULATION, Found, Promise

#: Blocks of a part, which has one motion.
BLOCKS = 100

#: Peaks agree to this share of the slenderness.
PEAKS = 1e-6

#: Peaks of the other code that change by more than this share with its steps say nothing.
ITS_OWN = 1e-7

_GRAVITY = 9.80665
_STATIONS = ("ridgecrest-clc", "ridgecrest-tow2", "el-centro-meloland")


@dataclass(frozen=True)
class Shaking:
    """Accelerations (m/s^2) at the same instants, ``step`` s apart; the vertical one is zero where there is none."""

    kind: str
    step: float
    across: np.ndarray
    up: np.ndarray

    @property
    def motion(self) -> rocking.Motion:
        """The same for the package."""
        across = rocking.Motion.from_samples(self.across, self.step)
        return across.with_vertical(rocking.Motion.from_samples(self.up, self.step)) if self.up.any() else across


def drawn(part: int) -> tuple[rocking.Blocks, Shaking, str]:
    """Blocks, half of them with two sides that differ, one motion, and the model of a part."""
    rng = np.random.default_rng([61, part])
    p, alpha = np.exp(rng.uniform(np.log(0.7), np.log(10.0), BLOCKS)), rng.uniform(0.05, 0.5, BLOCKS)
    e = rng.uniform(0.4, 0.95, BLOCKS)
    other = np.where(np.arange(BLOCKS) % 2, 1.0, np.exp(rng.uniform(-0.3, 0.3, (3, BLOCKS))))
    pairs = [
        np.stack([given, np.minimum(given * factor, most)], axis=1)
        for given, factor, most in zip((p, alpha, e), other, (20.0, 0.6, 0.95), strict=True)
    ]
    blocks = rocking.Blocks(p=pairs[0], alpha=pairs[1], restitution=pairs[2])
    shaking = _recorded(rng) if part % 2 else _made(rng)
    vertical = shaking.up if part % 3 == 0 else np.zeros_like(shaking.up)
    return blocks, Shaking(shaking.kind, shaking.step, shaking.across, vertical), ("linear", "nonlinear")[part // 2 % 2]


def _recorded(rng: np.random.Generator) -> Shaking:
    """Take a record that ships, with its own vertical component."""
    station = _STATIONS[int(rng.integers(len(_STATIONS)))]
    names = [name for name in rocking.records.names() if name.startswith(station)]
    across, up = (rocking.records.load(name) for name in (names[int(rng.integers(2))], names[-1]))
    return _scaled(rng, "record", across.times, across.samples, up.samples)


def _made(rng: np.random.Generator) -> Shaking:
    """Make noise through an oscillator of a frequency of 1 to 10 Hz, that rises and dies away."""
    step, count = float(rng.choice([0.005, 0.01, 0.02])), int(rng.integers(1000, 3001))
    times = step * np.arange(count)
    rises = (times / times[-1]) * np.exp(1.0 - 8.0 * (times / times[-1] - 0.1))
    across, up = (rises * _filtered(rng, times, step) for _ in range(2))
    return _scaled(rng, "noise", times, across, 0.6 * up)


def _filtered(rng: np.random.Generator, times: np.ndarray, step: float) -> np.ndarray:
    w, damping = 2.0 * math.pi * float(np.exp(rng.uniform(np.log(1.0), np.log(10.0)))), float(rng.uniform(0.1, 0.6))
    answer = np.exp(-damping * w * times) * np.sin(w * math.sqrt(1.0 - damping**2) * times)
    return np.convolve(rng.normal(size=len(times)), answer)[: len(times)]


def _scaled(rng: np.random.Generator, kind: str, times: np.ndarray, across: np.ndarray, up: np.ndarray) -> Shaking:
    """Scale the horizontal peak to 0.15 to 1 g, and the vertical one in proportion but to less than 0.9 g."""
    factor = _GRAVITY * float(np.exp(rng.uniform(np.log(0.15), np.log(1.0)))) / np.max(np.abs(across))
    length = min(len(across), len(up))
    lift = factor * up[:length]
    lift *= min(1.0, 0.9 * _GRAVITY / max(float(np.max(np.abs(lift))), 1e-300))
    return Shaking(kind, float(times[1] - times[0]), factor * across[:length], lift)


def judge(part: int) -> Found:
    """Judge the blocks of a part."""
    from oracles import leapfrog  # needs numba, which those who import all promises may do without

    found = Found(parts=1)
    blocks, shaking, model = drawn(part)
    motion: Any = shaking.motion
    with rocking.set_options(threads=1):
        together = rocking.simulate_many(blocks, motion, model=model)  # type: ignore[arg-type]
    fell, peaks = (together[name].values.reshape(-1) for name in ("overturned", "peak_rotation"))
    for k in range(BLOCKS):
        given: Any = {name: tuple(map(float, getattr(blocks, name)[k])) for name in ("p", "alpha", "restitution")}
        block = rocking.Block.from_parameters(**given)
        response = rocking.simulate(block, motion, model=model)  # type: ignore[arg-type]
        found.cases += 1
        about = f"{shaking.kind}, {model}"
        if response.ambiguous:
            found.notes["ambiguous"] += 1
            continue
        true, again = (
            leapfrog.follow(model, **given, step=shaking.step, across=shaking.across, up=shaking.up, finer=finer)
            for finer in (1, 2)
        )
        least = min(given["alpha"])
        doubtful = not true.overturned and abs(true.peak - again.peak) > ITS_OWN * least
        if true.overturned != again.overturned or doubtful:
            found.notes["not settled"] += 1
            continue
        found.judged += 1
        found.notes[f"{about}: judged"] += 1
        for name, counted in (
            ("overturned", true.overturned),
            ("never up", true.peak == 0.0),
            ("vertical", motion.vertical is not None),
            ("two sides", given["alpha"][0] != given["alpha"][1]),
            ("impacts", true.impacts),
        ):
            found.notes[f"{about}: {name}"] += counted
        for way, overturned, peak in (
            ("alone", response.overturned, response.peak_rotation),
            ("in an ensemble", bool(fell[k]), float(peaks[k])),
        ):
            if overturned != true.overturned:
                found.fail(f"part {part}, block {k} {way}: overturned {overturned}, another code {true.overturned}")
            elif not overturned:
                error = abs(peak - true.peak) / least
                found.worst = max(found.worst, error / PEAKS)
                if error > PEAKS:
                    found.fail(f"part {part}, block {k} {way}: peak {peak!r} rad, another code {true.peak!r} rad")
    return found


def table(found: Found) -> str:
    """Count what was analysed, by kind of motion and model."""
    heads = ("judged", "overturned", "never up", "two sides", "vertical", "impacts")
    lines = ["| motion, model | " + " | ".join(heads) + " |", "|---" + "|--:" * len(heads) + "|"]
    for kind in ("record", "noise"):
        for model in ("linear", "nonlinear"):
            row = f"{kind}, {model}"
            lines.append(f"| {row} | " + " | ".join(f"{found.notes[f'{row}: {head}']}" for head in heads) + " |")
    left = (
        f"{found.notes['ambiguous']} of {found.cases} analyses call themselves ambiguous, and of "
        f"{found.notes['not settled']} the other code has no settled answer.\n"
    )
    return "\n".join([*lines, "", left])


PROMISE = Promise(
    name="cross-code",
    says="verdict and peak as another code finds them",
    parts=100,
    small=4,
    judge=judge,
    least=0.97,
    table=table,
    above=OF_NO_SIMULATION,
)
