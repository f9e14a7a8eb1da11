"""What the commands with many simulations share: ranges of numbers, several records, and writing what came out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rocking.errors import InvalidOption, OutputError
from rocking.motion.motion import Motion
from rocking.motion.named import named_motion
from rocking.result import Result
from rocking.tables import to_json

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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


def write(folder: Path, stem: str, *, figure: Figure, result: Mapping[str, Any]) -> None:
    """Write a figure (PNG and PDF) and a result (JSON) into a folder.

    Raises
    ------
    OutputError
        If one of them cannot be written.
    """
    try:
        figure.savefig(folder / f"{stem}.png", dpi=160)
        figure.savefig(folder / f"{stem}.pdf")
        (folder / "result.json").write_text(to_json(result) + "\n", "utf-8")
    except OSError as error:
        raise OutputError(f"{folder} cannot be written to: {error.strerror}; choose another --out") from error


def deliver(found: Result, stem: str, *, folder: Path | None, as_json: bool, **figure: Any) -> None:
    """Write an analysis into a folder where there is one (figure, dataset, result), and print it."""
    result = found.to_dict()
    if folder is not None:
        found.to_netcdf(folder / f"{stem}.nc")
        write(folder, stem, figure=found.plot(**figure), result=result)
    show(result, found.summary(), as_json=as_json, folder=folder)


def show(result: Mapping[str, Any], text: str, *, as_json: bool, folder: Path | None) -> None:
    """Print a result, for machines or for people, and what was written."""
    if as_json:
        print(to_json(result))
        return
    print(text)
    if folder is not None:
        print(f"\nwritten to {folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}")
