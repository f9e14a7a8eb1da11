"""Conversion of bodies, a motion and the settings of a simulation to the records and arrays that kernels accept."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from typing import cast

import numpy as np

from rocking.block import Block, one_block
from rocking.block.body import KINDS, Bodies, Body
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import MODELS, Model
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import InvalidOption
from rocking.kernels import ground, state
from rocking.kernels.ground import Ground
from rocking.motion import piecewise
from rocking.motion.motion import Motion

#: Largest initial velocity, rad/s or m/s, with squares and fourth powers far from overflow.
FASTEST = 1e6

#: Requirement for an argument that may be any body.
_NEEDED = "a Block or another body"


@functools.lru_cache(maxsize=8)
def ground_of(motion: Motion | None, gravity: float, factor: float = 1.0) -> Ground:
    """Create the ground of a motion multiplied by a factor, without pieces if there is no motion.

    A negative factor applies to the horizontal component only. The last few results are cached, because their creation
    takes as long as the simulation of a block.
    """
    if motion is None:
        return ground.build_ground(_NO_BREAKPOINTS, _NO_COEFFICIENTS, 1.0, 0.0)
    coefficients = motion.coefficients if factor == 1.0 else _frozen(motion.coefficients * factor)
    if motion.vertical is None:
        return ground.build_ground(motion.breakpoints, coefficients, 1.0 / gravity, motion.error * abs(factor))
    (breakpoints, pushes), (_, lifts) = _joined(motion)
    error = max(motion.error, motion.vertical.error)
    return ground.build_ground(
        breakpoints, pushes * factor, 1.0 / gravity, error * abs(factor), vertical=lifts * abs(factor)
    )


def step_of(motion: Motion) -> float | None:
    """Return the length of the pieces of `ground_of` if equally long and linear in all components, else None."""
    if motion.vertical is None:
        return motion.dt
    steps = [piecewise.find_even_step(pieces) for pieces in _joined(motion)]
    return None if None in steps else steps[0]


def bodies_of(given: Bodies | Body | Iterable[Body]) -> Bodies:
    """Return bodies unchanged, and convert single ones of one kind to `Bodies` of that kind."""
    if isinstance(given, Bodies) and not isinstance(given, type):
        return given
    several = isinstance(given, Iterable) and not isinstance(given, (str, Body))
    bodies = [one_body(each) for each in (cast("Iterable[Body]", given) if several else [cast("Body", given)])]
    if len(bodies) == 1:
        return bodies[0].alone()
    return KINDS[bodies[0].alone().kind if bodies else "blocks"].from_bodies(bodies)


def slenderness_of(bodies: Bodies) -> Floats:
    """Return the slenderness of each body as it stands, rad, the smaller of two sides, which normalises rotations."""
    found = bodies.parameters().get("alpha")
    if found is None:
        raise InvalidOption(f"this is known of blocks alone, which have a slenderness, not of {bodies.kind}")
    return np.asarray(found[0].min(axis=1))


def thresholds_of(bodies: Bodies, model: Model) -> tuple[Floats, Floats]:
    """Return uplift accelerations of each body and side, and the parts due to its own weight, m/s^2, shape (n, 2)."""
    made = bodies.kernel_records(model, np.zeros((len(bodies), 2)))
    own = bodies.gravity * made["threshold"]
    return own + bodies.gravity * made["restraint_threshold"], own


def one_body(body: Body) -> Body:
    """Return the body, or raise an error if the argument is not a body."""
    if isinstance(body, Block) or (isinstance(body, Body) and not isinstance(body, type)):  # protocols are slow
        return body
    return one_block(body, _NEEDED)


def set_start(
    states: state.Records,
    records: state.Records,
    bodies: Bodies,
    coordinate: float | Floats | None,
    rate: float | Floats,
    name: str | None = None,
) -> None:
    """Set the states of bodies at rest at time zero to coordinates and their rates.

    There is one body per state, or one for all. By default the coordinate is zero, or the stop if zero is behind it.
    ``name`` is the coordinate in errors, by default as in "initial_rotation".

    Raises
    ------
    InvalidOption
        If a state is inadmissible, or a number is not finite or absurdly large.
    """
    stops = bodies.stops
    still = not isinstance(rate, np.ndarray) and rate == 0.0 and (coordinate is None or coordinate == 0.0)
    if still and not np.count_nonzero(stops):
        return
    facing, one_sided = records["two_stops"], records["next_side"][:, 0] == 0
    if coordinate is None:
        coordinate = np.clip(0.0, stops[:, 0], np.where(facing, stops[:, 1], np.inf))
    if not isinstance(rate, np.ndarray):  # arrays are already checked, and a body in them may have overturned
        _check_start(coordinate, rate, records, bodies, name)
    at, speed = np.asarray(coordinate, dtype=float), np.asarray(rate, dtype=float)
    from_plus = at - stops[:, 0]
    sign = np.where(one_sided, 1.0, np.sign(np.where(from_plus == 0.0, speed, from_plus)))
    at_other = facing & (at == stops[:, 1])
    u, v = np.where(at_other, 0.0, sign * from_plus), np.where(at_other, -speed, sign * speed)
    wrong = one_sided & ((u < 0.0) | (facing & (u > records["overturn_angle"])) | ((u == 0.0) & (v < 0.0)))
    if np.any(wrong):
        body = bodies[min(k := int(np.argmax(wrong)), len(bodies) - 1)]
        called, unit = name or f"initial_{body.coordinate.name}", body.coordinate.unit
        low, high = body.stops
        where = f"from {low:g} to {high:g} {unit}" if high > low else f"at least {low:g} {unit}"
        value, fast = (float(np.broadcast_to(each, u.shape)[k]) for each in (at, speed))
        raise InvalidOption(
            f"{{}} must be {where}, in front of the body's stop, and {{}} must not lead into it: they are {value:g} "
            f"{unit} and {fast:g} {unit}/s",
            called,
            "initial_velocity",
            value=value,
        )
    side = np.where((sign < 0.0) | at_other, 1, 0)
    at_rest = (u == 0.0) & (v == 0.0)
    states["side"] = np.where(at_rest, np.where(facing, -1 - side, state.AT_REST), side)
    states["u"], states["v"], states["peak"] = u, v, np.where(at_other, records["overturn_angle"], u)


def highest(states: state.Records, records: state.Records, stops: Floats) -> Floats:
    """Return peaks of coordinates from the peaks in the frame of side +, exactly the stop at a second stop."""
    peaks: Floats = states["peak"] + stops[..., 0]
    if not records["two_stops"].any():
        return peaks
    return np.where(records["two_stops"] & (states["peak"] >= records["overturn_angle"]), stops[..., 1], peaks)


def _check_start(
    coordinate: float | Floats, rate: float, records: state.Records, bodies: Bodies, name: str | None
) -> None:
    """Check the coordinate and the rate of one body or of all, fastest for Python numbers."""
    plain = type(coordinate) is float and type(rate) is float and math.isfinite(coordinate) and abs(rate) <= FASTEST
    fallen = np.where(records["two_stops"], np.inf, records["overturn_angle"]).min()
    if plain and abs(coordinate) < fallen:
        return
    kind = bodies[0].coordinate
    called = name or f"initial_{kind.name}"
    u = float(coordinate[0]) if isinstance(coordinate, np.ndarray) else checks.finite(coordinate, called, InvalidOption)
    v = checks.finite(rate, "initial_velocity", InvalidOption)
    if abs(v) > FASTEST:
        raise InvalidOption(
            f"{{}} must be at most {FASTEST:g} {kind.unit}/s in size, not {v:g}", "initial_velocity", value=v
        )
    if abs(u) >= fallen:
        limit = "pi/2" if fallen == 0.5 * math.pi else f"{fallen:g}"
        hint = checks.hint_at_degrees(u) if kind.unit == "rad" else ""
        raise InvalidOption(
            f"{{}} must be below {limit} {kind.unit} in size, not {u:g}{hint}", called, value=coordinate
        )


def never_rests(bodies: Bodies) -> bool:
    """Whether two successive impacts of one of the bodies lose no speed at all."""
    e = bodies.restitution
    return bool(np.count_nonzero(e[:, 0] * e[:, 1] == 1.0))


def settings_of(
    bodies: Bodies, model: Model, scheme: ChatteringScheme, duration: float | None, *, record: bool
) -> state.Record:
    """Check and return the settings of a simulation; a duration is required if nothing comes to rest."""
    checks.choice(model, "model", InvalidOption, MODELS)
    if duration is None:
        if never_rests(bodies):
            raise InvalidOption(
                "a block with {} 1 never comes to rest; give {} to say when to stop", "restitution", "duration"
            )
    else:
        duration = checks.positive(duration, "duration", InvalidOption, "s")
    stop = math.inf if duration is None else duration
    fields = (model == "nonlinear", scheme.code, scheme.bracket, stop, duration is None, record)
    return state.expose_fields(np.array([fields], dtype=state.SETTINGS))[0]


@functools.lru_cache(maxsize=8)
def _joined(motion: Motion) -> tuple[piecewise.Pieces, piecewise.Pieces]:
    """Return both components of a motion on the same pieces."""
    assert motion.vertical is not None
    breakpoints, (pushes, lifts) = piecewise.align_pieces(motion, motion.vertical)
    return piecewise.Pieces(breakpoints, pushes), piecewise.Pieces(breakpoints, lifts)


def _frozen(array: Floats) -> Floats:
    array.flags.writeable = False
    return array


_NO_BREAKPOINTS, _NO_COEFFICIENTS = _frozen(np.zeros(1)), _frozen(np.zeros((0, 2)))
