"""The same outcomes, bit for bit, however an ensemble is computed.

An ensemble of many blocks under a record is computed with 1, 2 and 7 threads, in batches of several sizes, and in
shuffled order; as a study in units of several sizes, and some also by workers of dask.distributed. For one ensemble
kernels are compiled anew, read from that cache, and taken from libraries as they come with the package. What is
compared are digests of all outcomes, sorted as the blocks were given.
"""

from __future__ import annotations

import hashlib
import json
import os
import runpy
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import rocking
from promises.promise import Found, Promise
from rocking.studies.run import local_executor

#: Blocks of an ensemble: three units of the smallest size of a study.
BLOCKS = 1100

#: Ensembles whose studies are run by workers, too, and the one for which kernels are compiled anew.
BY_WORKERS, ANEW = (5, 15, 25), 7

#: Kernels that an ensemble calls: a library of these serves it without numba.
_KERNELS = ("lanes.run_lanes", "lanes.march_each", "march.march", "ground.fill", "uplift.note_complete")

_PROGRAM = """
import sys
from pathlib import Path
from rocking.kernels import library
if len(sys.argv) > 2:
    library.FOLDER = Path(sys.argv[2])
from promises.one_answer import direct
print(direct(int(sys.argv[1])))
if len(sys.argv) > 2 and (library.opened() is None or "numba" in sys.modules):
    sys.exit(f"the library does not serve: {library.state()}")
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


def as_study(part: int, unit_blocks: int, workers: int = 0) -> str:
    """Digest of the ensemble as a study, in units of so many blocks, by a thread or by workers of dask.distributed."""
    blocks, motion, model = drawn(part)
    with tempfile.TemporaryDirectory() as folder:
        made = rocking.study(folder, blocks, motion, model=model, unit_blocks=unit_blocks)  # type: ignore[arg-type]
        if workers:
            with local_executor(workers) as executor:
                made.run(executor=executor, progress=False)
        else:
            made.run(threads=1, progress=False)
        return digest({str(name): values.values.reshape(-1) for name, values in made.results().data_vars.items()})


def _apart(part: int, cache: Path, *library: str) -> str:
    """Digest that a process of its own finds, with this cache, and with a library instead of numba if one is named."""
    path = os.pathsep.join(each for each in sys.path if each)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": path}
    environment["ROCKING_SHIPPED"] = "1" if library else "0"
    command = [sys.executable, "-c", _PROGRAM, str(part), *library]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else f"error: {done.stderr.strip()[-300:]}"


def anew(part: int) -> Iterator[tuple[str, str]]:
    """Digests with kernels compiled anew, read from that cache, and from the library of each level of processor."""
    script = runpy.run_path(str(Path(__file__).resolve().parents[2] / "scripts" / "ship_kernels.py"))
    with tempfile.TemporaryDirectory() as name:
        cache, shipped = Path(name, "cache"), Path(name, "shipped")
        yield "kernels compiled anew", _apart(part, cache)
        yield "kernels read from the cache", _apart(part, cache)
        shipped.mkdir()
        levels = script["LEVELS"][script["platform"].machine().lower()]
        command = [sys.executable, script["__file__"], "--out", str(shipped), *_KERNELS]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        manifest = json.loads((shipped / "manifest.json").read_text("utf-8"))
        # A library of a level that this processor lacks cannot run here: the package itself chooses the highest.
        for each in ([*manifest["libraries"]][:1], [*manifest["libraries"]]):
            of_level = {**manifest, "libraries": {one: manifest["libraries"][one] for one in each}}
            (shipped / "manifest.json").write_text(json.dumps(of_level), "utf-8")
            yield f"libraries up to {levels[len(each) - 1]}", _apart(part, cache, str(shipped))


WAYS: dict[str, Callable[[int], str]] = {
    "2 threads": lambda part: direct(part, 2),
    "7 threads": lambda part: direct(part, 7),
    "batches of 5": lambda part: rearranged(part, 5, shuffled=False),
    "batches of 7, shuffled": lambda part: rearranged(part, 7, shuffled=True),
    "batches of 64, shuffled": lambda part: rearranged(part, 64, shuffled=True),
    "whole, shuffled": lambda part: rearranged(part, BLOCKS, shuffled=True),
    "a study in units of 512": lambda part: as_study(part, 512),
    "a study in units of 1024": lambda part: as_study(part, 1024),
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
        yield "a study by two workers", as_study(part, 512, workers=2)
    if part == ANEW:
        yield from anew(part)


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
