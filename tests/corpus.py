"""Digests of what the package computes: which groups of results has a change altered?

`python tests/corpus.py --compare` prints the groups that differ from the digests in `tests/data/corpus.json`, `--write`
writes the file anew, and `--items GROUP` prints one digest for each item of a group, to compare with those of another
version of the package. `test_corpus.py` compares, too.

Results of kernels are compared in all their bits. Their inputs come from basic arithmetic alone, because trigonometric
functions differ in the last bits between builds of NumPy. Analyses that use other libraries are rounded to six digits.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import functools
import hashlib
import inspect
import io
import json
import math
import re
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

import rocking
from rocking import chattering, dynamics, pulses
from rocking.chattering import families

FILE: Final = Path(__file__).parent / "data" / "corpus.json"
FORMATS: Final = Path(__file__).parent / "data" / "formats"
G: Final = 9.80665

Item = tuple[str, Any]


class Group(NamedTuple):
    """What makes results with one digest, each with a label; the digits of their numbers, or None for all bits."""

    items: Callable[[], Iterable[Item]]
    digits: int | None
    fast: bool  # whether the fast tests compare it


GROUPS: dict[str, Group] = {}


def group(*, digits: int | None = None, fast: bool = True, **cases: Any) -> Callable[[Any], Any]:
    """Enter a function of results under its name; `cases` is one option with the values that make a group each."""

    def enter(function: Callable[..., Iterable[Item]]) -> Callable[..., Iterable[Item]]:
        name = function.__name__.replace("_", "-")
        if not cases:
            GROUPS[name] = Group(function, digits, fast)
        for option, values in cases.items():
            for value in values:
                GROUPS[f"{name}-{value}"] = Group(functools.partial(function, **{option: value}), digits, fast)
        return function

    return enter


# Digests


def encoded(value: Any, digits: int | None = None) -> Iterator[bytes]:
    """Encode a result by its kind: exact bytes of numbers and text, or text of rounded numbers."""
    if isinstance(value, rocking.Response):
        value = of_response(value)
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, (str, Path)):
        yield b"text:" + (rounded_text(str(value), digits) if digits else str(value)).encode()
    elif value is None or isinstance(value, (bool, np.bool_)):
        yield f"{value}:".encode()
    elif isinstance(value, Mapping):
        yield b"mapping:"
        for key, entry in value.items():
            yield f"{key}=".encode()
            yield from encoded(entry, digits)
    elif isinstance(value, (list, tuple)):
        yield f"{len(value)} entries:".encode()
        for entry in value:
            yield from encoded(entry, digits)
    else:
        yield from encoded_array(np.asarray(value), digits)


def encoded_array(array: Any, digits: int | None) -> Iterator[bytes]:
    """Encode an array; all NaNs are alike."""
    if array.dtype.names:
        for name in array.dtype.names:
            yield name.encode()
            yield from encoded_array(array[name], digits)
        return
    yield f"{array.shape}:".encode()
    if array.dtype.kind == "c":
        yield from encoded_array(np.stack([array.real, array.imag]), digits)
    elif array.dtype.kind == "f" and digits is None:
        yield np.where(np.isnan(array), np.nan, array).astype("<f8").tobytes()
    elif array.dtype.kind == "f":
        yield " ".join(rounded(number, digits) for number in array.ravel().tolist()).encode()
    elif array.dtype.kind in "biu":
        yield array.astype("<i8").tobytes()
    elif array.dtype.kind in "UO":
        yield json.dumps([str(entry) for entry in array.ravel().tolist()]).encode()
    else:
        raise TypeError(f"a corpus has no results of type {array.dtype}")


def rounded(number: float, digits: int) -> str:
    """Write a number with a few digits; what is left of a difference of equal numbers is 0."""
    return "0" if abs(number) < 1e-12 else f"{number:.{digits}g}"


def rounded_text(text: str, digits: int) -> str:
    """Round the numbers of a text that have more digits."""

    def shorter(match: re.Match[str]) -> str:
        is_long = len(re.sub(r"e.*|\D", "", match[0]).lstrip("0")) > digits
        return rounded(float(match[0]), digits) if is_long else match[0]

    return re.sub(r"-?\d+(\.\d+(e[+-]?\d+)?|e[+-]?\d+)", shorter, text)


def attempt(function: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    """Return what a function returns, or the sentence with which it refuses."""
    try:
        return function(*arguments, **options)
    except rocking.RockingError as error:
        return f"{type(error).__name__}: {error}"


def of_response(response: Any) -> dict[str, Any]:
    """Everything that one simulation found, but for the bracket on the time of a rest."""
    fields = ("outcome", "overturned", "unfinished", "ended_early", "overturn_time", "peak_rotation", "peak_time")
    times = np.arange(26) * (response.duration / 25.0)
    sequences = response.sequences
    return {
        **{name: getattr(response, name) for name in (*fields, "duration")},
        # Earlier names of the counts, which are part of the digests.
        "stalled": response.rests_by_rounding,
        "near_ties": response.rounding_decisions,
        "events": {name: response.events[name] for name in ("time", "kind", "side")},
        "impacts": {name: response.impacts[name] for name in ("time", "side", "speed_before", "speed_after")},
        "sequences": {name: sequences[name] for name in ("start", "end", "impacts")},
        "states": response.states(times),
    }


def of_dataset(data: Any, *leave: str) -> dict[str, Any]:
    """Arrays of an ensemble, and its axes."""
    return {str(name): data[name].values for name in sorted([*data.data_vars, *data.coords]) if name not in leave}


def of_result(result: Any, *, tables: bool = True) -> Iterator[Item]:
    """Everything that a result of an analysis writes as text."""
    yield "summary", result.summary()
    numbers = result.to_dict()
    numbers.pop("program", None)
    yield "numbers", numbers
    if tables and hasattr(result, "to_csv"):
        for table in getattr(result, "TABLES", ()):
            yield table, attempt(saved, result.to_csv, table)


def saved(write: Callable[..., Any], *arguments: Any, **options: Any) -> str:
    """Read the file that a method writes."""
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / "file", *arguments, **options)
        return (Path(folder) / "file").read_text("utf-8")


def digest(name: str) -> tuple[str, int]:
    """Compute the digest of a group and the number of its single responses."""
    items, digits, _ = GROUPS[name]
    whole, responses = hashlib.sha256(), 0
    for label, value in items():
        responses += isinstance(value, rocking.Response)
        for part in (label.encode(), *encoded(value, digits)):
            whole.update(len(part).to_bytes(8, "little") + part)
    return whole.hexdigest()[:32], responses


# Inputs, of basic arithmetic alone


def spread(count: int, *ranges: tuple[float, float]) -> list[tuple[float, ...]]:
    """Points that fill ranges evenly (a Halton sequence), of a few digits each."""
    bases = list(zip(ranges, (2, 3, 5, 7, 11, 13), strict=False))
    return [
        tuple(float(f"{low + (high - low) * halton(k + 1, base):.5g}") for (low, high), base in bases)
        for k in range(count)
    ]


def halton(k: int, base: int) -> float:
    value, share = Fraction(0), Fraction(1, base)
    while k:
        value, k, share = value + k % base * share, k // base, share / base
    return float(value)


def lobes(amplitude: float, frequency: float, *factors: float, name: str = "lobes") -> rocking.Motion:
    """Half waves of degree 4 that follow each other, as a sine's do."""
    half = 0.5 / frequency
    shape = np.array([3.2 / half, 0.0, -6.4 / (half * half * half), 3.2 / (half * half * half * half)])
    rows = [[0.0, *(amplitude * factor * shape)] for factor in factors or (1.0, -1.0)]
    return rocking.Motion(half * np.arange(len(rows) + 1), rows, name=name)


