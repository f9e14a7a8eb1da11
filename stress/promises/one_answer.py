"""The same outcomes, bit for bit, however an ensemble is computed.

An ensemble of many blocks under a record is computed with 1, 2 and 7 threads, in batches of several sizes, and in
shuffled order; as a study in batches of several sizes, and some by processes. For one ensemble kernels are compiled
by numba in the process itself, and taken from the library of each level of the processor. Digests of all outcomes are
compared, sorted as the blocks were given.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

import rocking
from promises.promise import Found, Promise
from rocking.kernels import library

#: Blocks of an ensemble: three batches of the smallest size of a study.
BLOCKS = 1100

#: Ensembles whose studies are run by processes, too, and the one for which kernels come from elsewhere, too.
BY_WORKERS, ELSEWHERE = (5, 15, 25), 7

_PROGRAM = """
import sys
from pathlib import Path
from rocking.kernels import library
if len(sys.argv) > 2:
    library.FOLDER = Path(sys.argv[2])
from promises.one_answer import direct
print(direct(int(sys.argv[1])))
if ("numba" in sys.modules) != (len(sys.argv) == 2):
    sys.exit("numba compiles kernels with ROCKING_JIT=1, and otherwise is not imported")
"""

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


def direct(part: int, threads: int = 1) -> str:
    """Digest of the ensemble in one call."""
    blocks, motion, model = drawn(part)
    return digest(_outcomes(blocks, motion, model, threads))


def _outcomes(blocks: rocking.Blocks, motion: rocking.Motion, model: str, threads: int = 1) -> dict[str, np.ndarray]:
    with rocking.set_options(threads=threads):
        found = rocking.simulate_many(blocks, motion, model=model)  # type: ignore[arg-type]
    return {str(name): values.values.reshape(-1) for name, values in found.data_vars.items()}


def rearranged(part: int, batch: int, *, shuffled: bool) -> str:
    """Digest of the ensemble computed in batches, in another order if asked, and put together as it was given."""
    blocks, motion, model = drawn(part)
    order = np.random.default_rng([59, part]).permutation(BLOCKS) if shuffled else np.arange(BLOCKS)
    parts = [_outcomes(blocks.select(order[k : k + batch]), motion, model) for k in range(0, BLOCKS, batch)]
    whole = {name: np.concatenate([each[name] for each in parts]) for name in parts[0]}
    return digest({name: values[np.argsort(order)] for name, values in whole.items()})


def as_study(part: int, blocks_per_batch: int, processes: int = 0) -> str:
    """Digest of the ensemble as a study, in batches of so many blocks, by a thread or by processes."""
    blocks, motion, model = drawn(part)
    with tempfile.TemporaryDirectory() as folder:
        made = rocking.create_study(folder, blocks, motion, model=model, blocks_per_batch=blocks_per_batch)  # type: ignore[arg-type]
        if processes:
            with ProcessPoolExecutor(processes, get_context("spawn")) as executor:
                made.run(executor=executor)
        else:
            with rocking.set_options(threads=1):
                made.run()
        return digest({str(name): values.values.reshape(-1) for name, values in made.results().data_vars.items()})


def _apart(part: int, *library: Path) -> str:
    """Digest from a process of its own, with the library in a folder or, if none is named, with numba."""
    path = os.pathsep.join(each for each in sys.path if each)
    environment = os.environ | {"PYTHONPATH": path, "ROCKING_JIT": "0" if library else "1"}
    command = [sys.executable, "-c", _PROGRAM, str(part), *map(str, library)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else f"error: {done.stderr.strip()[-300:]}"


def elsewhere(part: int) -> Iterator[tuple[str, str]]:
    """Digests with kernels that numba compiles, and with the libraries up to each level that were built."""
    yield "kernels compiled by numba", _apart(part)
    manifest = library.read_manifest()
    for count, highest in enumerate(manifest["libraries"], 1):
        with tempfile.TemporaryDirectory() as name:
            folder = shutil.copytree(library.FOLDER, Path(name, "built"))
            lower = {**manifest, "libraries": manifest["libraries"][:count]}
            (folder / "manifest.json").write_text(json.dumps(lower), "utf-8")
            yield f"libraries up to level {highest['level']}", _apart(part, folder)


WAYS: dict[str, Callable[[int], str]] = {
    "2 threads": lambda part: direct(part, 2),
    "7 threads": lambda part: direct(part, 7),
    "batches of 5": lambda part: rearranged(part, 5, shuffled=False),
    "batches of 7, shuffled": lambda part: rearranged(part, 7, shuffled=True),
    "batches of 64, shuffled": lambda part: rearranged(part, 64, shuffled=True),
    "whole, shuffled": lambda part: rearranged(part, BLOCKS, shuffled=True),
    "a study in batches of 512": lambda part: as_study(part, 512),
    "a study in batches of 1024": lambda part: as_study(part, 1024),
}


def judge(part: int) -> Found:
    """Compare all ways with one thread."""
    found, expected = Found(parts=1), direct(part)
    for name, answer in _answers(part):
        found.cases += 1
        found.judged += 1
        found.notes[name] += 1
        if answer != expected:
            found.fail(f"ensemble {part}: {name} is not as one thread: {answer}")
    return found


def _answers(part: int) -> Iterator[tuple[str, str]]:
    for name, way in WAYS.items():
        yield name, way(part)
    if part in BY_WORKERS:
        yield "a study by two processes", as_study(part, 512, processes=2)
    if part == ELSEWHERE:
        yield from elsewhere(part)


def table(found: Found) -> str:
    """List the ways, and how many ensembles were computed in each."""
    lines = ["| computed as | ensembles |", "|---|--:|"]
    return "\n".join([*lines, *(f"| {name} | {count} |" for name, count in found.notes.items())]) + "\n"


PROMISE = Promise(
    name="one-answer",
    says="the same bits however an ensemble is computed",
    parts=30,
    small=2,
    judge=judge,
    table=table,
    above=("cli", "explorer"),
)
