"""A response as plain values, as columns of tables and as a dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking.block import RestrainedBlock
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.result import Row
from rocking.core.tables import Column, named, records_of
from rocking.errors import InvalidOption
from rocking.response.history import even_times
from rocking.response.perturbed import steps_within

if TYPE_CHECKING:
    import xarray as xr

    from rocking.response.response import Response

#: Points that a computer's memory holds, and those of a history whose motion has no step of its own.
_MOST_POINTS: Final = 50_000_000
_POINTS: Final = 2000


def columns(response: Response, table: str, dt: float | None = None) -> list[Column]:
    """Return the columns of a table: histories, or one of the response's own structured arrays."""
    if table == "histories":
        return _histories(response, _times(response, dt))
    if dt is not None:
        raise InvalidOption(f"{{}} is the step of the histories; the {table} have none", "dt")
    rows, speed = getattr(response, table), f"{response.body.coordinate.unit}/s"
    units = {"kind": "1", "side": "1", "impacts": "1", "speed_before": speed, "speed_after": speed}
    units |= {"elongation": "m", "force": "N", "plastic_elongation": "m"}
    return [Column(name, rows[name], units.get(name, "s")) for name in rows.dtype.names]


def _histories(response: Response, times: Floats) -> list[Column]:
    states, (name, rate, _, unit, _), motion = response.states(times), response.body.coordinate, response.motion
    ground = np.zeros_like(times) if motion is None else motion.acceleration(times)
    found = [
        Column("time", times, "s"),
        Column(name, states[:, 0], unit),
        Column(rate, states[:, 1], f"{unit}/s"),
        Column("ground_acceleration", ground, "m/s^2"),
    ]
    if motion is not None and motion.vertical is not None:
        found.append(Column("vertical_ground_acceleration", motion.vertical.acceleration(times), "m/s^2"))
    return found


def _times(response: Response, dt: float | None) -> Floats:
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


def dataset(response: Response, dt: float | None) -> xr.Dataset:
    """Return histories over time, and one dimension each for events, impacts and chattering sequences."""
    import xarray as xr

    time, *histories = columns(response, "histories", dt)
    variables: dict[str, Any] = {each.name: ("time", each.values, {"units": each.unit}) for each in histories}
    for table, dimension in (("events", "event"), ("impacts", "impact"), ("chattering", "sequence")):
        for name, values, unit, _ in columns(response, table):
            column = values.astype(object) if values.dtype.kind == "U" else values
            variables[f"{dimension}_{name}"] = (dimension, column, {"units": unit})
    body, motion, coordinate = response.body, response.motion, response.body.coordinate
    flags = ("overturned", "unfinished", "stopped", "leans")
    attributes = {
        "block": body.description,
        **{named(name, unit): values[0].tolist() for name, (values, unit) in body.alone().parameters().items()},
        named("gravity", "m/s^2"): body.gravity,
        "motion": "none" if motion is None else motion.name,
        "vertical_motion": "none" if motion is None or motion.vertical is None else motion.vertical.name,
        "motion_history": "" if motion is None else "; ".join(motion.history),
        "model": response.model,
        "chattering_treatment": repr(response.treatment),
        **{name: int(getattr(response, name)) for name in flags},
        named("overturn_time", "s"): response.overturn_time,
        named(f"peak_{coordinate.name}", coordinate.unit): response.peak_rotation,
        named(f"residual_{coordinate.name}", coordinate.unit): response.residual_rotation,
        named("peak_time", "s"): response.peak_time,
        "ambiguous": int(response.ambiguous),
    }
    return xr.Dataset(variables, {"time": ("time", time.values, {"units": "s"})}, attributes)


def facts(response: Response, friction: float | None, precision: float) -> list[Row]:
    """Return the entries of `Response.to_dict`."""
    body, motion, (name, _, _, unit, limit) = response.body, response.motion, response.body.coordinate
    block = {
        "description": body.description,
        **{named(key, of): values[0] for key, (values, of) in body.alone().parameters().items()},
        named("gravity", "m/s^2"): body.gravity,
    }
    shaken = motion and {
        "name": motion.name,
        named("duration", "s"): motion.duration,
        named("pga", "m/s^2"): motion.pga,
        "history": motion.history,
        "vertical": motion.vertical and {"name": motion.vertical.name, named("pga", "m/s^2"): motion.vertical.pga},
    }
    rows = [
        Row("block", block),
        Row("motion", shaken),
        Row("model", response.model),
        Row("chattering_treatment", repr(response.treatment)),
        Row("overturned", response.overturned),
        Row("unfinished", response.unfinished),
        Row("stopped", response.stopped),
        Row("leans", response.leans),
        Row("overturn_time", response.overturn_time, "s"),
        Row("tipping_time", response.tipping_time, "s"),
        Row(f"peak_{name}", response.peak_rotation, unit),
        Row(f"residual_{name}", response.residual_rotation, unit),
    ]
    if limit:
        rows.append(Row(f"peak_over_{limit}", response.peak_over_slenderness))
    if isinstance(body, RestrainedBlock):
        rows += [Row("balance", list(response.balance), unit), Row("tendons", records_of(columns(response, "tendons")))]
    rows.append(Row("peak_time", response.peak_time, "s"))
    if body.contact is not None:
        rows += [
            Row("required_friction", response.required_friction),
            Row("minimum_normal_force_over_weight", response.minimum_normal_force),
            Row("lift_off_time", response.lift_off_time, "s"),
        ]
    if friction is not None:
        rows += [Row("friction", friction), Row("sliding_time", response.sliding_time(friction), "s")]
    return [
        *rows,
        Row("impacts_resolved", len(response.impacts)),
        Row("duration", response.duration, "s"),
        Row("time_at_rest", response.time_at_rest, "s"),
        Row(
            "perturbed",
            [each.to_dict() for each in (response.perturbed(), response.perturbed(*steps_within(precision)))],
        ),
        Row("ambiguous", response.ambiguous),
        Row("ambiguities", response.ambiguities),
        Row("events", records_of(columns(response, "events"))),
        Row("chattering", records_of(columns(response, "chattering"))),
    ]
