"""Mass properties and support of a body from a mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.errors import InvalidBlock, InvalidOption, install, literal
from rocking.inputs.notes import density_notes, height_notes
from rocking.motion.processing import sine_cosine
from rocking.solid import support as polygons
from rocking.solid.repair import (
    Surface,
    filled,
    is_closed,
    joined,
    moments,
    one_of,
    oriented,
    overlaps,
    together,
)

if TYPE_CHECKING:
    from typing import BinaryIO

    from trimesh import Scene, Trimesh

    #: Path, name of a mesh included in the package, stream with a name, or object of trimesh.
    Mesh = str | PathLike[str] | BinaryIO | Trimesh | Scene

#: Meshes included in the package, by name.
SHIPPED: Final = {"statue": Path(__file__).with_name("data") / "statue.obj"}

#: Units of length, m.
UNITS: Final = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}


class Part(NamedTuple):
    """Part of a mesh: corners, shape (n, 3), and indices of the corners of triangles, shape (m, 3)."""

    name: str
    vertices: Floats
    faces: Integers


class Parts(NamedTuple):
    """All parts of a mesh, the name of the mesh, and its axis that points up."""

    parts: tuple[Part, ...]
    name: str
    up: str


def parts_of(mesh: Mesh, most: int | None = None) -> Parts:
    """Return the parts of a mesh, with unique names and in their order, of ``most`` triangles at most."""
    name, up, path = type(mesh).__name__, "z", ""
    found: list[tuple[str, Any, Any]]
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        found = [("mesh", mesh, np.eye(4))]
    else:
        scene: Any = mesh
        if not hasattr(mesh, "geometry"):
            file: PurePath
            if isinstance(mesh, (str, PathLike)):
                file = SHIPPED.get(str(mesh)) or Path(mesh)
                path, scene = str(mesh), _read(file, str(mesh))
            elif hasattr(mesh, "read") and isinstance(getattr(mesh, "name", None), str):
                file = PurePath(mesh.name)
                path, scene = file.name, _streamed(mesh, file.name)
            else:
                raise InvalidBlock(
                    "{} must be the path of a file, a binary stream that has a name, or a mesh or scene of trimesh, "
                    f"not {checks.shown(mesh)}",
                    "mesh",
                    value=mesh,
                )
            name, up = file.name, "y" if file.suffix.lower() in (".glb", ".gltf") else "z"
        graph, geometry = scene.graph, scene.geometry
        placed = [(str(node), *graph[node]) for node in sorted(graph.nodes_geometry)]
        found = [(node, geometry[shape], transform) for node, transform, shape in placed]
    if most is not None and (count := sum(len(getattr(each, "faces", ())) for _, each, _ in found)) > most:
        raise InvalidBlock(
            f"holds {count} triangles, of which at most {most} are read here: make the mesh coarser", path=path or name
        )
    parts = tuple(_part(node, each, transform) for node, each, transform in found if len(getattr(each, "faces", ())))
    if not parts:
        raise InvalidBlock(
            "holds no faces: a mesh of triangles is needed, not points, lines or other text", path=path or name
        )
    if not all(np.all(np.isfinite(part.vertices)) for part in parts):
        raise InvalidBlock("has corners that are not finite numbers: export the mesh again", path=path or name)
    return Parts(parts, name, up)


def _read(file: Path, named: str) -> Scene:
    if file.is_dir():
        raise InvalidBlock("this is a folder, not a file: name the file in it", path=named)
    if not file.is_file():
        known = f"; the mesh that ships is {', '.join(SHIPPED)}" if not file.suffix else ""
        raise InvalidBlock(f"there is no such file{known}", path=named)
    return _loaded(file, named)


def _streamed(stream: BinaryIO, name: str) -> Scene:
    """Read a stream, but no file or address named in it. An unnamed mesh has the name of the stream."""
    scene = _loaded(stream, name, resolver={})
    if PurePath(name).suffix.lower() in (".ply", ".stl") and len(scene.geometry) == 1:
        (mesh,) = scene.geometry.values()
        scene = type(scene)()
        scene.add_geometry(mesh, node_name=name)
    return scene


def _loaded(source: Path | BinaryIO, named: str, **how: Any) -> Scene:
    """Read a file or stream, and files named in it, with trimesh."""
    try:
        import trimesh
    except ImportError:
        raise InvalidOption(f"meshes are read with trimesh, which is not installed: {install('mesh')}") from None
    suffix = PurePath(source.name).suffix.lower().removeprefix(".")
    # Objects and groups of OBJ files are parts, regardless of material. Corners are unchanged.
    how |= {"split_objects": True, "split_groups": True, "skip_materials": True, "group_material": False}
    try:
        return trimesh.load_scene(source, file_type=suffix, process=False, **how)
    except Exception as error:  # readers of foreign files raise any type
        formats = sorted(trimesh.available_formats())
        said = f"it lacks {error}" if isinstance(error, KeyError) else " ".join(str(error).split())
        reason = f"{said or type(error).__name__}; is it whole, and what its name says?"
        if suffix not in formats:
            reason = f"is of no format that trimesh reads ({', '.join(formats)})"
        raise InvalidBlock(f"cannot be read: {literal(reason)}", path=named) from None


def _part(name: str, mesh: Any, transform: Any) -> Part:
    vertices = np.asarray(mesh.vertices, dtype=np.float64)
    matrix = np.asarray(transform, dtype=np.float64)
    faces = np.asarray(mesh.faces, dtype=np.int64)
    if not np.array_equal(matrix, np.eye(4)):
        vertices = vertices @ matrix[:3, :3].T + matrix[:3, 3]
        if np.linalg.det(matrix[:3, :3]) < 0.0:  # a mirror image reverses the normals
            faces = faces[:, ::-1]
    return Part(name, vertices, faces)


def length_of(unit: object) -> float:
    """Return the length of the unit of a mesh, m, from its name or a number."""
    if isinstance(unit, str):
        return UNITS[checks.one_of(unit, "unit", InvalidBlock, [*UNITS])]
    return checks.positive(unit, "unit", InvalidBlock, "m")


def upright(up: object) -> Floats:
    """Return the smallest rotation, shape (3, 3), of an axis of a mesh to z."""
    if isinstance(up, str):
        axis = checks.one_of(up, "up", InvalidBlock, ["x", "y", "z", "-x", "-y", "-z"])
        u = np.eye(3)["xyz".index(axis[-1])] * (-1.0 if axis[0] == "-" else 1.0)
    else:
        u = checks.numbers(up, "up", InvalidBlock)  # type: ignore[arg-type]
        length = float(np.linalg.norm(u)) if u.shape == (3,) else 0.0
        if not 0.0 < length < np.inf:
            raise InvalidBlock("{} must be x, y or z, or a vector of three numbers that points up", "up", value=up)
        u = u / length
    if u[2] < 0.0 and not u[0] * u[0] + u[1] * u[1] > 0.0:
        return np.diag([1.0, -1.0, -1.0])
    x, y, _ = u
    # Rodrigues' formula for the axis u x z: 1 + V + V^2/(1 + u_z), whose divisor loses digits near -z.
    v = np.array([[0.0, 0.0, -x], [0.0, 0.0, -y], [x, y, 0.0]])
    share = 1.0 / (1.0 + u[2]) if u[2] > 0.0 else (1.0 - u[2]) / (x * x + y * y)
    return np.asarray(np.eye(3) + v + v @ v * share)


class Region(NamedTuple):
    """Part of a body.

    Its fields are name, volume, m^3, and density, kg/m^3; None if the density is not known.

    See Also
    --------
    rocking.Solid : Rigid body in space.
    """

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
    most: int | None = None,
) -> tuple[dict[str, Any], list[Surface]]:
    """Return the arguments of `Solid`, and closed surfaces of its parts with the lowest corner at height 0."""
    if support is not None and tolerance is not None:
        raise InvalidBlock("{} is how a support is looked for: leave it out where {} is given", "tolerance", "support")
    found = parts_of(mesh, most)
    with np.errstate(over="ignore"):
        extent = max(float(np.ptp(part.vertices, axis=0).max()) for part in found.parts) * length_of(unit)
    if extent and not 1e-9 < extent < 1e9:
        raise InvalidBlock(f"is {extent:.3g} m large, which no body is: correct {{}}", "unit", path=found.name)
    sine, cosine = (float(part) for part in sine_cosine(checks.finite(turn, "turn", InvalidBlock)))
    clockwise = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])  # seen from above
    rotation = clockwise @ upright(found.up if up is None else up) * length_of(unit)
    parts = [part._replace(vertices=part.vertices @ rotation.T) for part in found.parts]
    every = np.vstack([part.vertices[np.unique(part.faces)] for part in parts])
    ground = float(every[:, 2].min())
    every[:, 2] -= ground
    height = float(every[:, 2].max())
    names, surfaces = _surfaces(parts, density, found.name)
    densities = _densities(density, names, [part.name for part in parts])
    inside = [moments(surface.vertices, surface.faces) for surface in surfaces]
    for name, surface, each in zip(names, surfaces, inside, strict=True):
        if not each.amount > 1e-9 * float(np.ptp(surface.vertices, axis=0).max()) ** 3:
            what = "" if name == found.name else f"{name} "
            raise InvalidBlock(
                f"{what}encloses no volume: it is a surface without an inside; give it a thickness", path=found.name
            )
    used = [densities[name] for name in names]
    whole = together(inside, [1.0 if each is None else each for each in used])
    within = 1e-3 * height if tolerance is None else checks.positive(tolerance, "tolerance", InvalidBlock, "m")
    if within >= height:
        raise InvalidBlock(
            f"{{}} must be below the height of the mesh, {height:.4g} m, not {within:g}", "tolerance", value=tolerance
        )
    polygon, notes = _support(every, support, within, found.name)
    made = {
        "support": polygon,
        "centre": whole.centre - [0.0, 0.0, ground],
        "inertia_over_mass": whole.inertia_over_amount(),
        "mass": None if density is None else whole.amount,
        "description": found.name,
        "height": height,
        "regions": [Region(*each) for each in zip(names, (each.amount for each in inside), used, strict=True)],
        "repairs": tuple(
            f"{name}: {sentence}" if len(names) > 1 else sentence
            for name, surface in zip(names, surfaces, strict=True)
            for sentence in surface.repairs
        ),
        "notes": (*notes, *overlaps(names, surfaces), *height_notes(height), *density_notes(used)),
    }
    return made, [surface._replace(vertices=surface.vertices - [0.0, 0.0, ground]) for surface in surfaces]


def _densities(
    given: float | Mapping[str, float] | None, names: Sequence[str], every: Sequence[str]
) -> dict[str, float | None]:
    """Return the density of each surface, kg/m^3, by name. Every part of the mesh may have a density."""
    if given is None:
        return dict.fromkeys(names)
    if not isinstance(given, Mapping):
        return dict.fromkeys(names, checks.positive(given, "density", InvalidBlock, "kg/m^3"))
    known = f"its parts are {', '.join(every)}"
    unknown, missing = [name for name in given if name not in every], [name for name in names if name not in given]
    if unknown:
        hint = checks.meant(str(unknown[0]), every, known)
        raise InvalidBlock(
            f"{{}} has a part {checks.shown(unknown[0])}, which the mesh does not have; {hint}", "density"
        )
    if missing:
        raise InvalidBlock(f"{{}} is missing for {', '.join(missing)}; {known}", "density")
    return {name: checks.positive(given[name], "density", InvalidBlock, "kg/m^3") for name in names}


def _surfaces(
    parts: Sequence[Part], density: float | Mapping[str, float] | None, file: str
) -> tuple[list[str], list[Surface]]:
    """Close and name the surfaces of the parts. Open parts of one density are joined first."""
    names = [part.name for part in parts]
    found = [joined(file, part.vertices, part.faces) for part in parts]
    is_open = [not is_closed(surface.faces) for surface in found]
    if not isinstance(density, Mapping) and sum(is_open) > 1:
        some = [part for part, each in zip(parts, is_open, strict=True) if each]
        rest = one_of([Surface(part.vertices, part.faces) for part in some])
        kept = [k for k, each in enumerate(is_open) if not each]
        names = [*(names[k] for k in kept), " + ".join(part.name for part in some)]
        found = [*(found[k] for k in kept), joined(file, rest.vertices, rest.faces)]
    given = density if isinstance(density, Mapping) else {}
    whole = oriented([filled(each) for each in found], [name not in given for name in names])
    left = [k for k, each in enumerate(whole) if len(each.faces)]
    return [names[k] for k in left], [whole[k] for k in left]


def _support(corners: Floats, given: ArrayLike | None, tolerance: float, path: str) -> tuple[Floats, tuple[str, ...]]:
    """Return the support polygon, with notes, of a mesh whose lowest corner is at height zero."""
    if given is not None:
        polygon = polygons.given_polygon(given)
        outline, beyond = polygons.hull(corners[:, :2]), 0.0
        if outline is not None:
            facing, distances = polygons.edges(outline - outline[0])
            beyond = float(np.max((polygon - outline[0]) @ polygons.directions(facing).T - distances))
        if outline is None or beyond > 1e-6 * float(np.ptp(corners, axis=0).max()):
            (west, south, _), (east, north, _) = corners.min(axis=0), corners.max(axis=0)
            raise InvalidBlock(
                f"{{}} reaches {beyond:.3g} m beyond the outline of the mesh, from {west:.4g} m to {east:.4g} m in the "
                f"east and {south:.4g} m to {north:.4g} m in the north; its corners are (east, north) in m, in the "
                "mesh's own coordinates",
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
    if growth <= 0.02:
        return base, ()
    return base, (
        f"the base is not flat or its edges are round: the support would be {100.0 * growth:.2g} % larger with the "
        f"corners up to {10.0 * tolerance:.2g} m above the lowest one instead of {tolerance:.2g} m",
    )