def steady(motion: rocking.Motion) -> rocking.Motion:
    """Round a pulse's polynomials to nine decimals, which hides how NumPy was built."""
    whole = np.ldexp(np.rint(np.ldexp(motion.coefficients, 30)), -30) + 0.0
    return dataclasses.replace(motion, coefficients=whole)


@functools.cache
def record(name: str = "el-centro-meloland-270", start: int = 350, end: int = 1100) -> rocking.Motion:
    """Part of a shipped record."""
    whole = rocking.records.load(name)
    return rocking.Motion.from_samples(whole.samples[start:end], whole.dt, name=name)


def shaking() -> list[rocking.Motion]:
    """Motions of every kind: records, pulses, sines, points."""
    return [
        record(),
        record("ridgecrest-clc-090", 1500, 2500),
        lobes(4.0, 0.8, 1.0, -1.0),
        lobes(6.0, 1.5, 0.5, -1.0, 0.75, -0.25),
        steady(pulses.sine(3.0, 1.25, cycles=4.0)),
        steady(pulses.ricker(5.0, 1.0)),
        pulses.rectangular(4.0, 0.5),
        rocking.Motion.from_points([0.0, 0.3, 0.5, 1.1, 1.2], [1.0, 4.0, -5.0, 2.0, 0.0]),
    ]


def scaled(factor: float) -> list[rocking.Motion]:
    return [motion.scaled(factor) for motion in shaking()]


def under(bodies: Iterable[Any], motions: Iterable[rocking.Motion], **options: Any) -> Iterator[Item]:
    """Responses of every body to every motion."""
    motions = list(motions)
    for b, body in enumerate(bodies):
        for m, motion in enumerate(motions):
            yield f"body {b}, motion {m}", rocking.simulate(body, motion, **options)


# Responses of free blocks

MODELS: Final = ("nonlinear", "linear")
RECTANGLES: Final = [rocking.Block(width=w, height=h) for w, h in spread(6, (0.15, 0.8), (0.8, 3.0))]
STATUE: Final = rocking.Block(width=0.24, height=1.1)
WALL: Final = rocking.Block.one_sided(width=0.5, height=4.0, restitution=0.4)
SLENDER: Final = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.92)
UNEVEN: Final = [
    rocking.Block.from_pivots((0.2, 0.15), 0.6, 0.4),
    rocking.Block.from_pivots((0.3, 0.12), 0.9, 0.5, restitution=(0.8, 0.9), mass=400.0),
    rocking.Block.from_parameters(p=(2.0, 2.5), alpha=(0.2, 0.14), restitution=(0.85, 0.9)),
    rocking.Block(width=0.4, height=1.5, offset=0.03),
    rocking.Block.from_frame(half_width=0.2, half_height=1.0, mass_ratio=2.0),
]


@group(model=MODELS)
def rectangles(model: str) -> Iterator[Item]:
    for factor in (0.7, 1.1):
        yield from under(RECTANGLES, scaled(factor), model=model)


@group(model=MODELS)
def parameters(model: str) -> Iterator[Item]:
    for p, alpha, e in spread(14, (1.0, 8.0), (0.05, 0.4), (0.4, 0.98)):
        blocks = [rocking.Block.from_parameters(p=p, alpha=alpha, restitution=e)]
        weak = [lobes(1.5 * G * alpha, 0.15 * p * k, 1.0, -1.0, 0.5) for k in (1, 2, 3)]
        yield from under(blocks, weak, model=model)
        yield from under(blocks, [record("ridgecrest-tow2-360", 900, 1500).scaled_to(1.6 * G * alpha)], model=model)


@group(model=MODELS)
def two_sided(model: str) -> Iterator[Item]:
    yield from under(UNEVEN, [*shaking(), *scaled(-0.8)], model=model)


@group(model=MODELS)
def one_sided(model: str) -> Iterator[Item]:
    walls = [
        WALL,
        rocking.Block.one_sided(width=0.3, height=2.0, lean=0.02),
        rocking.Block.one_sided(width=0.4, height=2.5, lean=-0.01, restitution=0.6),
    ]
    yield from under(walls, [*shaking(), *scaled(-0.6)], model=model)


@group(digits=6, fast=False)
def meshes() -> Iterator[Item]:
    statue = rocking.Solid.from_mesh("statue", density={"plinth": 2700.0, "figure": 2650.0, "head": 2650.0})
    yield from of_result(statue)
    yield from of_result(statue.rose([0.0, 45.0, 100.0]))
    for azimuth in (0.0, 50.0, 90.0, 230.0):
        block = statue.block(azimuth)
        sides = [(side.p, side.alpha, side.restitution) for side in block.sides]
        p, alpha, e = ([float(f"{value:.9g}") for value in values] for values in zip(*sides, strict=True))
        body = rocking.Block.from_parameters(p=p, alpha=alpha, restitution=e)
        yield from under([body], scaled(0.7))


