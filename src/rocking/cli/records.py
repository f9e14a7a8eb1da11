"""`rocking records`: the shipped records, or what a record file holds."""

from __future__ import annotations

import sys
from typing import Annotated, Final

from rocking.cli.options import OUTPUT, RECORDS, FileOptions, Names, PrintOptions, refusal
from rocking.errors import InvalidMotion, UnreadableRecord
from rocking.motion.named import STANDARD_INPUT, Contents, contents, expanded, is_shipped, refuse_what_is_known, shipped
from rocking.plausibility import reading_notes
from rocking.progress import Progress, note
from rocking.tables import to_json

#: Names of files in one sentence.
_SHOWN: Final = 5


def records(
    *names: Names,
    file: Annotated[FileOptions, RECORDS] = FileOptions(),
    output: Annotated[PrintOptions, OUTPUT] = PrintOptions(),
) -> None:
    """List the shipped records, or show what record files hold and what the reader took them for.

    Of several files those that cannot be read are listed with the reason, and the exit status is 2.
    """
    files = expanded(names)
    found: list[Contents] = []
    refused: dict[str, str] = {}
    with Progress("reading records", total=len(files)) as progress:
        for name in files:
            try:
                found.append(_contents(name, file, several=len(files) > 1))
            except (UnreadableRecord, InvalidMotion) as error:
                if len(files) == 1:
                    raise
                refused[name] = refusal(name, error)
            progress.advance()
    found = found if files else [shipped()]
    if output.as_json:
        listed = [each.to_dict() for each in found] + [{"file": name, "error": refused[name]} for name in refused]
        print(to_json(listed[0] if len(listed) == 1 else {"files": listed}))
    else:
        print("\n\n".join([each.summary() for each in found] + [*refused.values()]))
    if refused:
        left = len(refused) - _SHOWN
        shown = ", ".join([*refused][:_SHOWN]) + (f" and {left} more" if left > 0 else "")
        raise UnreadableRecord(f"{len(refused)} of {len(files)} files cannot be read: {shown}")


def _contents(name: str, file: FileOptions, *, several: bool) -> Contents:
    if is_shipped(name):
        if not several:
            refuse_what_is_known(name, channel=file.channel, dt=file.dt, units=file.units)
        return shipped(name)
    source = sys.stdin.buffer if name == STANDARD_INPUT else name
    found = contents(source, channel=file.channel, dt=file.dt, units=file.units, several=several)
    for motion, entry in zip(found.motions, found.entries, strict=True):
        for sentence in reading_notes(motion):
            note(f"{name}, channel {entry['channel']}: {sentence}")
    return found
