"""Output on stderr: progress bar of long computations, and notes."""

from __future__ import annotations

import contextlib
import sys
import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import timedelta
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, Literal

from rocking.core.threads import read_progress_option, set_options
from rocking.errors import Message, OutsideFitWarning, Spelling

if TYPE_CHECKING:
    import rich.progress

#: Shortest time before a bar is shown, s.
_BAR_DELAY: Final = 1.0

#: Audience of notes: a person at a terminal, everybody, nobody.
Audience = Literal["terminal", "everybody", "nobody"]


@dataclass(frozen=True)
class _Listener:
    """Audience of notes, spelling of argument names for it, and notes already shown."""

    audience: Audience = "terminal"
    spelling: Spelling = str
    seen: set[Message] | None = None


_listener = _Listener()


def spell(message: Message) -> str:
    """Return a message with argument names for the present reader, options on the command line."""
    return message.text(_listener.spelling)


def note(message: Message | str) -> None:
    """Print a sentence on a line of stderr for the audience chosen by `notes_for`."""
    # The template of a sentence without argument names has no placeholders.
    sentence = message if isinstance(message, Message) else Message(message)
    if _listener.seen is not None:
        if sentence in _listener.seen:
            return
        _listener.seen.add(sentence)
    if _listener.audience == "everybody" or (_listener.audience == "terminal" and sys.stderr.isatty()):
        print(f"rocking: note: {spell(sentence)}", file=sys.stderr)


@contextlib.contextmanager
def notes_for(audience: Audience, spelling: Spelling = str) -> Iterator[None]:
    """Set audience of notes and spelling of arguments while a command runs, and show each note once."""
    global _listener

    def show(message: Warning | str, category: type[Warning], *location: Any) -> None:
        if issubclass(category, OutsideFitWarning):
            note(str(message))
        else:
            default_show(message, category, *location)

    previous = _listener
    with warnings.catch_warnings():
        default_show = warnings.showwarning
        warnings.simplefilter("always", OutsideFitWarning)
        warnings.showwarning = show  # type: ignore[assignment]
        _listener = _Listener(audience, spelling, set())
        try:
            yield
        finally:
            _listener = previous


class Progress:
    """Progress bar on stderr with rate and remaining time, shown after one second.

    The bar appears only on a terminal unless `set_options` says otherwise, and not inside another one. Steps that were
    already `done` do not count towards the rate.
    """

    def __init__(self, description: str, total: int, *, done: int = 0) -> None:
        self.description, self.total = description, total
        show = read_progress_option()
        self._show = (_listener.audience != "nobody" and sys.stderr.isatty()) if show is None else show
        self._start = time.monotonic()
        self._initially_done = self.done = done
        self._bar: rich.progress.Progress | None = None

    def __enter__(self) -> Progress:
        self._nested = set_options(progress=False)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._nested.__exit__()
        if self._bar is not None:
            self._bar.stop()

    def note(self, text: str) -> None:
        """Show a few words after the description of the task."""
        self.description = f"{self.description.partition(',')[0]}, {text}"
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], description=self.description)

    def advance(self, steps: int = 1) -> None:
        """Add completed steps."""
        self.done += steps
        if not self._show or time.monotonic() - self._start < _BAR_DELAY:
            return
        if self._bar is None:
            self._bar = _start_bar(self.description, self.total)
        rate = (self.done - self._initially_done) / (time.monotonic() - self._start)
        remaining = f"{timedelta(seconds=round(max(self.total - self.done, 0) / rate))} left" if rate else ""
        self._bar.update(self._bar.task_ids[0], completed=self.done, rate=f"{rate:.3g}/s", left=remaining)


def _start_bar(description: str, total: int) -> rich.progress.Progress:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    texts = [TextColumn(f"{{task.{name}}}") for name in ("description", "fields[rate]", "fields[left]")]
    columns = (texts[0], BarColumn(), MofNCompleteColumn(), *texts[1:])
    bar = Progress(*columns, console=Console(stderr=True), transient=True)
    bar.add_task(description, total=total, rate="", left="")
    bar.start()
    return bar
