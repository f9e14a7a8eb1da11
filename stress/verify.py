"""Hold the package to every promise of docs/reliability.md, part by part.

    python stress/verify.py --parts small      # a quick look, some minutes
    python stress/verify.py                    # everything, and the tables of docs/reliability.md

What a part has shown is kept in a folder under its promise and a hash of the sources, so that a run that was killed
goes on where it was. Ctrl-C stops once the parts in hand are done; they are kept. Exits with status 1 if anything is
not as promised, and with 130 if it was stopped.
"""

from __future__ import annotations

import argparse
import ast
import datetime
import hashlib
import importlib.metadata
import json
import multiprocessing
import os
import platform
import signal
import sys
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from promises import ALL
from promises.promise import Found, Promise
from rows import markdown, with_earlier

import rocking
from rocking.core.progress import Progress

ROOT = Path(__file__).resolve().parents[1]
LIBRARIES = ("numpy", "numba", "scipy", "python-flint")
STOPPED = 130
#: What the overview shows of a promise.
_SHOWN = ("parts", "cases", "judged", "failures", "worst", "seconds")


def main() -> int:
    """Judge what is not yet kept, print, and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("promises", nargs="*", choices=[*ALL, []], help="which; by default all")
    parser.add_argument("--parts", default="full", help="full, small, a number, or kept: judge nothing more")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--kept", type=Path, default=ROOT / "out" / "verify", help="folder of what is kept")
    parser.add_argument("--tables", type=Path, help="folder for the tables; by default docs/_tables of a full run")
    given = parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell makes its background jobs ignore Ctrl-C
    promises = [ALL[name] for name in given.promises or ALL]
    tables = given.tables or (ROOT / "docs" / "_tables" if given.parts == "full" else None)
    folders = {promise.name: given.kept / f"{promise.name}-{key(promise)}" for promise in promises}
    wanted = {promise.name: _parts(promise, given.parts, folders[promise.name]) for promise in promises}
    if status := _judged(wanted, folders, given.jobs):
        print(f"stopped; what is done is kept in {given.kept}, and the same command goes on from there")
        return status
    found = {promise.name: _together(folders[promise.name], wanted[promise.name]) for promise in promises}
    print(overview(promises, {name: vars(each) for name, each in found.items()}))
    if tables:
        write(tables, promises, found)
    faults = [fault for promise in promises for fault in promise.faults(found[promise.name])]
    print("\n".join(faults) or "everything is as promised")
    return 1 if faults else 0


def _parts(promise: Promise, size: str, folder: Path) -> list[int]:
    """Numbers of the parts that are asked for."""
    if size == "kept":
        return [part for part in range(promise.parts) if (folder / f"{part}.json").exists()]
    known = {"full": promise.parts, "small": promise.small}
    return [*range(known[size] if size in known else min(int(size), promise.parts))]


def key(promise: Promise) -> str:
    """Hash of all that an answer hangs on: files of package, oracles and promise, and versions."""
    package = Path(rocking.__file__).parent
    files = [*_modules(promise.judge.__module__), *sorted((ROOT / "compiling").glob("*.py"))]
    files += sorted((ROOT / "tests" / "oracles").rglob("*.py"))
    files += [file for file in sorted(package.rglob("*")) if file.is_file() and _counts(file, package, promise)]
    total = hashlib.sha256(" ".join([sys.version, platform.machine(), *map(_version, LIBRARIES)]).encode())
    for file in files:
        total.update(file.name.encode() + b"\0" + file.read_bytes())
    return total.hexdigest()[:16]


def _modules(module: str) -> list[Path]:
    """Files of a promise's module, and of those beside it that it imports."""
    found = [Path(sys.modules[module].__file__ or "")]
    for file in found:
        tree = ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        imported = sorted({each.module or "" for each in tree if isinstance(each, ast.ImportFrom)})
        names = [each.rpartition(".")[2] for each in imported if each.startswith("promises.")]
        beside = [ROOT / "stress" / "promises" / f"{each}.py" for each in names]
        found += [each for each in beside if each not in found]
    return found


def _counts(file: Path, package: Path, promise: Promise) -> bool:
    """Whether a file of the package is a source, and of a part that the promise hangs on."""
    within = file.relative_to(package)
    above = any(within.is_relative_to(each) for each in promise.above)
    return not above and not {"__pycache__", "built"} & {*within.parts}


