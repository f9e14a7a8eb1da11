"""A response as a dataset, as data frames and as a figure; every column is named with its unit, by one rule."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np

from rocking import checks
from rocking.arrays import Floats
from rocking.body import title_of
from rocking.constants import STANDARD_GRAVITY
from rocking.errors import InvalidOption
from rocking.plot.response import RotationUnits
from rocking.problem import thresholds_of
from rocking.response.answers import Answers, history_of
from rocking.response.history import even_times
from rocking.tables import as_written, named, rows_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: What a response can be written as.
ResponseTable = Literal["histories", "events", "impacts", "chattering"]

_DIMENSIONS: Final = {"events": "event", "impacts": "impact", "chattering": "sequence"}

#: Points that a computer's memory holds.
_MOST_POINTS: Final = 50_000_000

#: Points of a history whose motion has no step of its own, and even times of a drawn line.
_POINTS: Final = 2000
_EVEN_TIMES: Final = 4001


def dataset(response: Answers, dt: float | None) -> xr.Dataset:
    """Histories over time, and one dimension each for events, impacts and chattering sequences."""
    import xarray as xr

    times = _axis(response, dt)
    variables: dict[str, Any] = {
        name: ("time", values, {"units": unit}) for name, (values, unit) in _histories(response, times).items()
    }
    for table, dimension in _DIMENSIONS.items():
        for name, (values, unit) in _columns(response, table).items():
            column = values.astype(object) if values.dtype.kind == "U" else values
            variables[f"{dimension}_{name}"] = (dimension, column, {"units": unit})
    return xr.Dataset(variables, {"time": ("time", times, {"units": "s"})}, _attributes(response))


def frame(response: Answers, table: str, dt: float | None) -> pd.DataFrame:
    """One table as a data frame; histories are indexed by time."""
    import pandas as pd

    checks.one_of(table, "table", InvalidOption, get_args(ResponseTable))
    if table != "histories":
        if dt is not None:
            raise InvalidOption(f"{{}} is the step of the histories; the {table} have none", "dt")
        return pd.DataFrame({named(name, unit): values for name, (values, unit) in _columns(response, table).items()})
    times = _axis(response, dt)
    columns = {named(name, unit): values for name, (values, unit) in _histories(response, times).items()}
    return pd.DataFrame(columns, index=pd.Index(times, name=named("time", "s")))


def records(response: Answers, table: str) -> list[dict[str, Any]]:
    """Rows of a table as mappings, names with units."""
    names = [named(name, unit) for name, (_, unit) in _columns(response, table).items()]
    return [dict(zip(names, row.values(), strict=True)) for row in rows_of(getattr(response, table))]


def _columns(response: Answers, table: str) -> dict[str, tuple[np.ndarray[Any, Any], str]]:
    """Fields of one of the response's own tables, with their units."""
    rows, speed = getattr(response, table), f"{response.body.coordinate.unit}/s"
    units = {"kind": "1", "side": "1", "impacts": "1", "speed_before": speed, "speed_after": speed}
    units |= {"elongation": "m", "force": "N", "plastic_elongation": "m"}
    return {name: (rows[name], units.get(name, "s")) for name in rows.dtype.names}


def _histories(response: Answers, times: Floats) -> dict[str, tuple[Floats, str]]:
    states, (name, rate, _, unit, _) = response.states(times), response.body.coordinate
    motion = response.motion
    histories = {
        name: (states[:, 0], unit),
        rate: (states[:, 1], f"{unit}/s"),
        "ground_acceleration": (np.zeros_like(times) if motion is None else motion.acceleration(times), "m/s^2"),
    }
    if motion is not None and motion.vertical is not None:
        histories["vertical_ground_acceleration"] = (motion.vertical.acceleration(times), "m/s^2")
    return histories


def _axis(response: Answers, dt: float | None) -> Floats:
    if dt is None:
        step = None if response.motion is None else response.motion.step
        # A pulse of a few straight lines has a step, too, that shows nothing.
        dt = step if step and step <= 0.01 * response.duration else max(response.duration, 1e-3) / _POINTS
    step = checks.positive(dt, "dt", InvalidOption, "s")
    if response.duration > _MOST_POINTS * step:
        raise InvalidOption(
            f"{{}} = {step:g} s makes more than {_MOST_POINTS:,} points of {response.duration:g} s; take a longer step",
            "dt",
            value=dt,
        )
    return even_times(response.duration, step)


def _attributes(response: Answers) -> dict[str, Any]:
    body, motion, coordinate = response.body, response.motion, response.body.coordinate
    return {
        "block": body.description,
        **{named(name, unit): values[0].tolist() for name, (values, unit) in body.alone().parameters().items()},
        named("gravity", "m/s^2"): body.gravity,
        "motion": "none" if motion is None else motion.name,
        "vertical_motion": "none" if motion is None or motion.vertical is None else motion.vertical.name,
        "motion_history": "" if motion is None else "; ".join(motion.history),
        "model": response.model,
        "chattering_treatment": repr(response.treatment),
        "overturned": int(response.overturned),
        "unfinished": int(response.unfinished),
        "stopped": int(response.stopped),
        "leans": int(response.leans),
        named("overturn_time", "s"): response.overturn_time,
        named(f"peak_{coordinate.name}", coordinate.unit): response.peak_rotation,
        named(f"residual_{coordinate.name}", coordinate.unit): response.residual_rotation,
        named("peak_time", "s"): response.peak_time,
        "ambiguous": int(response.ambiguous),
    }