@group(model=MODELS)
def restitution_laws(model: str) -> Iterator[Item]:
    laws = [
        rocking.Restitution(0.95, 0.7, slope=0.2),
        rocking.Restitution((0.95, 0.9), (0.6, 0.8), slope=(0.1, 0.3)),
        rocking.Restitution(0.95, 0.8, seed=3),
        rocking.Restitution((0.9, 0.99), (0.7, 0.8), seed=11),
    ]
    bodies = [rocking.RestrainedBlock(block, restitution=law) for block in (STATUE, UNEVEN[0]) for law in laws]
    yield from under(bodies, shaking(), model=model)


@group(model=MODELS)
def vertical(model: str) -> Iterator[Item]:
    up = record("el-centro-meloland-up", 350, 1100)
    motions = [
        record().with_vertical(up),
        record().scaled(0.6).with_vertical(up.scaled(-2.0)),
        lobes(4.0, 0.8).with_vertical(lobes(6.0, 1.3, 1.0, -1.0, 0.5)),
        lobes(3.0, 1.2, 1.0, -1.0, 1.0).with_vertical(lobes(14.0, 2.0, 1.0, -1.0, 1.0, -1.0)),
    ]
    yield from under([STATUE, SLENDER, *RECTANGLES[:3], *UNEVEN[:2]], motions, model=model)


@group(model=MODELS)
def starts(model: str) -> Iterator[Item]:
    """Initial states, durations, and motions that start late, or none."""
    for rotation, velocity, duration in spread(12, (-0.15, 0.15), (-0.3, 0.3), (0.4, 12.0)):
        start = {"initial_rotation": rotation, "initial_velocity": velocity, "model": model}
        yield "free", rocking.simulate(SLENDER, None, duration=duration, **start)
        yield from under([SLENDER, UNEVEN[1]], [lobes(3.0, 0.9), record()], duration=duration, **start)
        yield from under([STATUE], [lobes(3.0, 0.9).delayed(0.25 * duration)], **start)


TREATMENTS: Final = (
    "certified=1e-6", "velocity=1e-6", "velocity=0.01", "interval=1e-6", "interval=0.01", "time=eq76", "time=exact",
    "bypass=0.01",
)  # fmt: skip


@group(treatment=("certified", "velocity", "interval", "time", "bypass"))
def treatments(treatment: str) -> Iterator[Item]:
    for text in (each for each in TREATMENTS if each.startswith(treatment)):
        symmetric = [SLENDER, rocking.Block.from_parameters(p=3.0, alpha=0.15, restitution=0.8)]
        motions = [steady(pulses.sine(2.2, 0.8, cycles=3.0)), steady(pulses.sine(2.6, 1.2, cycles=2.0))]
        if treatment != "time":
            symmetric, motions = [*symmetric, STATUE, UNEVEN[0]], [*motions, *shaking()]
        for model in MODELS if treatment != "time" else ("linear",):
            yield from under(symmetric, motions, model=model, chattering=text)


@group()
def chattering_brackets() -> Iterator[Item]:
    """Bounds on the times of rest, of free blocks, walls, restrained blocks and bodies between stops."""
    bodies = [STATUE, SLENDER, UNEVEN[0], WALL, HELD["spring"][0]]
    between_stops = ((f"{kind}: {label}", response) for kind in BETWEEN for label, response in moved(kind))
    for label, response in (*under(bodies, [*shaking(), *scaled(0.6)]), *between_stops):
        yield label, {name: response.sequences[name] for name in ("lower", "upper")}


# Responses of restrained blocks

COLUMN: Final = rocking.Block(width=0.4, height=2.0, mass=2000.0)
LOPSIDED: Final = rocking.Block.from_pivots((0.3, 0.12), 0.9, 0.5, restitution=(0.8, 0.9), mass=400.0)


def held(*restraints: Any, **options: Any) -> list[Any]:
    """A column and a lopsided body with the same restraints, the latter's smaller as it is lighter."""

    def lighter(each: Any) -> Any:
        names = {field.name for field in dataclasses.fields(each)} - {"offset", "height", "moves_with_block"}
        return dataclasses.replace(each, **{name: 0.2 * getattr(each, name) for name in names})

    bodies = ((COLUMN, restraints), (LOPSIDED, map(lighter, restraints)))
    return [rocking.RestrainedBlock(block, *forces, **options) for block, forces in bodies]


HELD: Final = {
    "spring": held(rocking.Spring(2000.0)),
    "damper": held(rocking.Damper(400.0)),
    "tendon": held(rocking.Tendon(2e5, prestress=2e3)),
    "yielding": held(rocking.Tendon(2e5, prestress=2e3, strength=2e4)),
    "thrust": held(rocking.Thrust(500.0, height=1.5)),
    "load": held(rocking.Load(500.0, height=2.0))
    + held(rocking.Load(500.0, height=2.0, offset=0.05, moves_with_block=False)),
    "several": held(rocking.Tendon(1e5, prestress=1e3, offset=0.05), rocking.Damper(200.0), rocking.Spring(500.0))
    + held(rocking.Tendon(1e5, prestress=1e3, strength=8e3), rocking.Damper(200.0), one_sided=True, restitution=0.5),
}  # fmt: skip


@group(kind=tuple(HELD))
def restrained(kind: str) -> Iterator[Item]:
    for model in MODELS:
        yield from under(HELD[kind], [*shaking(), *scaled(1.6)], model=model)
        yield from under(HELD[kind], [lobes(2.0, 0.7)], model=model, initial_rotation=0.03, duration=5.0)


# Responses of bodies between stops

BETWEEN: Final = {
    "ball": [dynamics.BouncingBall(0.8), dynamics.BouncingBall(0.5)],
    "oscillator": [
        dynamics.ImpactOscillator(1.0, 0.8),
        dynamics.ImpactOscillator(0.7, 0.6, damping_ratio=0.05, stop=0.02),
        dynamics.ImpactOscillator(2.0, 0.7, damping_ratio=0.1, stop=-0.05, second_stop=0.2),
    ],
    "pendulum": [dynamics.InvertedPendulum(3.0, 0.3, 0.7), dynamics.InvertedPendulum(1.5, 0.1, 0.9)],
}


def moved(kind: str) -> Iterator[Item]:
    motions = [*shaking(), steady(pulses.sine(12.0, 2.0, cycles=3))]
    for b, body in enumerate(BETWEEN[kind]):
        low, high = body.stops
        about = low + 0.25 * (min(high, low + 0.2) - low)
        for m, motion in enumerate(motions):
            for duration, velocity in ((3.0, 0.0), (6.0, 0.4)):
                start = {"initial_position": about, "initial_velocity": velocity}
                yield f"body {b}, motion {m}", dynamics.simulate(body, motion, duration=duration, **start)


