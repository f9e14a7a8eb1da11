"""Digests of what the program computes, bit for bit: the same before and after a change that should change no number.

python stress/digests.py --pairs 20000 > before.json      # and after.json, then: diff before.json after.json

Random ensembles and single responses over wide ranges, chattering times and critical amplitudes, a study's files, a
calibration, and what some commands write.
"""

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import rocking
from rocking import chattering

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from oracles import referee

RECORD = "el-centro-meloland-270"
BLOCK = "--width 0.24 --height 1.1"
COMMANDS = {
    "simulate": f"simulate {RECORD} {BLOCK}",
    "simulate, vertical": f"simulate {RECORD} {BLOCK} --vertical el-centro-meloland-up",
    "check": f"check {RECORD} ridgecrest-clc-090 {BLOCK}",
    "records": "records",
    "spectrum": f"spectrum {RECORD} --alpha 0.2 --p 1:4:8",
    "map": "map ricker --p 2 --alpha 0.2 --frequencies 1:4:5 --amplitudes 1:4:5",
    "ida": f"ida {RECORD} {BLOCK} --tolerance 0.01",
    "fragility": f"fragility {RECORD} el-centro-meloland-360 {BLOCK} --levels 2:5:16",
    "chatter": "chatter 1.03 2 0.92",
    "critical": "critical 2 0.92",
}


class Digest:
    """SHA-256 of numbers and texts, one after the other."""

    def __init__(self) -> None:
        self._sum = hashlib.sha256()

    def add(self, values: Any) -> None:
        """Take in an array, a structured one by its fields, or a text."""
        if isinstance(values, str | bytes):
            self._sum.update(values.encode() if isinstance(values, str) else values)
            return
        array = np.ascontiguousarray(values)
        for name in array.dtype.names or ():
            self.add(array[name])
        if array.dtype.names is None:
            self._sum.update(array.tobytes())

    def __str__(self) -> str:
        return self._sum.hexdigest()


def responses(pairs: int, *, vertical: bool) -> Iterator[tuple[str, Digest]]:
    """Ensembles of random batches, and every sixteenth block of them alone."""
    together, alone = Digest(), Digest()
    for given in referee.batches(21, pairs, vertical=vertical):
        try:
            for _, values in sorted(given.together(threads=1).items()):
                together.add(values)
        except rocking.RockingError as error:
            together.add(type(error).__name__)
        for k in range(0, len(given.blocks), 16):
            try:
                found = given.alone(0, k)
            except rocking.RockingError as error:
                alone.add(type(error).__name__)
                continue
            for each in (found.events, found.impacts, found.chattering, found.sensitivity.peak):
                alone.add(each)
            alone.add([found.peak_rotation, found.peak_time, found.required_friction, found.minimum_normal_force])
            alone.add(found.rotation(np.linspace(0.0, found.duration, 17)))
    about = "vertical" if vertical else "horizontal"
    yield f"{pairs} pairs, {about}: ensembles", together
    yield f"{pairs} pairs, {about}: single responses", alone


def theory(count: int) -> Iterator[tuple[str, Digest]]:
    """Chattering times and critical amplitudes over wide ranges."""
    random = np.random.default_rng(22)
    omega, eta = 10.0 ** random.uniform(-2.0, 2.0, count), random.uniform(0.02, 0.98, count)
    a = 1.0 + 10.0 ** random.uniform(-6.0, 0.0, count)
    for method in ("exact", "asymptotic", "series", "semianalytical"):
        digest = Digest()
        digest.add(chattering.chattering_time(a, omega, eta, method=method))
        yield f"{count} chattering times, {method}", digest
    digest = Digest()
    digest.add(chattering.critical_amplitude(omega, eta))
    yield f"{count} critical amplitudes", digest


def study(folder: Path) -> Iterator[tuple[str, Digest]]:
    """All files of a study but its log, which holds times; without what hangs on the kernels' sources."""
    blocks = rocking.Blocks.grid(p=[1.0, 2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
    made = rocking.study(
        folder, blocks, rocking.records.load(RECORD), levels=np.linspace(1.0, 6.0, 12), measure="pga", refine=1e-2
    )
    made.run()
    digest = Digest()
    for file in sorted(folder.rglob("*")):
        if file.is_file() and file.suffix not in (".jsonl", ".lock") and file.name != "lock":
            digest.add(str(file.relative_to(folder)))
            digest.add(_without_kernels(file.read_bytes()))
    yield "a study's store", digest


def _without_kernels(content: bytes) -> bytes:
    """Content of a file without the hash of the kernels' sources and the seal that holds it."""
    if b'"seal"' not in content:
        return content
    known = json.loads(content)
    return json.dumps({name: value for name, value in known.items() if name not in ("kernels", "seal")}).encode()


def calibration() -> Iterator[tuple[str, Digest]]:
    """Ensemble and weights that a calibration with a seed finds."""
    truth = rocking.Block.from_parameters(p=3.0, alpha=0.2, restitution=0.9)
    motions = [rocking.pulses.ricker(level, 1.2) for level in np.linspace(1.5, 6.0, 24)]
    fell = rocking.simulate_many(rocking.Blocks.of([truth]), motions, model="linear").overturned.values[:, 0]
    known: Any = {"p": (1.0, 9.0), "alpha": (0.1, 0.4), "restitution": 0.9}
    found = rocking.calibrate(motions, fell, model="linear", **known, seed=3, candidates=256)
    digest = Digest()
    for each in (found.blocks.p, found.blocks.alpha, found.weights):
        digest.add(each)
    yield "a calibration", digest


def commands(folder: Path) -> Iterator[tuple[str, Digest]]:
    """Run some commands: the JSON that they print, and the CSV files that they write."""
    for name, words in COMMANDS.items():
        out = folder / name.replace(", ", "-")
        program = "import sys; from rocking.cli import main; main(sys.argv[1:])"
        options = ["--json", "--quiet", *([] if name in ("records",) else ["--out", str(out)])]
        line = [sys.executable, "-c", program, *words.split(), *options]
        done = subprocess.run(line, capture_output=True, text=True, check=False, env={**os.environ, "COLUMNS": "100"})
        digest = Digest()
        digest.add(f"{done.returncode} {done.stderr if done.returncode else ''}{done.stdout}".replace(str(folder), ""))
        for file in sorted(out.rglob("*.csv")):
            digest.add(file.name)
            digest.add(_without_kernels(file.read_bytes()))
        yield f"rocking {name} (exit {done.returncode})", digest


def main() -> None:
    """Print all digests as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--pairs", type=int, default=20_000)
    parser.add_argument("--times", type=int, default=2_000)
    given = parser.parse_args()
    found: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as folder:
        for part in (
            responses(given.pairs // 2, vertical=False),
            responses(given.pairs // 2, vertical=True),
            theory(given.times),
            study(Path(folder, "study")),
            calibration(),
            commands(Path(folder)),
        ):
            for name, digest in part:
                found[name] = str(digest)
                print(f"{name}: {digest}", file=sys.stderr)
    json.dump(found, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
