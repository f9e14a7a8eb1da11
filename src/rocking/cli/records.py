"""`rocking records`: the shipped records, or what a record file holds."""

from __future__ import annotations

import sys
from typing import Annotated

from rocking.cli.options import OUTPUT, RECORDS, FileOptions, Names, PrintOptions
from rocking.motion.catalogue import Contents, contents, shipped
from rocking.motion.named import STANDARD_INPUT, expanded, is_shipped, refuse_what_is_known
from rocking.plausibility import reading_notes
from rocking.progress import Progress, note
from rocking.tables import to_json


def records(
    *names: Names,
    file: Annotated[FileOptions, RECORDS] = FileOptions(),
    output: Annotated[PrintOptions, OUTPUT] = PrintOptions(),
) -> None:
    """List the shipped records, or show what record files hold and what the reader took them for."""
    files = expanded(names)
    found: list[Contents] = []
    with Progress("reading records", total=len(files)) as progress:
        for name in files:
            found.append(_contents(name, file, several=len(files) > 1))
            progress.advance()
    found = found or [shipped()]
    if output.as_json:
        print(to_json(found[0].to_dict() if len(found) == 1 else {"files": [each.to_dict() for each in found]}))
    else:
        print("\n\n".join(each.summary() for each in found))


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