@group(kind=tuple(BETWEEN))
def between(kind: str) -> Iterator[Item]:
    for label, response in moved(kind):
        yield label, response
        yield "peak", response.peak_position


# What a response answers


@group(digits=6)
def forces_and_energies() -> Iterator[Item]:
    up = record("el-centro-meloland-up", 350, 1100)
    for block in (STATUE, UNEVEN[1], HELD["several"][0], rocking.Block.one_sided(width=0.5, height=4.0)):
        for motion in (record(), record().with_vertical(up), lobes(4.0, 0.8)):
            response = rocking.simulate(block, motion, duration=12.0)
            times = np.arange(60) * 0.2
            for name in (
                "normal_force",
                "friction_demand",
                "kinetic_energy",
                "potential_energy",
                "angular_acceleration",
            ):
                yield name, attempt(getattr(response, name), times)
            yield "least and most", [response.minimum_normal_force, response.required_friction, response.lift_off_time]
            yield "sliding", attempt(response.sliding_time, 0.3)
            yield "rest", [response.rest_intervals, response.time_at_rest]


@group(digits=6)
def sensitivities() -> Iterator[Item]:
    for block in (STATUE, SLENDER, HELD["tendon"][0]):
        for motion in (lobes(2.3, 0.8), lobes(2.2, 0.6).with_vertical(lobes(1.0, 1.0)), record().scaled(0.5)):
            response = rocking.simulate(block, motion)
            yield "peak", response.sensitivity.peak
            yield "rotation", response.sensitivity.rotation(np.arange(8) * 0.1)
            found = rocking.gradient(response)
            numbers = [found.value, found.coefficients[:60], found.vertical, found.initial_rotation, found.reason]
            yield "gradient", numbers


@group(digits=6)
def perturbed() -> Iterator[Item]:
    for block in (STATUE, UNEVEN[0]):
        for motion in (record(), lobes(4.0, 0.8)):
            yield from of_result(rocking.simulate(block, motion).perturbed(1e-4, 5))


# Ensembles

GRID: Final = rocking.Blocks.grid(p=[1.5, 3.0, 5.0], alpha=[0.1, 0.2, 0.3], restitution=[0.85, 0.93])
ENSEMBLES: Final = {
    "levels": (GRID, {"levels": [1.0, 2.5, 6.0], "measure": "pga", "polarity": "both"}),
    "linear": (GRID, {"levels": [0.5, 1.0], "model": "linear"}),
    "times": (GRID, {"include_times": True, "polarity": "-"}),
    "robust": (GRID.select(slice(0, 6)), {"robust": True}),
    "treatment": (GRID, {"chattering": "velocity=0.001", "duration": 5.0}),
    "two-sided": (UNEVEN, {"levels": [0.4, 1.0], "measure": "pgv"}),
    "restrained": ([*HELD["tendon"], *HELD["damper"], *HELD["yielding"]], {"levels": [1.0, 2.0]}),
    "laws": (
        [rocking.RestrainedBlock(STATUE, restitution=rocking.Restitution(0.95, 0.8, seed=s)) for s in range(4)], {},
    ),
}  # fmt: skip


@group(kind=tuple(ENSEMBLES))
def ensembles(kind: str) -> Iterator[Item]:
    bodies, options = ENSEMBLES[kind]
    motions = [*shaking(), record().with_vertical(record("el-centro-meloland-up", 350, 1100))]
    if options.get("measure"):
        motions = [motion for motion in motions if motion.pgv > 0.0]
    data = rocking.simulate_many(bodies, motions, **options)
    yield "outcomes", of_dataset(data, "p", "alpha", "restitution", "scale", "level", "motion")


@group()
def ensembles_between_stops() -> Iterator[Item]:
    for kind, bodies in BETWEEN.items():
        data = rocking.simulate_many(bodies, shaking()[:6], model="linear", duration=4.0)
        yield kind, of_dataset(data)


# Motions


@group(digits=6)
def pulse_shapes() -> Iterator[Item]:
    times = np.arange(40) * 0.05
    for motion in (
        pulses.half_sine(3.0, 0.8),
        pulses.one_sine(3.0, 0.8),
        pulses.one_cosine(3.0, 0.8),
        pulses.triangular(3.0, 0.6),
        pulses.n_lobe(3.0, 0.8, lobes=4),
        pulses.n_lobe([1.0, 2.0, 1.5], 0.8),
        pulses.rectangular(3.0, 0.7),
        pulses.ricker(3.0, 1.0),
        pulses.ricker(3.0, 1.0, kind="antisymmetric"),
        pulses.sine(3.0, 1.2, cycles=2.5, phase=0.4),
        pulses.mavroeidis_papageorgiou(3.0, 0.8, phase=0.5, gamma=2.0),
    ):
        yield motion.label, [motion.acceleration(times), motion.velocity(times), motion.displacement(times)]
        yield "measures", motion.measures((0.5, 1.0))


@group(digits=6, fast=False)
def measures_of_records() -> Iterator[Item]:
    motions = [rocking.records.load(name) for name in rocking.records.names()[:8:3]]
    motions.append(motions[0].processed(trim=(10.0, 30.0), baseline=1, band_pass=(0.1, 20.0)))
    motions.append(record().processed(resample=0.02).scaled_to(3.0, "pgv"))
    motions.append(record().rotated(record("el-centro-meloland-360"), 30.0, recorded=(270.0, 0.0)))
    motions.append(record().on_floor(0.3))
    for motion in motions:
        yield motion.name, [motion.measures((0.3, 1.0, 3.0)), motion.significant_duration(), motion.history]
        yield "spectrum", motion.spectral_acceleration([0.05, 0.2, 0.7, 2.0], 0.02)


@group()
def record_files() -> Iterator[Item]:
    from rocking import records

    for path in sorted(FORMATS.iterdir()):
        channels = repr(attempt(records.channels, path))
        yield path.name, channels.replace(str(path), path.name)
        for channel in (None, 1, 2):
            motion = attempt(rocking.read, path, channel=channel)
            yield "motion", str(motion).replace(str(path), path.name)
            yield "samples", [motion.dt, motion.times, motion.samples] if isinstance(motion, rocking.Motion) else None
    for name in rocking.records.names():
        yield name, [rocking.records.load(name).samples, str(rocking.records.info(name))]


# Analyses


