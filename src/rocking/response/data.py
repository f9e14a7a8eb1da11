"""A response as a dataset, as data frames and as files; every column is named with its unit, by one rule."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from rocking import checks, tables
from rocking.arrays import Floats
from rocking.errors import InvalidOption
from rocking.response.history import History, even_times
from rocking.tables import named, rows_of, write_text

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from rocking.response.response import Response

#: What a response can be written as.
Table = Literal["histories", "events", "impacts", "chattering"]
TABLES: Final = ("histories", "events", "impacts", "chattering")

#: Units of the fields of the response's own tables.
_UNITS: Final[dict[str, dict[str, str]]] = {
    "events": {"time": "s", "kind": "1", "side": "1"},
    "impacts": {"time": "s", "side": "1", "speed_before": "rad/s", "speed_after": "rad/s"},
    "chattering": {"start": "s", "end": "s", "lower": "s", "upper": "s", "impacts": "1"},
}
_DIMENSIONS: Final = {"events": "event", "impacts": "impact", "chattering": "sequence"}

#: Points that a computer's memory holds.
_MOST_POINTS: Final = 50_000_000

#: Points of a history whose motion has no step of its own.
_POINTS: Final = 2000


def dataset(response: Response, dt: float | None) -> xr.Dataset:
    """Histories over time, and one dimension each for events, impacts and chattering sequences."""
    import xarray as xr

    times = _axis(response, dt)
    variables: dict[str, Any] = {
        name: ("time", values, {"units": unit}) for name, (values, unit) in _histories(response, times).items()
    }
    for table, dimension in _DIMENSIONS.items():
        rows = getattr(response, table)
        for name, unit in _UNITS[table].items():
            column = rows[name].astype(object) if rows[name].dtype.kind == "U" else rows[name]
            variables[f"{dimension}_{name}"] = (dimension, column, {"units": unit})
    return xr.Dataset(variables, {"time": ("time", times, {"units": "s"})}, _attributes(response))


def frame(response: Response, table: Table, dt: float | None) -> pd.DataFrame:
    """One table as a data frame; histories are indexed by time."""
    import pandas as pd

    checks.one_of(table, "table", InvalidOption, TABLES)
    if table != "histories":
        if dt is not None:
            raise InvalidOption(f"dt= is the step of the histories; the {table} have none")
        rows = getattr(response, table)
        return pd.DataFrame({named(name, unit): rows[name] for name, unit in _UNITS[table].items()})
    times = _axis(response, dt)
    columns = {named(name, unit): values for name, (values, unit) in _histories(response, times).items()}
    return pd.DataFrame(columns, index=pd.Index(times, name=named("time", "s")))


def write_csv(response: Response, path: str | Path, table: Table, dt: float | None) -> None:
    """Write one table as text columns with a header."""
    rows = frame(response, table, dt)
    write_text(path, rows.to_csv(index=table == "histories", float_format="%.15g", lineterminator="\n"))


def write_netcdf(response: Response, path: str | Path, dt: float | None) -> None:
    """Write the dataset as a NetCDF file."""
    tables.write_netcdf(path, dataset(response, dt))


def records(response: Response, table: Table) -> list[dict[str, Any]]:
    """Rows of a table as mappings, names with units."""
    units = _UNITS[table]
    return [
        {named(name, units[name]): value for name, value in row.items()} for row in rows_of(getattr(response, table))
    ]


def _histories(response: Response, times: Floats) -> dict[str, tuple[Floats, str]]:
    states = History(response.trail, response.duration).states(times)
    ground = np.zeros_like(times) if response.motion is None else response.motion.acceleration(times)
    histories = {
        "rotation": (states[:, 0], "rad"),
        "angular_velocity": (states[:, 1], "rad/s"),
        "ground_acceleration": (ground, "m/s^2"),
    }
    if response.motion is not None and response.motion.vertical is not None:
        histories["vertical_ground_acceleration"] = (response.motion.vertical.acceleration(times), "m/s^2")
    return histories


def _axis(response: Response, dt: float | None) -> Floats:
    if dt is None:
        step = None if response.motion is None else response.motion.step
        # A pulse of a few straight lines has a step, too, that shows nothing.
        dt = step if step and step <= 0.01 * response.duration else max(response.duration, 1e-3) / _POINTS
    step = checks.positive(dt, "dt", InvalidOption, "s")
    if response.duration > _MOST_POINTS * step:
        raise InvalidOption(
            f"dt = {step:g} s makes more than {_MOST_POINTS:,} points of {response.duration:g} s; take a longer step"
        )
    return even_times(response.duration, step)


def _attributes(response: Response) -> dict[str, Any]:
    sides, motion = response.block.sides, response.motion
    return {
        "block": response.block.description,
        named("p", "rad/s"): [side.p for side in sides],
        named("alpha", "rad"): [side.alpha for side in sides],
        "restitution": [side.restitution for side in sides],
        named("gravity", "m/s^2"): response.block.gravity,
        "motion": "none" if motion is None else motion.name,
        "vertical_motion": "none" if motion is None or motion.vertical is None else motion.vertical.name,
        "motion_history": "" if motion is None else "; ".join(motion.history),
        "model": response.model,
        "chattering_treatment": repr(response.treatment),
        "overturned": int(response.overturned),
        "unfinished": int(response.unfinished),
        "stopped": int(response.stopped),
        named("overturn_time", "s"): response.overturn_time,
        named("peak_rotation", "rad"): response.peak_rotation,
        named("peak_time", "s"): response.peak_time,
        "ambiguous": int(response.ambiguous),
    }
