"""`rocking records` and `rocking pulses`: what may shake a block."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Annotated, Any, Final

from rocking.cli.options import OUTPUT, RECORDS, FileOptions, Names, PrintOptions, refusal
from rocking.errors import InvalidMotion, UnreadableRecord
from rocking.motion.named import STANDARD_INPUT, Contents, contents, expanded, is_shipped, refuse_what_is_known, shipped
from rocking.named_pulses import FAMILIES, PulseFamily
from rocking.plausibility import reading_notes
from rocking.progress import Progress, note
from rocking.tables import text_table, to_json

#: Names of files in one sentence.
_SHOWN: Final = 5

_EXAMPLE = "rocking simulate --pulse sine:amplitude=0.2g,frequency=2Hz,cycles=5 --width 0.24 --height 1.1"


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


def pulses(*, output: Annotated[PrintOptions, OUTPUT] = PrintOptions()) -> None:
    """List the pulses that --pulse takes, with their parameters and, where they need not be given, their defaults."""
    families = FAMILIES.values()
    if output.as_json:
        units = [{name: one.unit(name) for name in (*one.needed, *one.optional)} for one in families]
        known = [{"name": one.name, "needs": one.needed, "takes": one.optional} for one in families]
        print(to_json({"pulses": [one | {"units": of_one} for one, of_one in zip(known, units, strict=True)]}))
        return
    rows = [(one.name, _listed(one, dict.fromkeys(one.needed)), _listed(one, one.optional)) for one in families]
    print(text_table(["pulse", "needs", "takes"], rows))
    print(f"\namplitudes may be 0.5g or 4.9m/s2, frequencies 2Hz or 12.6rad/s, angles 90deg:\n{_EXAMPLE}")


def _listed(family: PulseFamily, parameters: Mapping[str, Any]) -> str:
    """Return parameters of a pulse with their units and defaults."""
    units = {name: f" ({family.unit(name)})" if family.unit(name) else "" for name in parameters}
    defaults = {
        name: "" if value is None else f" = {value:g}" if isinstance(value, float) else f" = {value}"
        for name, value in parameters.items()
    }
    return ", ".join(name + units[name] + defaults[name] for name in parameters)
