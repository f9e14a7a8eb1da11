"""Ways to end chattering, and time stepping, beside the certified response: rests, errors and processor time.

Usage: python benchmarks/bench_schemes.py

A rest stands for the certified rest with which it overlaps; without one it is false. A certified rest without a
counterpart is missed. Time stepping locates no impact; its rests are 16 steps in contact without a break.
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

import rocking
from rocking import dynamics

Floats = NDArray[np.float64]

TREATMENTS = (
    *(f"velocity={threshold:g}" for threshold in (5e-10, 1e-6, 1e-3, 5e-2)),
    *(f"interval={threshold:g}" for threshold in (1e-9, 1e-6, 1e-3)),
    "time",
    *(f"bypass={threshold:g}" for threshold in (1e-6, 1e-3, 5e-2)),
)
STEPS = (1e-2, 1e-3, 1e-4)
STEPS_AT_REST = 16
COMPARED = 20_001

PAPER = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92)
STATUE = rocking.Block(half_width=0.12, half_height=0.55)
RECORD = "ridgecrest-clc-090"


class Outcome(NamedTuple):
    """What a scheme makes of a case; times in s, the error of the position over the largest certified one."""

    scheme: str
    response: Any
    rests: Floats  # start and end of each
    certified: Floats  # start of the certified rest that each stands for, NaN where there is none
    missed: Floats
    position_error: float
    seconds: float
    wrong: bool  # whether it is wrong about overturning

    @property
    def false_rests(self) -> Floats:
        return self.rests[np.isnan(self.certified), 0]

    @property
    def errors(self) -> Floats:
        """Errors in time of the rests that are true."""
        return (self.rests[:, 0] - self.certified)[~np.isnan(self.certified)]

    @property
    def is_right(self) -> bool:
        return not (self.false_rests.size or self.missed.size or self.wrong)


class Stepped(NamedTuple):
    """What time stepping makes of a body: position at each time, rests, and whether the body overturns."""

    times: Floats
    position: Floats
    velocity: Floats
    impulse: Floats
    rests: Floats
    overturned: bool


class Law(NamedTuple):
    """A body off the ground, in the frame of the side that it is on: which equation, its numbers, what it enters."""

    kind: int  # 0: linear block, 1: nonlinear block, 2: ball
    p: float
    alpha: float
    gravity: float
    restitution: float
    other: int  # -1: an impact changes the side


def law_of(body: Any, model: str) -> Law:
    """Return the law of a symmetric block, or of a ball."""
    if isinstance(body, rocking.Block):
        return Law(int(model == "nonlinear"), body.p, body.alpha, body.gravity, body.restitution, -1)
    return Law(2, 0.0, math.inf, body.gravity, body.restitution, 1)


@numba.njit(error_model="numpy")
def acceleration(law, side, ground, u):
    """Acceleration of u under a ground acceleration."""
    if law[0] == 2:
        return -law[3] - ground
    push = side * ground / law[3]
    if law[0] == 0:
        return law[1] ** 2 * (u - law[2] - push)
    return -(law[1] ** 2) * (math.sin(law[2] - u) + push * math.cos(law[2] - u))


@numba.njit(error_model="numpy")
def moreau_jean(law, ground, h, start, rows):
    """Moreau and Jean's theta method (1/2), with Newton's restitution on velocities; returns the rows written.

    A row is the side, u, its velocity, and what the contact adds to the velocity. As in Siconos the contact is active
    where u + h v/2 <= 0.
    """
    side, u, v = start
    for k in range(len(rows)):
        rows[k, 0], rows[k, 1], rows[k, 2] = side, u, v
        if u >= 0.5 * math.pi and law[5] < 0:
            return k + 1
        if k + 1 == len(rows):
            break
        here = acceleration(law, side, ground[k], u)
        free = v + h * here
        for _ in range(30):  # a contraction
            before = free
            free = v + 0.5 * h * (acceleration(law, side, ground[k + 1], u + 0.5 * h * (free + v)) + here)
            if free == before:
                break
        end = max(free, -law[4] * v) if u + 0.5 * h * v <= 0.0 else free
        u, v = u + 0.5 * h * (end + v), end
        rows[k + 1, 3] = end - free
        if end > free:
            side *= law[5]
    return len(rows)


@numba.njit(error_model="numpy")
def schatzman_paoli(law, ground, h, start, rows):
    """Schatzman and Paoli's central differences, with the restitution on positions; rows as of `moreau_jean`.

    An impact takes two steps in contact or three, of which the first changes the side.
    """
    side, u, v = start
    before, in_contact = u, 0
    for k in range(len(rows)):
        rows[k, 0], rows[k, 1], rows[k, 2] = side, u, v if k == 0 else (u - before) / h
        if u >= 0.5 * math.pi and law[5] < 0:
            return k + 1
        if k + 1 == len(rows):
            break
        force = acceleration(law, side, ground[k], u)
        if k == 0:
            free, least = u + h * (v + 0.5 * h * force), 0.0
        else:
            free, least = u + (u - before) + h * h * force, -law[4] * before
        before, u = u, max(free, least)
        rows[k + 1, 3] = (u - free) / h
        if u > free and in_contact % 3 == 0:
            side *= law[5]
        in_contact = in_contact + 1 if u > free else 0
    return len(rows)


SCHEMES = {"moreau-jean": moreau_jean, "schatzman-paoli": schatzman_paoli}


def integrate(body, motion, scheme: str, h: float, duration: float, *, model="linear", position=0.0) -> Stepped:
    """Follow a symmetric block or a ball by a scheme of a fixed step."""
    count = math.ceil(duration / h * (1.0 - 2.0**-50)) + 1
    times: Floats = h * np.arange(count, dtype=np.float64)
    ground = np.zeros(count) if motion is None else motion.acceleration(times)
    rows = np.zeros((count, 4))
    start = (-1, -position, 0.0) if position < 0.0 else (1, position, 0.0)
    rows = rows[: SCHEMES[scheme](tuple(law_of(body, model)), ground, h, start, rows)]
    edges = np.diff(np.concatenate([[False], rows[:, 3] > 0.0, [False]]).astype(np.int8))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    rests = (ends - starts >= STEPS_AT_REST) & (starts > 1)
    until = np.append(times[: len(rows)], math.inf)
    stretches = np.column_stack([times[starts], until[ends]])[rests]
    over = isinstance(body, rocking.Block) and rows[-1, 1] >= 0.5 * math.pi
    return Stepped(times[: len(rows)], rows[:, 0] * rows[:, 1], rows[:, 0] * rows[:, 2], rows[:, 3], stretches, over)


def rests_of(response: Any) -> Floats:
    """Start and end of each rest; the last may have no end."""
    if isinstance(response, Stepped):
        return response.rests
    times, kinds = response.events["time"], response.events["kind"]
    return np.column_stack([times, np.append(times, math.inf)[1:]])[kinds == "rest"]


def judged(scheme: str, response: Any, certified: Any, seconds: float = math.nan) -> Outcome:
    """Hold a response against the certified one."""
    rests, proven = rests_of(response), rests_of(certified)
    overlap = np.minimum.outer(rests[:, 1], proven[:, 1]) - np.maximum.outer(rests[:, 0], proven[:, 0])
    found = np.array([proven[np.argmax(row > 0.0), 0] if np.any(row > 0.0) else math.nan for row in overlap])
    exact = position_of(certified)
    end = min(certified.duration, response.times[-1] if isinstance(response, Stepped) else response.duration)
    if isinstance(response, Stepped):
        every = len(response.times) // COMPARED + 1
        times, position = response.times[::every], response.position[::every]
        position, times = position[times <= end], times[times <= end]
    else:
        times = np.linspace(0.0, end, COMPARED)
        position = position_of(response)(times)
    largest = np.max(np.abs(exact(np.linspace(0.0, certified.duration, COMPARED))))
    missed = np.setdiff1d(proven[:, 0], found[~np.isnan(found)])
    off = float(np.max(np.abs(position - exact(times))))
    error = off / largest if largest > 0.0 else math.nan
    return Outcome(scheme, response, rests, found, missed, error, seconds, response.overturned != certified.overturned)


def position_of(response: Any) -> Callable[[Floats], Floats]:
    """Rotation of a block, or position of another body, at times."""
    return response.rotation if hasattr(response, "rotation") else response.position


def compare(body, motion, schemes, *, model="linear", position=0.0) -> tuple[Any, list[Outcome]]:
    """Follow one case with each scheme; returns the certified response, and what each scheme makes of the case.

    A scheme is a treatment, as `rocking.simulate` accepts it, or "moreau-jean=STEP" or "schatzman-paoli=STEP", in s.
    """

    def marched(how) -> Any:
        if isinstance(body, rocking.Block):
            return rocking.simulate(body, motion, model=model, chattering=how, initial_rotation=position)
        return dynamics.simulate(body, motion, chattering=how, initial_position=position)

    certified, found = marched("certified"), []
    for scheme in schemes:
        name, _, step = str(scheme).partition("=")
        before = time.thread_time()
        try:
            if name in SCHEMES:
                duration = 1.05 * certified.duration
                response = integrate(body, motion, name, float(step), duration, model=model, position=position)
            else:
                response = marched(scheme)
        except rocking.errors.OptionError:
            continue  # the asymptotic time is for blocks under sines
        found.append(judged(str(scheme), response, certified, time.thread_time() - before))
    return certified, found


def main() -> None:
    paper = [rocking.pulses.sine(a * PAPER.gravity * 0.2, 1.0 / math.pi, cycles=2.5) for a in (1.03, 1.05)]
    cases: list[tuple[str, Any, Any, str, float]] = [
        ("The paper's Fig. 10: complete chattering, a = 1.03", PAPER, paper[0], "linear", 0.0),
        ("The paper's Fig. 11: incomplete chattering, a = 1.05", PAPER, paper[1], "linear", 0.0),
        (f"A block of 0.24 m by 1.10 m under {RECORD}", STATUE, rocking.records.load(RECORD), "nonlinear", 0.0),
        ("A ball dropped from 1 m, restitution 0.9", dynamics.BouncingBall(0.9, gravity=9.81), None, "linear", 1.0),
    ]
    schemes = (*TREATMENTS, *(f"{name}={step:g}" for name in SCHEMES for step in STEPS))
    for title, body, motion, model, position in cases:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rocking.errors.OutsideFitWarning)
            compare(body, motion, schemes, model=model, position=position)  # compiles
            certified, found = compare(body, motion, schemes, model=model, position=position)
        print(f"{title}; certified rests: {len(rests_of(certified))}\n")
        print("| scheme | rests | false | missed | worst error of a true rest, s | position off by | time, ms |")
        print("|---|--:|--:|--:|--:|--:|--:|")
        for each in found:
            worst = f"{each.errors[np.argmax(np.abs(each.errors))]:+.1e}" if each.errors.size else ""
            counts = f"{len(each.rests)} | {each.false_rests.size} | {each.missed.size}"
            print(f"| {each.scheme} | {counts} | {worst} | {each.position_error:.0e} | {1e3 * each.seconds:.2g} |")
        print()


if __name__ == "__main__":
    main()