def _version(library: str) -> str:
    try:
        return f"{library} {importlib.metadata.version(library)}"
    except importlib.metadata.PackageNotFoundError:
        return f"no {library}"


def _judged(wanted: dict[str, list[int]], folders: dict[str, Path], jobs: int) -> int:
    """Judge the parts that are not kept yet; exit status, if it was stopped or if a part could not be judged."""
    status = 0
    files = [(name, part, folders[name] / f"{part}.json") for name in wanted for part in wanted[name]]
    missing = [each for each in files if not each[-1].exists()]
    # numba's threads do not survive a fork.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, mp_context=context, initializer=_deaf) as pool:
        futures = {pool.submit(_judge_part, *each): f"{each[0]} {each[1]}" for each in missing}
        try:
            with Progress("parts", len(files), done=len(files) - len(missing)) as bar:
                for future in as_completed(futures):
                    error = future.exception()
                    status |= error is not None
                    told = f"{futures[future]}: not judged: {type(error).__name__}: {error}"
                    print(told if error else future.result(), flush=True)
                    bar.advance(1)
        except KeyboardInterrupt:
            pool.shutdown(wait=True, cancel_futures=True)
            return STOPPED
    return status


def _deaf() -> None:
    """Leave Ctrl-C to the process that hands out the parts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _judge_part(name: str, part: int, file: Path) -> str:
    """Judge one part, keep what it has shown, and say so in a line."""
    start = _spent()
    found = ALL[name].judge(part)
    found.seconds = _spent() - start
    file.parent.mkdir(parents=True, exist_ok=True)
    unfinished = file.with_suffix(f".{os.getpid()}")
    unfinished.write_text(json.dumps(vars(found)), encoding="utf-8")
    unfinished.replace(file)
    return f"{name} {part}: {found.judged} of {found.cases} judged, {found.failures} failures, {found.seconds:.1f} s"


def _spent() -> float:
    """Processor time of this process and of those that it has started and seen end, s."""
    return sum(os.times()[:4])


def _together(folder: Path, parts: list[int]) -> Found:
    """Add up what the parts have shown."""
    found = Found()
    for part in parts:
        found.add(Found.of(json.loads((folder / f"{part}.json").read_text(encoding="utf-8"))))
    return found


def overview(promises: list[Promise], rows: Mapping[str, Mapping[str, Any]]) -> str:
    """Table of promises."""
    cells: dict[str, tuple[object, ...]] = {}
    for promise in promises:
        if row := rows.get(promise.name):
            numbers = (row["cases"], row["judged"], row["failures"], f"{row['worst']:.2g}", f"{row['seconds']:.0f}")
            cells[promise.says] = (f"{row['parts']} of {promise.parts}", *numbers, row.get("date", ""))
        else:
            cells[promise.says] = ()
    heads = ("promise", "parts", "cases", "judged", "failures", "worst", "processor time, s", "date")
    return "\n".join([*markdown(heads, cells, "not judged yet"), ""])


def made() -> str:
    """Say when, with what and on what this was judged."""
    libraries = ", ".join(map(_version, LIBRARIES))
    return (
        f"Judged last on {datetime.date.today().isoformat()}: rocking {rocking.__version__} with {libraries} and "
        f"Python {platform.python_version()}, on {_processor()}.\n"
    )


def _processor() -> str:
    cpu = Path("/proc/cpuinfo")
    names = [line.partition(":")[2].strip() for line in _lines(cpu) if line.startswith("model name")]
    return f"{os.cpu_count()} cores, {names[0] if names else platform.processor() or platform.machine()}"


def _lines(file: Path) -> Iterator[str]:
    return iter(file.read_text(encoding="utf-8").splitlines() if file.exists() else [])


def write(folder: Path, promises: list[Promise], found: dict[str, Found]) -> None:
    """Write the overview, with what earlier runs say of other promises, and the table of each of these that has one."""
    folder.mkdir(parents=True, exist_ok=True)
    judged = {name: {key: vars(each)[key] for key in _SHOWN} for name, each in found.items() if each.parts}
    rows = with_earlier(folder / "reliability-all.txt", judged)
    texts = {"all": overview([*ALL.values()], rows), "made": made()}
    texts |= {each.name: each.table(found[each.name]) for each in promises if each.table and each.name in judged}
    for name, text in texts.items():
        (folder / f"reliability-{name}.txt").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
