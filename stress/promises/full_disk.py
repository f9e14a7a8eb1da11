"""A full disk at every opening, write, flush and renaming of every command: one sentence, and no damaged file.

Commands run in this process, with the functions of Python through which files are written replaced: the n-th call for a
file in the command's folder fails with ENOSPC, a write after half of its bytes. What a command prints goes to a disk
that is full from the start. A part is one command; the last one is all those that only print.
"""

from __future__ import annotations

import builtins
import contextlib
import errno
import io
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final
from unittest.mock import patch

from promises.commands import COMMANDS, PRINTING, arguments, called, faults, files
from promises.promise import Found, Promise

#: Calls that fail one by one, of each kind, at most.
MOST: Final = 1000

KINDS: Final = ("open", "write", "fsync", "rename")


class FullDisk:
    """What writes into a folder, of which one call fails."""

    def __init__(self, folder: Path, kind: str, number: int) -> None:
        self._folder, self._kind, self._left = str(folder), kind, number
        self._open, self._fsync, self._replace = io.open, os.fsync, os.replace
        self._os_open, self._rename = os.open, os.rename
        self.failed = False

    def _passes(self, kind: str) -> bool:
        if kind == self._kind:
            self._left -= 1
            self.failed |= self._left == 0
        return not (kind == self._kind and self._left == 0)

    def _require(self, kind: str) -> None:
        if not self._passes(kind):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def _is_here(self, file: Any) -> bool:
        if isinstance(file, int):
            with contextlib.suppress(OSError):
                return str(Path(f"/proc/self/fd/{file}").readlink()).startswith(self._folder)
            return False
        return os.fsdecode(file).startswith(self._folder)

    def open(self, file: Any, mode: str = "r", *arguments: Any, **options: Any) -> Any:
        """Open a file; what is written to it passes through `write`."""
        writes = any(letter in mode for letter in "wax+") and self._is_here(file)
        if writes and not isinstance(file, int):
            self._require("open")
        opened = self._open(file, mode, *arguments, **options)
        if not writes:
            return opened
        written = opened.write

        def write(data: Any) -> Any:
            if self._passes("write"):
                return written(data)
            written(data[: len(data) // 2])
            opened.flush()
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        return _Written(opened, write)

    def os_open(self, path: Any, flags: int, *arguments: Any, **options: Any) -> int:
        """Open a descriptor."""
        if flags & (os.O_WRONLY | os.O_RDWR) and self._is_here(path):
            self._require("open")
        return self._os_open(path, flags, *arguments, **options)

    def fsync(self, file: Any) -> None:
        """Flush; no time is lost on doing so."""
        self._require("fsync")

    def replace(self, source: Any, target: Any, **options: Any) -> None:
        """Rename."""
        if self._is_here(target):
            self._require("rename")
        self._replace(source, target, **options)

    @contextlib.contextmanager
    def in_place(self) -> Iterator[None]:
        """Have it in place of Python's own."""
        with (
            patch.object(builtins, "open", self.open),
            patch.object(io, "open", self.open),
            patch.object(os, "open", self.os_open),
            patch.object(os, "fsync", self.fsync),
            patch.object(os, "replace", self.replace),
            patch.object(os, "rename", self.replace),
        ):
            yield


class _Written:
    """A file with another way to write."""

    def __init__(self, file: Any, write: Any) -> None:
        self._file, self.write = file, write

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def __enter__(self) -> _Written:
        self._file.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self._file.__exit__(*error)


@cache
def undisturbed(name: str) -> dict[str, bytes]:
    """Files of a command that nothing disturbs."""
    with tempfile.TemporaryDirectory() as where:
        folder = Path(where)
        status, said = called(arguments(name, folder))
        if status != 0:
            raise RuntimeError(f"{name}: {said[-500:]}")
        return files(folder / "out")


def judge(part: int) -> Found:
    """Let the first, second, ... call of every kind fail, of one command; and print to a full disk."""
    found = Found(parts=1)
    names = [*COMMANDS][part : part + 1]
    for name in names:
        _judge_calls(found, name)
    for name in names or PRINTING:
        _judge_printing(found, name)
    return found


def _judge_printing(found: Found, name: str) -> None:
    with tempfile.TemporaryDirectory() as where, Path("/dev/full").open("wb") as full:
        command = [sys.executable, "-m", "rocking", *arguments(name, Path(where))]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False, cwd=where)
        lines = [line for line in done.stderr.splitlines() if not line.startswith("rocking: note:")]
        found.cases += 1
        found.judged += 1
        found.notes["print"] += 1
        if done.returncode != 2 or len(lines) != 1 or os.strerror(errno.ENOSPC) not in lines[0]:
            found.fail(f"{name}, printed to a full disk: status {done.returncode}, {done.stderr[-300:]!r}")
        if name in COMMANDS:
            for fault in faults(Path(where, "out"), undisturbed(name)):
                found.fail(f"{name}, printed to a full disk: {fault}")


def _judge_calls(found: Found, name: str) -> None:
    whole = undisturbed(name)
    for kind in KINDS:
        for number in range(1, MOST + 1):
            with tempfile.TemporaryDirectory() as where:
                folder = Path(where).resolve()
                words = arguments(name, folder)
                disk = FullDisk(folder / "out", kind, number)
                what = f"{name}, {kind} {number}"
                with disk.in_place():
                    status, said = _answer(words)
                if not disk.failed:
                    break
                _judge_end(found, what, folder, (status, said), whole)
                found.notes[kind] += 1


def _answer(words: list[str]) -> tuple[int, str]:
    try:
        return called(words)
    except Exception as error:
        return -1, f"{type(error).__name__}: {error}"


def _judge_end(found: Found, what: str, folder: Path, answer: tuple[int, str], whole: dict[str, bytes]) -> None:
    found.cases += 1
    found.judged += 1
    status, said = answer
    if status == 0 and not said:
        if {*files(folder / "out")} != {*whole}:
            found.fail(f"{what}: it says nothing, and files are missing")
    elif status != 2 or "\n" in said or os.strerror(errno.ENOSPC) not in said:
        found.fail(f"{what}: status {status}, {said[-300:]!r}")
    for fault in faults(folder / "out", whole):
        found.fail(f"{what}: {fault}")
    name = what.partition(",")[0]
    if name == "study run":
        kept = {each for each in files(folder / "out") if "/c." in each}
        again = called(["study", "run", str(folder / "study.toml"), str(folder / "out")])
        if again[0] != 0 or not kept <= {*files(folder / "out")} or faults(folder / "out", whole):
            found.fail(f"{what}: the study does not go on: {again}")


def table(found: Found) -> str:
    """Say how many calls failed."""
    kinds = ", ".join(f"{found.notes[kind]} of {kind}" for kind in KINDS)
    return f"Failed calls: {kinds}. {found.notes['print']} commands printed to a full disk.\n"


PROMISE = Promise(
    name="full-disk",
    says="a full disk is one sentence, and damages no file",
    parts=len(COMMANDS) + 1,
    small=1,
    judge=judge,
    table=table,
)