@functools.cache
def suite() -> dict[str, rocking.Motion]:
    """Motions of various strength and length for analyses."""
    points = spread(9, (0.35, 2.2), (3.0, 6.0), (0.4, 1.2))
    found = {f"pulse {k}": lobes(a, f, 1.0, -1.0, third, name=f"pulse {k}") for k, (f, a, third) in enumerate(points)}
    return found | {"meloland": record()}


SUITE_BLOCKS: Final = rocking.Blocks.grid(p=[1.0, 2.5], alpha=[0.15, 0.25], restitution=[0.9])
LEVELS: Final = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0]
LIMITS: Final = {"overturning": math.inf, "half": 0.5}
QUIET: Final[dict[str, Any]] = {}


@group(digits=6)
def spectra() -> Iterator[Item]:
    p = [0.8, 1.5, 3.0, 6.0]
    blocks = rocking.Blocks.grid(alpha=[0.1, 0.2], p=p)
    yield from of_result(rocking.rocking_spectrum(blocks, suite(), **QUIET))
    weighted = rocking.rocking_spectrum([STATUE, SLENDER], suite(), size=[0.5, 1.0, 2.0], weights=[1, 2], **QUIET)
    yield from of_result(weighted)
    yield from of_result(rocking.rocking_spectrum([WALL], suite(), size=[1.0, 2.0], model="linear", **QUIET))


@group(digits=6)
def incremental() -> Iterator[Item]:
    ida = functools.partial(rocking.incremental_dynamic_analysis, **QUIET)
    yield from of_result(ida(STATUE, suite(), levels=LEVELS))
    yield from of_result(ida([SLENDER, STATUE], dict(list(suite().items())[:4]), measure="pgv", levels=[0.3, 0.6, 1.2]))


@group(digits=6, fast=False)
def overturning_maps() -> Iterator[Item]:
    axes = {"amplitudes": np.arange(1.0, 9.0, 1.0), "frequencies": [1.0, 2.0, 4.0], "rtol": 1e-7}
    for pulse, options in (("one_sine", {}), ("sine", {"cycles": 1.5}), (lambda a, f: lobes(a, f), {})):
        yield from of_result(rocking.overturning_map(SLENDER, pulse, **axes, **options, **QUIET))


@group(digits=6, fast=False)
def critical_scales() -> Iterator[Item]:
    for block in (STATUE, SLENDER, UNEVEN[0], HELD["tendon"][0]):
        for motion in (lobes(1.0, 0.8), lobes(1.0, 1.3, 1.0, -1.0, 0.5)):
            found = attempt(rocking.critical_scale, block, motion, (0.5, 60.0))
            names = ("scale", "p_derivative", "alpha_derivative", "restitution_derivative")
            yield "scale", found if isinstance(found, str) else [getattr(found, name) for name in names]


