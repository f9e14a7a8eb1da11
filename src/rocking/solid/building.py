"""From a mesh to the mass properties and the support of a body, with all that was assumed on the way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.arrays import Floats
from rocking.errors import InvalidBlock
from rocking.motion.directions import sine_cosine
from rocking.plausibility import height_notes
from rocking.solid import support as polygons
from rocking.solid.moments import moments, together
from rocking.solid.reading import length_of, parts_of, upright
from rocking.solid.repair import Surface, agreeing, closed, is_closed, joined

if TYPE_CHECKING:
    from rocking.solid.reading import Mesh, Part

#: Corners within this part of the height above the lowest one are where a body stands, unless it is said.
_TOLERANCE: Final = 1e-3
#: A support that grows by more than this with ten times the tolerance is worth a note.
_GROWS: Final = 0.02
#: Between the names of parts that were joined.
_AND: Final = " + "
#: Volumes below this part of the cube of the size are none, and supports may be this part of the size beyond the mesh.
_FLAT: Final = 1e-9
_BEYOND: Final = 1e-6


class Region(NamedTuple):
    """A part of a body: its name, its volume, m^3, and its density, kg/m^3; None where it is not known."""

    name: str
    volume: float
    density: float | None


def properties(
    mesh: Mesh,
    density: float | Mapping[str, float] | None,
    support: ArrayLike | None,
    tolerance: float | None,
    *,
    up: str | ArrayLike | None,
    unit: str | float,
    turn: float,
) -> dict[str, Any]:
    """Return what `Solid` is made from, by name; the arguments are those of `Solid.from_mesh`."""
    found = parts_of(mesh)
    rotation = _turned(turn) @ upright(found.up if up is None else up) * length_of(unit)
    parts = [part._replace(vertices=part.vertices @ rotation.T) for part in found.parts]
    densities = _densities(density, [part.name for part in parts])
    every = np.vstack([part.vertices[np.unique(part.faces)] for part in parts])
    ground = float(every[:, 2].min())
    every[:, 2] -= ground
    height, size = float(every[:, 2].max()), float(np.ptp(every, axis=0).max())
    names, surfaces = _surfaces(parts, not isinstance(density, Mapping))
    inside = [moments(surface.vertices, surface.faces) for surface in surfaces]
    for name, each in zip(names, inside, strict=True):
        if not each.amount > _FLAT * size**3:
            raise InvalidBlock(f"{name} encloses no volume: it is a surface without an inside", path=found.name)
    used = [densities[name.partition(_AND)[0]] for name in names]  # joined parts are of one density
    whole = together(inside, [1.0 if each is None else each for each in used])
    within = _TOLERANCE * height if tolerance is None else checks.positive(tolerance, "tolerance", InvalidBlock, "m")
    polygon, notes = _support(every, support, within, found.name)
    return {
        "support": polygon,
        "centre": whole.centre - [0.0, 0.0, ground],
        "inertia_over_mass": whole.inertia_over_amount(),
        "mass": None if density is None else whole.amount,
        "description": found.name,
        "height": height,
        "regions": [Region(*each) for each in zip(names, (each.amount for each in inside), used, strict=True)],
        "repairs": _all_repairs(names, surfaces),
        "notes": (*notes, *height_notes(height)),
    }


def _turned(turn: object) -> Floats:
    """Rotation about the vertical, clockwise seen from above, by degrees; shape (3, 3)."""
    sine, cosine = (float(part) for part in sine_cosine(checks.finite(turn, "turn", InvalidBlock)))
    return np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def _densities(given: float | Mapping[str, float] | None, names: Sequence[str]) -> dict[str, float | None]:
    """Density of each part, kg/m^3."""
    if given is None:
        return dict.fromkeys(names)
    if not isinstance(given, Mapping):
        return dict.fromkeys(names, checks.positive(given, "density", InvalidBlock, "kg/m^3"))
    known = f"its parts are {', '.join(names)}"
    unknown, missing = [name for name in given if name not in names], [name for name in names if name not in given]
    if unknown:
        hint = checks.meant(str(unknown[0]), names, known)
        raise InvalidBlock(
            f"{{}} has a part {checks.shown(unknown[0])}, which the mesh does not have; {hint}", "density"
        )
    if missing:
        raise InvalidBlock(f"{{}} is missing for {', '.join(missing)}; {known}", "density")
    return {name: checks.positive(given[name], "density", InvalidBlock, "kg/m^3") for name in names}


def _surfaces(parts: Sequence[Part], uniform: bool) -> tuple[list[str], list[Surface]]:
    """Close the surfaces of the parts, and name them; open ones of one density are joined before."""
    names = [part.name for part in parts]
    found = [agreeing(joined(part.vertices, part.faces)) for part in parts]
    is_open = [not is_closed(surface.faces) for surface in found]
    if uniform and sum(is_open) > 1:
        some = [part for part, each in zip(parts, is_open, strict=True) if each]
        starts = np.cumsum([0, *(len(part.vertices) for part in some)])
        faces = np.vstack([part.faces + start for part, start in zip(some, starts[:-1], strict=True)])
        whole = agreeing(joined(np.vstack([part.vertices for part in some]), faces))
        kept = [k for k, each in enumerate(is_open) if not each]
        names = [*(names[k] for k in kept), _AND.join(part.name for part in some)]
        found = [*(found[k] for k in kept), whole]
    return names, [closed(surface) for surface in found]


def _all_repairs(names: Sequence[str], surfaces: Sequence[Surface]) -> tuple[str, ...]:
    """All that was repaired, each with the part if there are several."""
    several = len(names) > 1
    return tuple(
        f"{name}: {sentence}" if several else sentence
        for name, surface in zip(names, surfaces, strict=True)
        for sentence in surface.repairs
    )


def _support(corners: Floats, given: ArrayLike | None, tolerance: float, path: str) -> tuple[Floats, tuple[str, ...]]:
    """Support polygon, and notes on it, of a mesh whose lowest corner is at height zero."""
    outline = polygons.hull(corners[:, :2])
    if given is not None:
        polygon = polygons.given_polygon(given)
        beyond = 0.0 if outline is None else _outside(outline, polygon)
        if outline is None or beyond > _BEYOND * float(np.ptp(corners, axis=0).max()):
            raise InvalidBlock(
                f"{{}} reaches {beyond:.3g} m beyond the outline of the mesh, from {_ends(corners)}; its corners are "
                "(east, north) in m, in the mesh's own coordinates",
                "support",
            )
        return polygon, ()
    base = polygons.hull(corners[corners[:, 2] <= tolerance, :2])
    if base is None:
        raise InvalidBlock(
            f"stands on a point or a line: the corners within {{}}, {tolerance:.3g} m, of the lowest one span no "
            "polygon; give a larger one, or {}",
            "tolerance",
            "support",
            path=path,
        )
    wider = polygons.hull(corners[corners[:, 2] <= 10.0 * tolerance, :2])
    assert wider is not None
    growth = polygons.area(wider) / polygons.area(base) - 1.0
    if growth <= _GROWS:
        return base, ()
    return base, (
        f"the base is not flat or its edges are round: the support would be {100.0 * growth:.2g} % larger with the "
        f"corners up to {10.0 * tolerance:.2g} m above the lowest one instead of {tolerance:.2g} m",
    )


def _outside(outline: Floats, polygon: Floats) -> float:
    """How far a polygon reaches beyond a convex one, m."""
    facing, distances = polygons.edges(outline - outline[0])
    return float(np.max((polygon - outline[0]) @ polygons.directions(facing).T - distances))


def _ends(corners: Floats) -> str:
    (west, south, _), (east, north, _) = corners.min(axis=0), corners.max(axis=0)
    return f"{west:.4g} m to {east:.4g} m in the east and {south:.4g} m to {north:.4g} m in the north"