def figure(
    response: Answers,
    units: RotationUnits,
    window: tuple[float, float] | None,
    title: str,
    ax: Axes | None,
    figsize: tuple[float, float] | None,
    *,
    longest_sequence: bool,
) -> Figure:
    """Draw the rotation over the ground motion, from the window's start to its end."""
    from rocking.plot.response import DrawnSequence, response_figure

    checks.one_of(units, "units", InvalidOption, get_args(RotationUnits))
    start, end = active_span(response) if window is None else checked_window(window, response.duration)
    times = drawing_times(response, start, end)
    body, motion = response.body, response.motion
    coordinate = body.coordinate
    corners = np.empty(0) if motion is None else motion.drawing_times(start, end)
    lift = None if motion is None or motion.vertical is None else motion.vertical.acceleration(corners)
    weight = 1.0 if lift is None else 1.0 + lift / body.gravity
    (pair,), (own,) = thresholds_of(body.alone(), response.model)
    with np.errstate(invalid="ignore"):  # of a body of one side, which nothing lifts to the other
        plus, minus = ((pair[k] + (weight - 1.0) * own[k]) / STANDARD_GRAVITY for k in range(2))
    balance = (response.balance[0], response.balance[0 if math.isinf(pair[1]) else 1])
    if units == "slenderness" and any(map(math.isinf, balance)):
        units = "rad"
    sequence = _longest_sequence(response, start, end) if longest_sequence else None
    return response_figure(
        time=times,
        rotation=response.states(times)[:, 0],
        slenderness=balance,
        limit=coordinate.limit,
        impact_times=response.impacts["time"],
        rest_intervals=response.rest_intervals,
        uplift_times=response.events["time"][response.events["kind"] == "uplift"],
        overturn_time=response.overturn_time if response.overturned and response.overturn_time <= end else None,
        motion_time=corners,
        motion_acceleration_g=corners if motion is None else motion.acceleration(corners) / STANDARD_GRAVITY,
        thresholds_g=(plus, minus),
        vertical_acceleration_g=None if lift is None else lift / STANDARD_GRAVITY,
        duration=response.duration,
        chattering=None if sequence is None else DrawnSequence(*sequence),
        units=units,
        label="" if coordinate.unit == "rad" else f"{coordinate.name} ({coordinate.unit})",
        title=title or titled(response),
        ax=ax,
        figsize=figsize,
    )


def titled(response: Answers) -> str:
    """Return what was simulated, for the title of a figure."""
    shaken = "no motion" if response.motion is None else response.motion.label
    return as_written(f"{title_of(response.body)} under {shaken}")


def active_span(response: Answers) -> tuple[float, float]:
    """Stretch worth drawing: from a little before the first event to a little after the last."""
    times = np.concatenate([response.events["time"], response.impacts["time"]])
    if len(times) == 0:
        return 0.0, response.duration
    first = float(times.min()) if response.states(0.0)[0] == 0.0 else 0.0
    margin = 0.1 * (float(times.max()) - first) + 0.5
    return max(0.0, first - margin), min(response.duration, float(times.max()) + margin)


def drawing_times(response: Answers, start: float, end: float) -> Floats:
    """Return times dense enough for a smooth line: even ones, and those of steps that are long enough to see."""
    even = np.linspace(start, end, _EVEN_TIMES)
    steps = _within(history_of(response).trail.nodes["time"], start, end)
    visible = np.diff(np.floor(steps / max(even[1] - even[0], 1e-12)), prepend=-1.0) > 0.0
    return np.union1d(even, steps[visible])


def checked_window(window: Sequence[float], duration: float) -> tuple[float, float]:
    """Return a stretch of time, s, of a response that lasts so long.

    Raises
    ------
    InvalidOption
        If it is none.
    """
    ends: Any = checks.numbers(window, "window", InvalidOption)
    if ends.shape != (2,) or not 0.0 <= ends[0] < ends[1] <= duration:
        raise InvalidOption(
            f"{{}} must be (start, end), in s, with 0 <= start < end <= {duration:.6g}, the duration",
            "window",
            value=window,
        )
    return float(ends[0]), float(ends[1])


def _longest_sequence(response: Answers, start: float, end: float) -> tuple[Floats, float, float, float, str] | None:
    """Impact times of the chattering sequence with the most impacts in the stretch, and how far its rest is known."""
    shown = response.chattering[(response.chattering["start"] >= start) & (response.chattering["end"] <= end)]
    longest = max(shown, key=lambda row: row["impacts"], default=None)
    if longest is None:
        return None
    times = _within(response.impacts["time"], longest["start"], longest["end"])
    near = response.perturbed()
    off = float(near.event_spreads[response.events["time"] == longest["end"]].max(initial=0.0))
    return times, float(longest["lower"]), float(longest["upper"]), off, near.sample


def _within(times: Floats, start: float, end: float) -> Floats:
    return times[(times >= start) & (times <= end)]
