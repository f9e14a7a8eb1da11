"""Ten million simulations in ensembles, single ones, openings of the page: memory stays, and no descriptor is left.

The first parts are short, the others long; a part is of one kind, and is done in one process after a first round, in
which what is kept for good (kernels, tables, imports) is made.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np

import rocking
from promises.promise import Found, Promise
from promises.serving import Running, served

#: Rounds of a short and a long part, of each kind; memory is looked at after each.
ROUNDS: Final = ((8, 8, 8), (200, 100, 100))

#: Blocks of an ensemble, single simulations and openings of a round.
BLOCKS: Final = 50_000
SINGLE: Final = 200
OPENINGS: Final = 3

#: Rounds before memory is looked at, and the share by which it may grow.
_FIRST: Final = 3
DRIFT: Final = 0.05

#: What the page asks for while it opens.
_OPENING: Final = (
    *("/", "/page/main.js", "/api/start"),
    *(f"/api/{each}?p=2.5&alpha=0.2&motion=el-centro-meloland-270" for each in ("case", "details")),
)


def _ensemble(round_: int) -> int:
    rng = np.random.default_rng([71, round_])
    blocks = rocking.Blocks(
        p=rng.uniform(3.0, 9.0, BLOCKS), alpha=rng.uniform(0.1, 0.4, BLOCKS), restitution=rng.uniform(0.3, 0.8, BLOCKS)
    )
    motion = rocking.pulses.one_sine(float(rng.uniform(2.0, 4.0)), 2.0)
    with rocking.set_options(threads=1):
        found = rocking.simulate_many(blocks, motion)
    return int(found.overturned.size)


def _single(round_: int) -> int:
    rng = np.random.default_rng([73, round_])
    motion = rocking.pulses.one_sine(3.0, 1.0)
    for p, alpha in zip(rng.uniform(1.0, 8.0, SINGLE), rng.uniform(0.1, 0.3, SINGLE), strict=True):
        rocking.simulate(rocking.Block.from_parameters(p=p, alpha=alpha, restitution=0.8), motion)
    return SINGLE


def _openings(running: Running) -> Callable[[int], int]:
    def opened(_: int) -> int:
        for _ in range(OPENINGS):
            answers = [running.status("GET", path, running.own)[0] for path in _OPENING]
            if answers != [200] * len(_OPENING):
                raise AssertionError(answers)
        return OPENINGS

    return opened


def judge(part: int) -> Found:
    """Repeat one kind of work, and look at memory and descriptors."""
    found, rounds = Found(parts=1), ROUNDS[part // 3][part % 3]
    if part % 3 < 2:
        _judge_rounds(
            found,
            ("simulations in ensembles", "single simulations")[part % 3],
            (_ensemble, _single)[part % 3],
            "self",
            rounds,
        )
    else:
        with served() as running:
            _judge_rounds(found, "openings", _openings(running), str(running.process.pid), rounds)
    return found


def _judge_rounds(found: Found, what: str, work: Callable[[int], int], process: str, rounds: int) -> None:
    for round_ in range(_FIRST):
        work(round_)
    memory, descriptors = [], []
    for round_ in range(rounds):
        found.notes[what] += work(_FIRST + round_)
        memory.append(_resident(process))
        descriptors.append(len([*Path(f"/proc/{process}/fd").iterdir()]))
    quarter = max(rounds // 4, 1)
    before, after = statistics.median(memory[:quarter]), statistics.median(memory[-quarter:])
    drift = after / before - 1.0
    found.cases += 2
    found.judged += 2
    found.worst = max(found.worst, drift / DRIFT)
    if drift > DRIFT:
        found.fail(f"{what}: memory grew from {before / 2**20:.0f} to {after / 2**20:.0f} MiB")
    if max(descriptors[-quarter:]) > max(descriptors[:quarter]):
        found.fail(f"{what}: from {max(descriptors[:quarter])} to {max(descriptors[-quarter:])} descriptors")


def _resident(process: str) -> int:
    """Resident memory of a process, bytes."""
    line = next(each for each in Path(f"/proc/{process}/status").read_text().splitlines() if each.startswith("VmRSS"))
    return int(line.split()[1]) * 1024


def table(found: Found) -> str:
    """Say how much was done."""
    return "Done were " + ", ".join(f"{count} {what}" for what, count in sorted(found.notes.items())) + ".\n"


PROMISE = Promise(
    name="soak", says="memory and descriptors stay, however long it runs", parts=6, small=3, judge=judge, table=table
)
