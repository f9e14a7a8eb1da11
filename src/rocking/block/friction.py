"""Friction of free blocks: coefficients, and the sizes that determine slip."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from rocking.block.bodies import Blocks
from rocking.block.body import Bodies
from rocking.block.sides import compute_rigid_bodies
from rocking.core import checks
from rocking.core.arrays import Flags, Floats
from rocking.core.constants import Model
from rocking.errors import OptionError
from rocking.kernels.state import Structs

#: Coefficient of friction, or the pair (static, kinetic).
Friction = float | Sequence[float]

#: Largest relative difference between sizes of a body that follow from its two sides.
_SIZE_TOLERANCE: Final = 1e-6


def resolve_friction(friction: Friction | None) -> tuple[float, float] | None:
    """Return the static and the kinetic coefficient of friction; None if the body never slips.

    Raises
    ------
    OptionError
        If a coefficient is not positive, or the static one is below the kinetic one.
    """
    if friction is None:
        return None
    values = checks.numbers(friction, "friction", OptionError)
    if values.shape not in ((), (2,)) or not np.all(values > 0.0):
        raise OptionError(
            "{} must be a positive number or a pair (static, kinetic) of positive numbers, or omitted for a block that "
            f"never slips, not {checks.short_repr(friction)}",
            "friction",
            value=friction,
        )
    static, kinetic = values.tolist() if values.ndim else 2 * (values.item(),)
    if static < kinetic:
        raise OptionError(
            f"the static {{}} must not be below the kinetic one; got {static:g} and {kinetic:g}: swap them",
            "friction",
            value=friction,
        )
    return None if math.isinf(static) and math.isinf(kinetic) else (static, kinetic)


def add_friction(structs: Structs, bodies: Bodies, model: Model, friction: tuple[float, float]) -> None:
    """Add friction and sizes to structs for kernels.

    Raises
    ------
    OptionError
        If the bodies are not free rigid blocks of known size, the kinetic friction admits a paradox at a pivot, or a
        restitution would gain energy in a slip.
    """
    if not isinstance(bodies, Blocks):
        raise OptionError("{} applies to blocks, not to " + f"{bodies.kind}; omit it", "friction")
    if bodies.terms:
        raise OptionError(
            "{} is not available for blocks with restraints, a lean, one side or a law of restitution; simulate the "
            "free block, or omit it",
            "friction",
        )
    radii, g = _find_radii(bodies), bodies.gravity
    heights = radii * np.cos(bodies.alpha)
    height = 0.5 * (heights[:, :1] + heights[:, 1:])
    is_linear = model == "linear"
    arm = height + np.zeros(2) if is_linear else radii
    base = height * bodies.alpha if is_linear else radii * np.sin(bodies.alpha)
    ratio = arm * bodies.p**2 / g
    inertia = g * arm / bodies.p**2
    gyration_squared = (
        inertia[:, ::-1] - height**2 - base[:, ::-1] ** 2
    )  # of the radius of gyration, by the side entered
    static, kinetic = friction
    _raise_if_any(~((ratio < 1.0) & (gyration_squared > 0.0)), _NEEDS_SIZES)
    centroidal_inertia = (1.0 - ratio) / ratio
    pivot_square = gyration_squared + base[:, ::-1] ** 2
    largest = np.minimum(
        2.0 * np.sqrt(centroidal_inertia * (1.0 + centroidal_inertia)), pivot_square / (height * base[:, ::-1])
    )
    if not (kinetic < largest).all():
        index = int(np.argmin(largest.min(axis=1)))
        raise OptionError(
            f"the kinetic {{}} must be below {largest[index].min():.4g}, beyond which forces at a pivot have no unique "
            f"solution; got {kinetic:g}; use a smaller one, or omit it for a block that never slips",
            "friction",
            value=kinetic,
        )
    gain = (inertia[:, ::-1] * bodies.restitution - height**2) ** 2 - (gyration_squared + base**2) * pivot_square
    _raise_if_any(
        gain > _SIZE_TOLERANCE * pivot_square**2,
        "this restitution would gain energy in a slip, so that {} requires another one; omit the restitution",
    )
    structs["has_friction"], structs["static_friction"], structs["kinetic_friction"] = True, static, kinetic
    structs["arm_over_g"], structs["pivot_distance_over_g"], structs["height_over_g"] = (
        arm / g,
        base / g,
        height[:, 0] / g,
    )
    structs["inertia_ratio"] = ratio / (1.0 - ratio)
    s, c = (bodies.alpha, 1.0) if is_linear else (structs["sine"], structs["cosine"])
    lost = 0.0 if is_linear else ratio * s
    per_push = 1.0 - ratio * c * c + static * lost
    structs["sticking_push"] = (1.0 - _SIZE_TOLERANCE) * (static * (1.0 - lost * s) - ratio * s) / per_push
    structs["sticking_slope"] = 0.0 if is_linear else arm / g * (s + static) / per_push


def check_friction(bodies: Bodies, model: Model, friction: tuple[float, float] | None) -> None:
    """Raise `OptionError` if bodies cannot be simulated with friction; see `add_friction`."""
    if friction is not None:
        add_friction(bodies.create_kernel_structs(model, np.zeros((len(bodies), 2))), bodies, model, friction)


def _raise_if_any(is_invalid: Flags, text: str) -> None:
    if is_invalid.any():
        index = int(np.argwhere(is_invalid)[0][0])
        raise OptionError(text + (f" of block {index}" if len(is_invalid) > 1 else ""), "friction")


def _find_radii(blocks: Blocks) -> Floats:
    """Return the distance of the centre of mass from each pivot, m, shape (n, 2)."""
    if blocks.radii is not None:
        message = "the columns of a frame slip one by one, so that {} is not available; omit it"
        _raise_if_any(np.isnan(blocks.radii), message)
        radii: Floats = blocks.radii
    else:
        radii = 0.75 * blocks.gravity / blocks.p**2
        differs = np.any((blocks.p[:, :1] != blocks.p[:, 1:]) | (blocks.alpha[:, :1] != blocks.alpha[:, 1:]), axis=1)
        if not np.any(differs):
            return radii
        height_over_gravity = np.full(len(blocks), np.inf)
        height_over_gravity[differs] = compute_rigid_bodies(blocks.p[differs], blocks.alpha[differs])[1]
        _raise_if_any(np.isnan(height_over_gravity), _NEEDS_SIZES)
        radii[differs] = blocks.gravity * height_over_gravity[differs, None] / np.cos(blocks.alpha[differs])
    heights = radii * np.cos(blocks.alpha)
    squares = blocks.gravity * radii / blocks.p**2 - radii**2
    for sizes in (heights, squares):
        _raise_if_any(np.abs(sizes[:, 0] - sizes[:, 1]) > _SIZE_TOLERANCE * np.abs(sizes[:, 0]), _NEEDS_SIZES)
    return radii


_NEEDS_SIZES: Final = (
    "{} requires the sizes of a rigid body, and none has the p and alpha of both sides; create the block with "
    "Block.from_pivots"
)
