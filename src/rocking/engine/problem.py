"""Conversion of bodies, a motion and the settings of a simulation to the structs and arrays that kernels accept."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from typing import NamedTuple, cast

import numpy as np

from rocking.block import Block
from rocking.block.body import BODIES_TYPES, Bodies, Body
from rocking.block.single import require_block
from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.core.constants import MODELS, Model
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import OptionError
from rocking.kernels import ground, state
from rocking.kernels.ground import Ground, Grounds
from rocking.motion import piecewise
from rocking.motion.motion import Motion

#: Largest initial velocity, rad/s or m/s, with squares and fourth powers far from overflow.
MAX_SPEED = 1e6

#: Requirement for an argument that may be any body.
_BODY_REQUIREMENT = "a Block or another body"


@functools.lru_cache(maxsize=8)
def prepare_ground(motion: Motion | None, gravity: float) -> Ground:
    """Create the ground of a motion, without pieces if there is no motion.

    Replace its factor for a scaled motion; a negative factor applies to the horizontal component only. The last few
    results are cached, because their creation takes as long as the simulation of a block.
    """
    if motion is None:
        return ground.build_ground(_NO_BREAKPOINTS, _NO_COEFFICIENTS, 1.0, 0.0)
    if motion.vertical is None:
        return ground.build_ground(motion.breakpoints, motion.coefficients, 1.0 / gravity, motion.error)
    (breakpoints, pushes), (_, lifts) = _align_components(motion)
    error = max(motion.error, motion.vertical.error)
    return ground.build_ground(breakpoints, pushes, 1.0 / gravity, error, lifts)


class GroundGroup(NamedTuple):
    """Motions with equally many components and coefficients."""

    indices: Integers  # index of each in the original order
    grounds: Grounds
    steps: Floats  # common step of each motion; 0 if it is not evenly sampled


@functools.lru_cache(maxsize=4)
def prepare_grounds(motions: tuple[Motion, ...], gravity: float) -> list[GroundGroup]:
    """Create the grounds of motions, in groups; the last few results are cached."""
    grounds = [prepare_ground(motion, gravity) for motion in motions]
    steps = np.array([find_common_step(motion) or 0.0 for motion in motions])
    layouts = np.array(
        [
            (item.coefficient_count, item.stretches.shape[1], step > 0.0)
            for item, step in zip(grounds, steps, strict=True)
        ]
    )
    groups = []
    for layout in np.unique(layouts, axis=0):
        indices = np.flatnonzero((layouts == layout).all(axis=1))
        groups.append(GroundGroup(indices, ground.join_grounds([grounds[k] for k in indices]), steps[indices]))
    return groups


def find_common_step(motion: Motion) -> float | None:
    """Return the length of the pieces of `prepare_ground` if equally long and linear in all components, else None."""
    if motion.vertical is None:
        return motion.dt
    steps = [piecewise.find_even_step(pieces) for pieces in _align_components(motion)]
    return None if None in steps else steps[0]


def gather_bodies(blocks: Bodies | Body | Iterable[Body]) -> Bodies:
    """Return bodies unchanged, and convert single ones of one kind to `Bodies` of that kind."""
    if isinstance(blocks, Bodies) and not isinstance(blocks, type):
        return blocks
    is_iterable = isinstance(blocks, Iterable) and not isinstance(blocks, (str, Body))
    bodies = [
        require_body(body) for body in (cast("Iterable[Body]", blocks) if is_iterable else [cast("Body", blocks)])
    ]
    if len(bodies) == 1:
        return bodies[0].as_bodies()
    return BODIES_TYPES[bodies[0].as_bodies().kind if bodies else "blocks"].from_bodies(bodies)


def compute_slenderness(bodies: Bodies) -> Floats:
    """Return the slenderness of each body as it stands, rad, the smaller of two sides, which normalises rotations."""
    parameter = bodies.parameters().get("alpha")
    if parameter is None:
        raise OptionError(f"slenderness is defined for blocks only, not for {bodies.kind}")
    return np.asarray(parameter[0].min(axis=1))


def compute_uplift_thresholds(bodies: Bodies, model: Model) -> tuple[Floats, Floats]:
    """Return uplift accelerations of each body and side, and the parts due to its own weight, m/s^2, shape (n, 2)."""
    structs = bodies.create_kernel_structs(model, np.zeros((len(bodies), 2)))
    weight_part = bodies.gravity * structs["threshold"]
    return weight_part + bodies.gravity * structs["restraint_threshold"], weight_part


def require_body(body: Body) -> Body:
    """Return the body, or raise an error if the argument is not a body."""
    if isinstance(body, Block) or (isinstance(body, Body) and not isinstance(body, type)):  # protocols are slow
        return body
    return require_block(body, _BODY_REQUIREMENT)


def set_start(
    states: state.Structs,
    structs: state.Structs,
    bodies: Bodies,
    coordinate: float | Floats | None,
    rate: float | Floats,
    name: str | None = None,
) -> None:
    """Set the states of bodies at rest at time zero to coordinates and their rates.

    There is one body for each state, or one for all. By default the coordinate is zero, or the stop if zero is behind
    it. ``name`` is the coordinate in errors, by default as in "initial_rotation".

    Raises
    ------
    OptionError
        If a state is inadmissible, or a number is not finite or absurdly large.
    """
    stops = bodies.stops
    is_at_rest = not isinstance(rate, np.ndarray) and rate == 0.0 and (coordinate is None or coordinate == 0.0)
    if is_at_rest and not np.count_nonzero(stops):
        return
    has_two_stops, is_one_sided = structs["two_stops"], structs["next_side"][:, 0] == 0
    if coordinate is None:
        coordinate = np.clip(0.0, stops[:, 0], np.where(has_two_stops, stops[:, 1], np.inf))
    if not isinstance(rate, np.ndarray):  # arrays are already checked, and a body in them may have overturned
        _check_start(coordinate, rate, structs, bodies, name)
    position, speed = np.asarray(coordinate, dtype=float), np.asarray(rate, dtype=float)
    from_plus = position - stops[:, 0]
    sign = np.where(is_one_sided, 1.0, np.sign(np.where(from_plus == 0.0, speed, from_plus)))
    is_at_second_stop = has_two_stops & (position == stops[:, 1])
    u, v = np.where(is_at_second_stop, 0.0, sign * from_plus), np.where(is_at_second_stop, -speed, sign * speed)
    is_invalid = is_one_sided & (
        (u < 0.0) | (has_two_stops & (u > structs["overturn_angle"])) | ((u == 0.0) & (v < 0.0))
    )
    if np.any(is_invalid):
        body = bodies[min(k := int(np.argmax(is_invalid)), len(bodies) - 1)]
        argument, unit = name or f"initial_{body.coordinate.name}", body.coordinate.unit
        low, high = body.stops
        range_text = f"from {low:g} to {high:g} {unit}" if high > low else f"at least {low:g} {unit}"
        value, rate_value = (float(np.broadcast_to(values, u.shape)[k]) for values in (position, speed))
        raise OptionError(
            f"{{}} must be {range_text}, in front of the body's stop, and {{}} must not point into it; got "
            f"{value:g} {unit} and {rate_value:g} {unit}/s",
            argument,
            "initial_velocity",
            value=value,
        )
    side = np.where((sign < 0.0) | is_at_second_stop, 1, 0)
    stands = (u == 0.0) & (v == 0.0)
    states["side"] = np.where(stands, np.where(has_two_stops, -1 - side, state.AT_REST), side)
    states["u"], states["v"], states["peak"] = u, v, np.where(is_at_second_stop, structs["overturn_angle"], u)


def compute_peaks(states: state.Structs, structs: state.Structs, stops: Floats) -> Floats:
    """Return peaks of coordinates from the peaks in the frame of side +, exactly the stop at a second stop."""
    peaks: Floats = states["peak"] + stops[..., 0]
    if not structs["two_stops"].any():
        return peaks
    return np.where(structs["two_stops"] & (states["peak"] >= structs["overturn_angle"]), stops[..., 1], peaks)


def _check_start(
    coordinate: float | Floats, rate: float, structs: state.Structs, bodies: Bodies, name: str | None
) -> None:
    """Check the coordinate and the rate of one body or of all, fastest for Python numbers."""
    is_valid = (
        type(coordinate) is float and type(rate) is float and math.isfinite(coordinate) and abs(rate) <= MAX_SPEED
    )
    overturn_angle = np.where(structs["two_stops"], np.inf, structs["overturn_angle"]).min()
    if is_valid and abs(coordinate) < overturn_angle:
        return
    kind = bodies[0].coordinate
    label = name or f"initial_{kind.name}"
    u = float(coordinate[0]) if isinstance(coordinate, np.ndarray) else checks.finite(coordinate, label, OptionError)
    v = checks.finite(rate, "initial_velocity", OptionError)
    if abs(v) > MAX_SPEED:
        raise OptionError(
            f"{{}} must be at most {MAX_SPEED:g} {kind.unit}/s in size, not {v:g}", "initial_velocity", value=v
        )
    if abs(u) >= overturn_angle:
        limit = "pi/2" if overturn_angle == 0.5 * math.pi else f"{overturn_angle:g}"
        hint = checks.hint_at_degrees(u) if kind.unit == "rad" else ""
        raise OptionError(f"{{}} must be below {limit} {kind.unit} in size, not {u:g}{hint}", label, value=coordinate)


def conserves_speed(bodies: Bodies) -> bool:
    """Whether two successive impacts of one of the bodies lose no speed at all."""
    e = bodies.restitution
    return bool(np.count_nonzero(e[:, 0] * e[:, 1] == 1.0))


def build_settings(
    bodies: Bodies, model: Model, scheme: ChatteringScheme, duration: float | None, *, writes_tables: bool
) -> state.Struct:
    """Check and return the settings of a simulation; a duration is required if nothing comes to rest."""
    checks.choice(model, "model", OptionError, MODELS)
    if duration is None:
        if conserves_speed(bodies):
            raise OptionError(
                "a block with {} 1 never comes to rest; give {} to limit the simulation", "restitution", "duration"
            )
    else:
        duration = checks.positive(duration, "duration", OptionError, "s")
    stop_time = math.inf if duration is None else duration
    fields = (model == "nonlinear", scheme.code, scheme.bracket_width, stop_time, duration is None, writes_tables)
    return state.expose_fields(np.array([fields], dtype=state.SETTINGS_DTYPE))[0]


@functools.lru_cache(maxsize=8)
def _align_components(motion: Motion) -> tuple[piecewise.Pieces, piecewise.Pieces]:
    """Return both components of a motion on the same pieces."""
    assert motion.vertical is not None
    breakpoints, (pushes, lifts) = piecewise.align_pieces(motion, motion.vertical)
    return piecewise.Pieces(breakpoints, pushes), piecewise.Pieces(breakpoints, lifts)


def _freeze(array: Floats) -> Floats:
    array.flags.writeable = False
    return array


_NO_BREAKPOINTS, _NO_COEFFICIENTS = _freeze(np.zeros(1)), _freeze(np.zeros((0, 2)))