@group(digits=6)
def fragilities() -> Iterator[Item]:
    for measure in ("pga", "pgv", rocking.Measure("sa", 1.0)):
        levels = np.array(LEVELS) * (1.0 if measure == "pga" else 0.2 if measure == "pgv" else 1.3)
        found = rocking.fragility(SLENDER, suite(), measure=measure, levels=levels, limit_states=LIMITS, **QUIET)
        yield from of_result(found)
        yield "nrml", re.sub(r"rocking \d+\.\d+\.\d+", "", saved(found.to_nrml))
    clusters = [k // 2 for k in range(len(suite()))]
    yield from of_result(
        rocking.fragility(SUITE_BLOCKS, suite(), levels=LEVELS, polarity="both", clusters=clusters, **QUIET)
    )


@group(digits=6)
def bands() -> Iterator[Item]:
    options = {"trial_counts": [10, 10, 10, 9, 10], "confidence": 0.95}
    yield from of_result(rocking.fit_fragility([1.0, 2.0, 3.0, 4.0, 5.0], [0, 2, 4, 7, 9], **options))


SITE: Final = rocking.HazardCurve([0.3, 0.5, 1.0, 2.0, 5.0, 10.0], [0.2, 0.1, 0.02, 0.004, 2e-4, 1e-5])


@group(digits=6)
def risks() -> Iterator[Item]:
    fitted = rocking.fit_fragility([1.0, 2.0, 3.0, 4.0, 5.0], [0, 2, 4, 7, 10], trial_counts=10)
    yield from of_result(fitted.annual_rate(SITE))
    yield from of_result(SITE)
    yield from of_result(fitted.survival(1000.0, SITE))
    yield from of_result(fitted.survival(500.0))


@group(digits=6, fast=False)
def efficiencies() -> Iterator[Item]:
    yield from of_result(rocking.compare_measures(STATUE, suite(), periods=[0.5, 1.0], **QUIET))


@group(digits=6)
def rules_of_thumb() -> Iterator[Item]:
    blocks = [STATUE, *RECTANGLES]
    for name, rating in rocking.rules.apply_rules(blocks, record()).items():
        yield name, [rating.demand, rating.capacity, rating.ratio, rating.overturns, rating.unit]
    motions = dict(list(suite().items())[-3:])
    yield from of_result(rocking.rules.compare_rules(STATUE, motions, **QUIET))


# Calibrations


@functools.cache
def observed() -> tuple[list[rocking.Motion], list[bool]]:
    motions = [lobes(a, f) for a in (2.0, 3.5, 5.0, 6.5, 8.0) for f in (0.6, 1.0, 1.6)]
    block = rocking.Block.from_parameters(p=3.0, alpha=0.2, restitution=0.9)
    return motions, [rocking.simulate(block, one, model="linear").overturned for one in motions]


@functools.cache
def calibrated() -> Any:
    motions, overturned = observed()
    options = {"candidate_count": 128, "max_blocks": 60, "p": 3.0, "two_sided": False, "seed": 5}
    return rocking.calibrate(motions, overturned, model="linear", **options, **QUIET)


@group(digits=6, fast=False)
def calibrations() -> Iterator[Item]:
    found = calibrated()
    yield from of_result(found)
    yield "predictions", found.predict(suite(), **QUIET)
    scores = found.cross_validate(fold_count=3, seed=2, **QUIET)
    yield "scores", [scores.probabilities, str(scores.scores)]


@group(digits=5, fast=False)
def calibrations_of_histories() -> Iterator[Item]:
    times = np.arange(301) * 0.01
    block = rocking.Block.from_parameters(p=3.0, alpha=0.2, restitution=0.9)
    response = rocking.simulate(block, None, initial_rotation=0.1, duration=4.0)
    found = rocking.calibrate_history(times, response.rotation(times), alpha=0.2, seed=1, **QUIET)
    yield "estimates", {name: found.block.sides[0].__getattribute__(name) for name in ("p", "alpha", "restitution")}


@group(digits=6)
def validations() -> Iterator[Item]:
    motions, overturned = observed()
    tests = [
        rocking.ShakeTest(motion, fell, name=f"test {k}")
        for k, (motion, fell) in enumerate(zip(motions, overturned, strict=True))
    ]
    block = rocking.Block.from_parameters(p=3.2, alpha=0.21, restitution=0.88)
    options = {"outlier_probability": 0.01, "bin_count": 4, "simulation_count": 200, "seed": 3}
    yield from of_result(rocking.validate(tests, block, **options, **QUIET))
    yield from of_result(rocking.validate(tests, SUITE_BLOCKS, weights=[1.0, 2.0, 1.0, 1.0], **options, **QUIET))


# Dynamics

TABLE: Final = steady(pulses.sine(12.0, 2.0, cycles=1))
FORCING: Final = steady(pulses.sine(3.5, 1.2, cycles=1))
PERIODIC: Final = {
    "block": (SLENDER, FORCING, ([-0.1, 0.02, 0.1], [-0.2, 0.0, 0.3])),
    "ball": (dynamics.BouncingBall(0.8), TABLE, ([0.05, 0.1, 0.3], [0.1, 0.5, 1.0])),
    "oscillator": (
        dynamics.ImpactOscillator(1.0, 0.8, damping_ratio=0.05), TABLE, ([0.01, 0.1, 0.2], [-0.5, 0.0, 0.5]),
    ),
    "pendulum": (dynamics.InvertedPendulum(3.0, 0.3, 0.7), TABLE.scaled(0.3), ([-0.2, 0.0, 0.2], [-0.5, 0.1, 0.5])),
}  # fmt: skip


@group()
def maps_of_a_period() -> Iterator[Item]:
    for kind, (body, motion, (positions, velocities)) in PERIODIC.items():
        strobe = dynamics.stroboscopic_map(body, motion)
        states = np.array([(x, v) for x in positions for v in velocities])
        yield kind, list(strobe.advance(states, 12))
        yield "orbit", strobe.orbit(states[1], 5)


@group(digits=6)
def periodic_orbits() -> Iterator[Item]:
    for kind, (body, motion, _) in PERIODIC.items():
        for orbit in dynamics.periodic_orbits(body, motion, starts=24)[:4]:
            multipliers = np.sort(np.abs(orbit.multipliers))
            yield kind, [orbit.state, multipliers, orbit.impact_count, orbit.is_symmetric, orbit.has_rest]
            yield "summary", orbit.summary()


@group(digits=6, fast=False)
def continuations() -> Iterator[Item]:
    ball, one = dynamics.BouncingBall(0.5, gravity=10.0), steady(pulses.sine(10.0, 5.0, cycles=1))

    def family(level: float) -> tuple[Any, rocking.Motion]:
        return ball, one.scaled(level)

    found = dynamics.periodic_orbits(*family(1.2), starts=40)
    start = next(each for each in found if each.is_stable and not each.has_rest and each.impact_count)
    branch = dynamics.continue_orbit(start, family, 1.2, (1.0, 1.7), step=0.2)
    yield "ends", branch.ends
    yield "bifurcations", [[each.kind, each.value] for each in branch.bifurcations]
    yield "stable", [branch.orbit(0).state, branch.is_stable[[0, -1]]]


@group(digits=6)
def bifurcation_diagrams() -> Iterator[Item]:
    ball, one = dynamics.BouncingBall(0.5, gravity=10.0), steady(pulses.sine(10.0, 5.0, cycles=1))
    options = {"transient_periods": 300, "recorded_periods": 8, "direction": "both"}
    found = dynamics.bifurcation_diagram(
        lambda q: (ball, one.scaled(q)), [1.1, 1.3, 1.45, 1.6], [0.0, 0.8], **options, **QUIET
    )
    yield from of_result(found)
    yield "changes", found.changes()


@group(digits=6, fast=False)
def basins() -> Iterator[Item]:
    for body, motion, (positions, velocities) in PERIODIC.values():
        x, v = np.linspace(positions[0], positions[-1], 7), np.linspace(velocities[0], velocities[-1], 5)
        found = dynamics.basins(body, motion, x, v, 40, **QUIET)
        yield from of_result(found)


@group(digits=5)
def exponents() -> Iterator[Item]:
    for body, motion, (positions, velocities) in PERIODIC.values():
        found = dynamics.lyapunov_exponents(body, motion, (positions[1], velocities[2]), 40, transient_periods=5)
        yield (
            "exponents",
            [found.largest, found.smallest, found.impacts_per_period, found.share_at_rest, int(found.outcome)],
        )
        yield "summary", found.summary()


# Chattering of the paper's problem


@group(digits=6)
def chattering_times() -> Iterator[Item]:
    a, omega, eta = np.array([1.01, 1.03, 1.1]), np.array([[0.8], [2.0], [5.0]]), 0.9
    for method in ("exact", "asymptotic", "series", "semianalytical", "eq76", "eq77", "approximation"):
        yield method, attempt(chattering.chattering_time, a, omega, eta, method=method)
        critical = functools.partial(chattering.critical_amplitude, omega, [0.7, 0.92])
        yield f"critical {method}", attempt(critical, method=method)
    yield "complete", chattering.is_complete(a, omega, eta)
    yield "first", [chattering.first_interval(a, omega), chattering.first_impact_speed(a, omega)]
    yield "ratios", chattering.interval_ratios(1.03, 2.0, 0.92, 12)
    yield "coefficients", chattering.series_coefficients(omega, eta, order=4)
    yield "nonlinear", chattering.critical_amplitude_nonlinear([1.0, 3.0], 0.9, 0.1, **QUIET)


@group(digits=6)
def chattering_sequences() -> Iterator[Item]:
    for a, omega, eta in ((1.03, 2.0, 0.92), (1.01, 0.8, 0.7), (1.2, 5.0, 0.95)):
        found = chattering.chattering_sequence(a, omega, eta)
        yield "sequence", [found.impacts[:40], found.is_complete, found.time]
        yield "table", chattering.asymptotic_table(a, omega, eta) if found.is_complete else None


@group(digits=6)
def chattering_reports() -> Iterator[Item]:
    yield from of_result(chattering.chattering_report(1.03, 2.0, 0.92), tables=False)
    yield from of_result(chattering.chattering_report(1.02, 1.0, 0.8, p=2.0, order=3), tables=False)
    yield from of_result(chattering.critical_report(2.0, 0.92))


@group(digits=6)
def chattering_maps() -> Iterator[Item]:
    for family, axes in (
        (families.sine(SLENDER, model="linear"), {"a": [1.02, 1.1, 1.5, 4.0], "omega": [1.0, 2.0, 4.0]}),
        (families.record(record(), 0.2, 0.92), {"a": [1.1, 2.0], "p": [1.5, 3.0]}),
    ):
        found = chattering.chattering_map(family, axes, **QUIET)
        yield "map", of_dataset(found.data, "lower", "upper")


@group(digits=6)
def chattering_episodes() -> Iterator[Item]:
    for block in (STATUE, SLENDER):
        for motion in (record(), lobes(4.0, 0.8)):
            yield from of_result(chattering.chattering_episodes(rocking.simulate(block, motion)))


# Texts and files


def kinds_of_summary() -> Iterator[tuple[str, Any]]:
    yield "free", rocking.simulate(STATUE, record())
    yield "free-overturns", rocking.simulate(STATUE, record().scaled(3.0))
    yield "free-still", rocking.simulate(STATUE, record().scaled(0.1))
    yield "two-sided", rocking.simulate(UNEVEN[0], record())
    yield "wall", rocking.simulate(WALL, record())
    yield "vertical", rocking.simulate(STATUE, record().with_vertical(record("el-centro-meloland-up", 350, 1100)))
    yield "threshold", rocking.simulate(STATUE, lobes(4.0, 0.8), chattering="velocity=0.001", model="linear")


@group(digits=6)
def summaries_of_responses() -> Iterator[Item]:
    for kind, response in kinds_of_summary():
        yield kind, response.summary(0.5)
        yield "shown", repr(response)


@group(digits=6)
def summaries_of_restrained_bodies() -> Iterator[Item]:
    for kind, bodies in HELD.items():
        for body in bodies:
            response = rocking.simulate(body, record())
            yield kind, response.summary()
            yield "numbers", response.to_dict()
            yield "shown", [repr(response), repr(body)]


@group(digits=6)
def summaries_between_stops() -> Iterator[Item]:
    for kind, bodies in BETWEEN.items():
        for body in bodies:
            response = dynamics.simulate(body, TABLE, duration=4.0, initial_position=body.stops[0] + 0.05)
            yield kind, response.summary()
            yield "numbers", response.to_dict()


@group(digits=6)
def numbers_of_responses() -> Iterator[Item]:
    for kind, response in kinds_of_summary():
        yield kind, response.to_dict(0.5)


@group(digits=6)
def tables_of_responses() -> Iterator[Item]:
    for kind, response in kinds_of_summary():
        for table in ("histories", "events", "impacts"):
            yield f"{kind}: {table}", saved(response.to_csv, table, dt=0.1 if table == "histories" else None)


@group(digits=6)
def surveys() -> Iterator[Item]:
    found = rocking.survey(STATUE, {"one": record(), "two": lobes(4.0, 0.8)}, available_friction=0.4, **QUIET)
    yield from of_result(found)


@group(digits=6)
def descriptions() -> Iterator[Item]:
    for block in (*RECTANGLES[:2], SLENDER, *UNEVEN, *(bodies[0] for bodies in HELD.values()), GRID):
        yield "block", [repr(block), getattr(block, "description", "")]
        if hasattr(block, "uplift_thresholds"):
            yield "thresholds", [block.uplift_thresholds(model) for model in MODELS]
    for motion in shaking():
        yield "motion", [repr(motion), motion.label]


SIZES: Final = "--width 0.24 --height 1.1"
RECORD: Final = "el-centro-meloland-270"
PULSE: Final = "--pulse one-sine:amplitude=0.4g,frequency=1Hz"
TWO: Final = f"{RECORD} el-centro-meloland-360"
COMMANDS: Final = {
    "simulate": [
        f"simulate {RECORD} {SIZES}",
        f"simulate {PULSE} {SIZES} --json",
        f"simulate {TWO} {SIZES}",
        f"simulate {PULSE} --p 2 --alpha 10deg --model linear --chattering interval=1e-6",
    ],
    "restrained": [
        f"simulate {RECORD} {SIZES} --mass 200 --damper 50 --spring 100",
        f"simulate {PULSE} --width 0.5 --height 4 --one-sided --lean 1deg --json",
    ],
    "analyses": [
        f"spectrum {TWO} --alpha 0.1,0.2 --p 1:4:4:log",
        f"ida {TWO} {SIZES} --levels 1:6:6",
        "map one-sine --p 2 --alpha 0.2 --amplitudes 1:6:6 --frequencies 1,2",
        f"check {TWO} {SIZES}",
        f"measures {TWO} el-centro-meloland-up {SIZES}",
    ],
    "catalogues": ["records", f"records {RECORD}", "pulses", "pulses --json"],
    "chattering": ["chatter 1.03 2 0.92", "chatter 1.03 2 0.92 --table", "critical 2 0.92"],
    "mesh": ["mesh statue --density 2600 --azimuth 0,90"],
    "mistakes": [
        f"simulate {RECORD}",
        f"simulate {RECORD} --width -1 --height 1",
        f"simulate no-such-record {SIZES}",
        f"simulate {PULSE} {SIZES} --chattering wrong=1",
        f"spectrum {RECORD} --alpha x",
        f"ida {RECORD} {SIZES} --levels 0",
        f"map no-pulse {SIZES}",
    ],
}


@group(digits=6, subject=("simulate", "restrained", "catalogues", "chattering", "mistakes"))
def commands(subject: str) -> Iterator[Item]:
    for command in COMMANDS[subject]:
        yield command, printed(command)


def printed(command: str) -> list[Any]:
    """Run a command in this process: its exit code, output and messages."""
    from rocking.cli import main

    out, err, code = io.StringIO(), io.StringIO(), 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main(command.split())
        except SystemExit as stop:
            code = int(stop.code or 0)
    text = re.sub(r'"program": "[^"]*"', "", out.getvalue())
    return [code, re.sub(r" in \S+ s \(\S+ a second\)", "", text), err.getvalue().splitlines()]


@group(digits=6, fast=False, subject=("analyses", "mesh"))
def long_commands(subject: str) -> Iterator[Item]:
    yield from commands(subject)


STUDY: Final = """\
[blocks]
p = [1.5, 3.0]
alpha = ["10deg", 0.2]
restitution = 0.9

[motions]
records = ["el-centro-meloland-270"]

[[motions.pulses]]
family = "one-sine"
amplitude = ["0.3g", "0.5g"]
frequency = [0.5, 1.0]

[scales]
pga = [1.0, 2.0, 3.0, 4.5, 6.0]
polarity = "both"
"""
OBSERVED: Final = "pga_m_s2,overturned\n1,0\n2,0\n2.5,1\n3,0\n3.5,1\n4,0\n4.5,1\n5,1\n6,1\n"
RATES: Final = "pga_m_s2,annual_rate\n0.3,0.2\n0.5,0.1\n1,0.02\n2,0.004\n5,0.0002\n10,0.00001\n"
TESTS: Final = """\
motion,scale,overturned
ridgecrest-clc-090,0.5,0
ridgecrest-clc-090,2,1
el-centro-meloland-270,1,0
"""
SHAKEN: Final = "motion,scale,overturned\n" + "".join(
    f"{name},{scale},{int(scale > 1.2)}\n" for name in TWO.split() for scale in (0.4, 0.8, 1.1, 1.3, 2, 3)
)
ON_FILES: Final = {
    "fragility": [
        "fragility --outcomes observed.csv --hazard rates.csv --years 50 --out fitted",
        f"fragility {TWO} ridgecrest-tow2-090 --p 1 --alpha 0.25 --levels 0.5:30:12 "
        "--limit-states overturning,half=0.5",
        "fragility --outcomes observed.csv --confidence 0.8 --json",
    ],
    "tests": [
        f"validate tests.csv {SIZES} --outlier-probability 0.01 --out judged",
        "calibrate shaken.csv --candidate-count 128 --p 3 --restitution housner --no-two-sided",
    ],
    "study": [
        "study new template.toml",
        "study run study.toml kept --quiet",
        "study status kept",
        "study report kept report --quiet --limit-states overturning,half=0.5",
        "study verify kept --quiet",
    ],
}


@group(digits=6, fast=False, subject=tuple(ON_FILES))
def commands_on_files(subject: str) -> Iterator[Item]:
    """What commands print of files, and the tables that they write."""
    texts = {"observed": OBSERVED, "rates": RATES, "tests": TESTS, "shaken": SHAKEN}
    texts = {"study.toml": STUDY} | {f"{name}.csv": text for name, text in texts.items()}
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for name, text in texts.items():
            Path(name).write_text(text, encoding="utf-8")
        for command in ON_FILES[subject]:
            yield command, printed(command)
        for path in sorted(Path().rglob("*.csv")):
            if path.name not in texts:
                yield str(path), path.read_text("utf-8")


@group()
def defaults() -> Iterator[Item]:
    """Arguments of public functions, and their defaults."""
    for place in (rocking, rocking.pulses, rocking.records, rocking.rules, dynamics, chattering, families):
        for name in sorted(getattr(place, "__all__", vars(place))):
            function = getattr(place, name)
            if inspect.isfunction(function) and not name.startswith("_"):
                parameters = inspect.signature(function).parameters.values()
                yield name, [f"{each.name} = {each.default}" for each in parameters if each.name != "refine"]


@group(digits=6)
def studies() -> Iterator[Item]:
    from rocking.studies import read_study

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "study.toml").write_text(STUDY, encoding="utf-8")
        product = read_study(folder / "study.toml").product
        yield "product", [product.shape, product.model, str(product.chattering)]
        motions = dict(list(suite().items())[:5])
        study = rocking.create_study(folder / "study", SUITE_BLOCKS, motions, levels=LEVELS, measure="pga")
        with rocking.set_options(threads=1):
            study.run()
        yield (
            "complete",
            [
                study.status.is_complete,
                study.status.done_count,
                study.status.batch_count,
                study.status.simulation_count,
            ],
        )
        yield "results", of_dataset(study.results())
        yield "critical", of_dataset(study.critical_scales())
        yield from of_result(study.fragility(limit_states=LIMITS))
        yield from of_result(study.block_fragilities(**QUIET))
        yield from of_result(study.spectrum(**QUIET))
        yield "verified", study.verify(recompute_count=1)
        for critical in (None, "overturning"):
            yield "table", saved(study.to_csv, critical=critical)


