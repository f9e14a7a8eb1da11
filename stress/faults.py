"""Let every n-th write, flush and rename of a run fail, with no space left or with an error of the disk.

    python stress/faults.py

The run ends with one sentence, or goes on where nothing was lost; no unit is half-visible; the next run goes on to the
bytes of an undisturbed one.
"""

import argparse
import contextlib
import errno
import os
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any

from common import digest, made, units

import rocking

#: Twelve units: what fails at the hundredth one fails at the tenth.
SCALES = 2

CALLS: dict[str, tuple[Any, str]] = {
    "write": (os, "fdopen"),
    "fsync": (os, "fsync"),
    "rename": (Path, "replace"),
    "open": (os, "open"),
}


class HalfWritten(contextlib.AbstractContextManager[Any]):
    """A file that takes half of what is written to it."""

    def __init__(self, file: IO[bytes], code: int) -> None:
        self._file, self._code = file, code

    def write(self, data: bytes) -> None:
        """Write half, and fail."""
        self._file.write(data[: len(data) // 2])
        self._file.flush()
        raise OSError(self._code, os.strerror(self._code))

    def __exit__(self, *error: object) -> None:
        self._file.close()


@contextlib.contextmanager
def failing(call: str, code: int, fails: Callable[[int], bool]) -> Iterator[list[int]]:
    """Let those calls fail whose number says so; gives the count of those that did."""
    owner, name = CALLS[call]
    before = getattr(owner, name)
    count, failed = [0], [0]

    def sometimes(*arguments: object, **options: object) -> object:
        count[0] += 1
        if not fails(count[0]):
            return before(*arguments, **options)
        failed[0] += 1
        if call == "write":
            return HalfWritten(before(*arguments, **options), code)
        raise OSError(code, os.strerror(code))

    setattr(owner, name, sometimes)
    try:
        yield failed
    finally:
        setattr(owner, name, before)


def attempt(folder: Path, code: int) -> None:
    """Create and run; a failure must be one sentence that names its cause."""
    try:
        made(folder, SCALES).run(threads=1)
    except rocking.RockingError as error:
        assert os.strerror(code) in str(error), error
        assert "\n" not in str(error)


def main() -> None:
    """Let the first, second, ... call fail until no call is left; then every second, third, ... one."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--most", type=int, default=10**6, help="numbers of calls to try")
    given = parser.parse_args()
    runs: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as where:
        top = Path(where)
        made(top / "undisturbed", SCALES).run(threads=1)
        reference, expected = units(top / "undisturbed"), digest(top / "undisturbed")
        for call, code in ((call, code) for call in CALLS for code in (errno.ENOSPC, errno.EIO)):
            kinds = {"only": lambda n: lambda k: k == n, "each": lambda n: lambda k: k % n == 0}
            for kind, fails in kinds.items():
                for n in range(1 if kind == "only" else 2, given.most):
                    folder = top / f"{call}-{code}-{kind}-{n}"
                    with failing(call, code, fails(n)) as failed:
                        attempt(folder, code)
                    if not failed[0]:
                        break
                    assert units(folder).items() <= reference.items()
                    made(folder, SCALES).run(threads=1)
                    assert digest(folder) == expected
                    assert not list(folder.rglob("*.part"))
                    runs[f"{call} {errno.errorcode[code]} {kind}"] += 1
    print("\n".join(f"{name}: {count} runs, each resumed to the same bytes" for name, count in runs.items()))


if __name__ == "__main__":
    main()
