"""The same outcomes, bit for bit, however an ensemble is computed.

An ensemble of many blocks under a record is computed with 1, 2 and 7 threads, in batches of several sizes, and in
shuffled order. What is compared are digests of all outcomes, sorted as the blocks were given.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable

import numpy as np

import rocking
from promises.promise import Found, Promise

#: Blocks of an ensemble.
BLOCKS = 300

_RECORDS = ("el-centro-meloland-270", "ridgecrest-clc-090")


def drawn(part: int) -> tuple[rocking.Blocks, rocking.Motion, str]:
    """Blocks, a motion (every third with a vertical component) and the model of a part."""
    rng = np.random.default_rng([53, part])
    blocks = rocking.Blocks(
        p=rng.uniform(0.8, 8.0, BLOCKS),
        alpha=rng.uniform(0.05, 0.4, BLOCKS),
        restitution=rng.uniform(0.5, 0.95, BLOCKS),
    )
    motion = rocking.records.load(_RECORDS[part % 2]).scaled(float(rng.uniform(0.5, 3.0)))
    if part % 3 == 0:
        motion = motion.with_vertical(rocking.records.load("el-centro-meloland-up"))
    return blocks, motion, ("linear", "nonlinear")[part // 2 % 2]


def digest(data: dict[str, np.ndarray]) -> str:
    """Hash of all outcomes."""
    total = hashlib.sha256()
    for name in sorted(data):
        values = np.ascontiguousarray(data[name])
        total.update(name.encode() + str(values.dtype).encode() + values.tobytes())
    return total.hexdigest()


def direct(part: int, threads: int | None = 1) -> str:
    """Digest of the ensemble in one call."""
    blocks, motion, model = drawn(part)
    return digest(_outcomes(blocks, motion, model, threads))


def _outcomes(
    blocks: rocking.Blocks, motion: rocking.Motion, model: str, threads: int | None = 1
) -> dict[str, np.ndarray]:
    found = rocking.simulate_many(blocks, motion, model=model, threads=threads, progress=False)  # type: ignore[arg-type]
    return {str(name): values.values.reshape(-1) for name, values in found.data_vars.items()}


def rearranged(part: int, batch: int, *, shuffled: bool) -> str:
    """Digest of the ensemble computed in batches, in another order if asked, and put together as it was given."""
    blocks, motion, model = drawn(part)
    order = np.random.default_rng([59, part]).permutation(BLOCKS) if shuffled else np.arange(BLOCKS)
    parts = [_outcomes(blocks.select(order[k : k + batch]), motion, model) for k in range(0, BLOCKS, batch)]
    whole = {name: np.concatenate([each[name] for each in parts]) for name in parts[0]}
    return digest({name: values[np.argsort(order)] for name, values in whole.items()})


WAYS: dict[str, Callable[[int], str]] = {
    "2 threads": lambda part: direct(part, 2),
    "7 threads": lambda part: direct(part, 7),
    "batches of 5": lambda part: rearranged(part, 5, shuffled=False),
    "batches of 7, shuffled": lambda part: rearranged(part, 7, shuffled=True),
    "batches of 64, shuffled": lambda part: rearranged(part, 64, shuffled=True),
    "whole, shuffled": lambda part: rearranged(part, BLOCKS, shuffled=True),
}


def judge(part: int) -> Found:
    """Compare all ways with one thread."""
    found, expected = Found(parts=1), direct(part)
    for name, way in WAYS.items():
        found.cases += 1
        found.judged += 1
        if way(part) != expected:
            found.fail(f"ensemble {part}: {name} differ from one thread")
    return found


PROMISE = Promise(
    name="one-answer",
    says="the same bits however an ensemble is computed",
    parts=30,
    small=2,
    judge=judge,
)