# The file of digests


def written() -> Any:
    """Read the digests of the file: for each group its digest, and how many single responses are in it."""
    return json.loads(FILE.read_text("utf-8"))


def main(arguments: list[str] | None = None) -> int:
    """Write or compare digests."""
    parser = argparse.ArgumentParser(description="Digests of what the package computes.")
    how = parser.add_mutually_exclusive_group(required=True)
    how.add_argument("--compare", action="store_true", help="print the groups that differ; the exit status is 1 then")
    how.add_argument("--write", action="store_true", help="write the digests of these groups anew")
    how.add_argument("--items", action="store_true", help="print a digest for each item, to compare two versions")
    parser.add_argument("groups", nargs="*", metavar="GROUP", help="by default all")
    options = parser.parse_args(arguments)
    chosen = options.groups or [*GROUPS]
    if unknown := sorted(set(chosen) - set(GROUPS)):
        parser.error(f"{', '.join(unknown)} is no group; the groups are {', '.join(GROUPS)}")
    for name in chosen if options.items else ():
        for k, (label, value) in enumerate(GROUPS[name].items()):
            print(name, k, hashlib.sha256(b"\0".join(encoded(value, GROUPS[name].digits))).hexdigest()[:12], label)
    if options.items:
        return 0
    known = written() if FILE.exists() else {}
    found = {name: [*digest(name)] for name in chosen}
    differ = [name for name in chosen if known.get(name) != found[name]]
    if not options.groups:
        differ += sorted(set(known) - set(found))
    if options.write:
        kept = {name: (known | found)[name] for name in GROUPS if name in found or name in known}
        rows = ",\n".join(f"  {json.dumps(name)}: {json.dumps(entry)}" for name, entry in kept.items())
        FILE.write_text(f"{{\n{rows}\n}}\n", encoding="utf-8")
    for name in differ:
        print(f"{'new' if name not in known else 'differs' if name in found else 'gone'}: {name}")
    print(f"{len(differ)} of {len(chosen)} groups differ" + (f"; {FILE.name} was written" if options.write else ""))
    return bool(differ) and not options.write


if __name__ == "__main__":
    sys.exit(main())
