"""`rocking records`: the shipped records, or what a record file holds."""

from __future__ import annotations

from typing import Annotated, Any

from cyclopts import Parameter

from rocking.constants import STANDARD_GRAVITY
from rocking.motion import formats
from rocking.motion import records as shipped
from rocking.motion.motion import Motion
from rocking.tables import to_json


def records(
    file: str | None = None,
    *,
    dt: float | None = None,
    units: str | None = None,
    as_json: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> None:
    """List the shipped records, or show what a record file holds and what the reader took it for.

    Parameters
    ----------
    file
        Record file; without one, the shipped records are listed.
    dt
        Sampling step, s, of a text file that does not give times.
    units
        Units of a text file: g, m/s2, cm/s2, mm/s2.
    as_json
        Print the result as JSON.
    """
    result = _shipped() if file is None else _content(file, dt, units)
    if as_json:
        print(to_json(result))
        return
    if file is not None:
        print(f"{file}: {result['format']}, since {result['reason']}\n")
    entries = result["records" if file is None else "channels"]
    columns = list(entries[0])
    cells = [columns, *([_cell(entry[column]) for column in columns] for entry in entries)]
    widths = [max(len(row[k]) for row in cells) for k in range(len(columns))]
    for row in cells:
        print("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip())


def _shipped() -> dict[str, Any]:
    entries = []
    for name in shipped.names():
        record = shipped.info(name)
        known = {"name": name, "event": record.event, "station": record.station, "direction": record.direction}
        entries.append(known | _measures(shipped.load(name)) | {"terms": record.terms})
    return {"records": entries}


def _content(file: str, dt: float | None, units: str | None) -> dict[str, Any]:
    identification = formats.identify(file)
    entries = []
    for channel in formats.channels(file, dt=dt, units=units):
        motion = channel.motion()
        entries.append({"channel": channel.number, "name": channel.name, "units": channel.units} | _measures(motion))
    return {"file": file, "format": identification.format, "reason": identification.reason, "channels": entries}


def _measures(motion: Motion) -> dict[str, Any]:
    return {
        "step_s": motion.step,
        "duration_s": motion.duration,
        "pga_g": motion.pga / STANDARD_GRAVITY,
        "pgv_m_per_s": motion.pgv,
    }


def _cell(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
