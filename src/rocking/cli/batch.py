"""What the commands with many simulations share: ranges of numbers, several records, and writing what came out."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rocking.cli import options
from rocking.errors import InvalidOption, OutputError
from rocking.motion.motion import Motion
from rocking.motion.named import named_motion

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

#: Rows of a table for people.
_SHOWN = 12


def values(text: str, option: str) -> NDArray[np.float64]:
    """Numbers from "1,2,5" or from "START:STOP:COUNT", with ":log" at the end for equal ratios."""
    parts = text.split(":")
    try:
        if len(parts) == 1:
            return np.array([float(part) for part in text.split(",")])
        start, stop, count = float(parts[0]), float(parts[1]), int(parts[2])
    except (ValueError, IndexError):
        raise InvalidOption(
            f"{option} takes numbers, 1,2,5, or a range, START:STOP:COUNT[:log], not {text!r}"
        ) from None
    if len(parts) > 4 or (len(parts) == 4 and parts[3] != "log") or not 2 <= count <= 100_000:
        raise InvalidOption(f"{option} takes a range as START:STOP:COUNT[:log], COUNT from 2 to 100000, not {text!r}")
    if len(parts) == 3:
        return np.linspace(start, stop, count)
    if not (start > 0.0 and stop > 0.0):
        raise InvalidOption(f"{option}: a range with :log needs positive ends, not {text!r}")
    return np.geomspace(start, stop, count)


def motions_from(
    names: Sequence[str], *, channel: str | None, dt: float | None, units: str | None, scale: float = 1.0
) -> list[Motion]:
    """Motions of several record files or shipped records."""
    if not names:
        raise InvalidOption("give one record or more: files, or names of shipped records (see rocking records)")
    return [named_motion(name, channel=channel, dt=dt, units=units, scale=scale) for name in names]


def write(
    folder: Path, stem: str, *, figure: Figure, result: Mapping[str, Any], dataset: xr.Dataset | None = None
) -> None:
    """Write a figure (PNG and PDF), a result (JSON) and a dataset (NetCDF) into a folder.

    Raises
    ------
    OutputError
        If one of them cannot be written.
    """
    try:
        figure.savefig(folder / f"{stem}.png", dpi=160)
        figure.savefig(folder / f"{stem}.pdf")
        (folder / "result.json").write_text(json.dumps(options.plain(result), indent=2) + "\n", "utf-8")
        if dataset is not None:
            dataset.to_netcdf(folder / f"{stem}.nc", engine="h5netcdf")
    except OSError as error:
        raise OutputError(f"{folder} cannot be written to: {error.strerror}; choose another --out") from error


def show(result: Mapping[str, Any], text: str, *, as_json: bool, folder: Path | None) -> None:
    """Print a result, for machines or for people, and what was written."""
    if as_json:
        options.print_json(result)
        return
    print(text)
    if folder is not None:
        print(f"\nwritten to {folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}")


def table(header: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Columns of numbers and texts, numbers to five digits."""
    cells = [[*header], *([_cell(entry) for entry in row] for row in rows)]
    widths = [max(len(row[k]) for row in cells) for k in range(len(header))]
    return "\n".join("  ".join(text.rjust(width) for text, width in zip(row, widths, strict=True)) for row in cells)


def some(count: int) -> list[int]:
    """List at most a dozen positions, evenly from the first to the last."""
    return sorted({round(k) for k in np.linspace(0, count - 1, min(count, _SHOWN))})


def _cell(entry: Any) -> str:
    if isinstance(entry, (float, np.floating)):
        return "overturns" if np.isposinf(entry) else "-" if np.isnan(entry) else f"{entry:.5g}"
    return str(entry)
