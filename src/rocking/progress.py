"""What is said on stderr beside the result: a bar for work that takes long, and notes, each a line."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator
from datetime import timedelta
from types import TracebackType
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import rich.progress

#: Work that is over sooner than this shows no bar, s.
_PATIENCE = 1.0


#: Who is told: a person at a terminal, everybody, nobody.
Audience = Literal["terminal", "everybody", "nobody"]
_audience: Audience = "terminal"


def _as_it_is(sentence: str) -> str:
    return sentence


_phrased: Callable[[str], str] = _as_it_is

#: What the present audience has been told, where it is told everything once.
_told: set[str] | None = None


def phrased(sentence: str) -> str:
    """Return a sentence in the words of where it is said: the command line names options in place of arguments.

    Examples
    --------
    >>> phrased('polarity="both" counts both')
    'polarity="both" counts both'
    """
    return _phrased(sentence)


def note(sentence: str) -> None:
    """Say a sentence on stderr, on a line of its own, to whom `notes_for` has chosen.

    Examples
    --------
    >>> note("nobody reads this where stderr is not a terminal")
    """
    if _told is not None:
        if sentence in _told:
            return
        _told.add(sentence)
    if _audience == "everybody" or (_audience == "terminal" and sys.stderr.isatty()):
        print(f"rocking: note: {_phrased(' '.join(sentence.split()))}", file=sys.stderr)


@contextlib.contextmanager
def notes_for(audience: Audience, phrased: Callable[[str], str] = _as_it_is) -> Iterator[None]:
    """Choose who is told, while a command runs, and in whose words; the same sentence only once.

    Examples
    --------
    >>> with notes_for("nobody"):
    ...     note("not even a person at a terminal sees this")
    """
    global _audience, _phrased, _told
    before = _audience, _phrased, _told
    _audience, _phrased, _told = audience, phrased, set()
    try:
        yield
    finally:
        _audience, _phrased, _told = before


class Progress:
    """Progress bar on stderr with the rate and the time left, drawn once the work has taken a second.

    Parameters
    ----------
    what : str
        What is being done.
    total : int
        Number of steps.
    show : bool, optional
        By default only if stderr is a terminal.
    done : int
        Steps that were done before; they do not count for the rate.

    Examples
    --------
    >>> with Progress("counting", total=3, show=False) as progress:
    ...     for _ in range(3):
    ...         progress.advance()
    """

    def __init__(self, what: str, total: int, *, show: bool | None = None, done: int = 0) -> None:
        self._what, self._total = what, total
        self._show = (_audience != "nobody" and sys.stderr.isatty()) if show is None else show
        self._start = time.monotonic()
        self._before = self._done = done
        self._bar: rich.progress.Progress | None = None

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def note(self, text: str) -> None:
        """Show a few words behind what is being done."""
        self._what = f"{self._what.partition(',')[0]}, {text}"
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], description=self._what)

    def advance(self, steps: int = 1) -> None:
        """Count steps that are done."""
        self._done += steps
        if not self._show or time.monotonic() - self._start < _PATIENCE:
            return
        if self._bar is None:
            self._bar = _started(self._what, self._total)
        rate = (self._done - self._before) / (time.monotonic() - self._start)
        left = f"{timedelta(seconds=round(max(self._total - self._done, 0) / rate))} left" if rate else ""
        self._bar.update(self._bar.task_ids[0], completed=self._done, rate=f"{rate:.3g}/s", left=left)


def _started(what: str, total: int) -> rich.progress.Progress:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    texts = [TextColumn(f"{{task.{name}}}") for name in ("description", "fields[rate]", "fields[left]")]
    columns = (texts[0], BarColumn(), MofNCompleteColumn(), *texts[1:])
    bar = Progress(*columns, console=Console(stderr=True), transient=True)
    bar.add_task(what, total=total, rate="", left="")
    bar.start()
    return bar
