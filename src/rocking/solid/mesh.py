"""Mass properties and support of a body from a mesh."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.errors import BlockError, OptionError, describe_install, escape_braces
from rocking.inputs.notes import list_density_notes, list_height_notes
from rocking.motion.processing import sine_cosine
from rocking.solid import support as polygons
from rocking.solid.repair import (
    Surface,
    combine_moments,
    combine_surfaces,
    compute_moments,
    describe_overlaps,
    fill_holes,
    is_closed,
    merge_corners,
    orient_surfaces,
)

if TYPE_CHECKING:
    from typing import BinaryIO

    from trimesh import Scene, Trimesh

    #: Path, name of a mesh included in the package, stream with a name, or object of trimesh.
    Mesh = str | PathLike[str] | BinaryIO | Trimesh | Scene

#: Meshes included in the package, by name.
SHIPPED_MESHES: Final = {"statue": Path(__file__).with_name("data") / "statue.obj"}

#: Units of length, m.
LENGTH_UNITS: Final = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}


class MeshPart(NamedTuple):
    """Part of a mesh."""

    name: str  # name in the file
    vertices: Floats  # corners, shape (n, 3)
    faces: Integers  # indices of the corners of each triangle, shape (m, 3)


class MeshParts(NamedTuple):
    """All parts of a mesh."""

    parts: tuple[MeshPart, ...]  # parts with triangles
    name: str  # name of the mesh
    up: str  # axis that points up


def read_parts(mesh: Mesh, max_faces: int | None = None) -> MeshParts:
    """Return the parts of a mesh in their order, with unique names. Too many triangles are an error."""
    scene: Any = mesh
    name = path = type(mesh).__name__
    is_mesh = hasattr(mesh, "vertices") and hasattr(mesh, "faces")
    if isinstance(mesh, (str, PathLike)):
        file = SHIPPED_MESHES.get(str(mesh)) or Path(mesh)
        name, path, scene = file.name, str(mesh), _read_file(file, str(mesh))
    elif not is_mesh and not hasattr(mesh, "geometry"):
        if not (hasattr(mesh, "read") and isinstance(getattr(mesh, "name", None), str)):
            requirement = "the path of a file, a binary stream that has a name, or a mesh or scene of trimesh"
            raise BlockError(f"{{}} must be {requirement}, not {checks.short_repr(mesh)}", "mesh", value=mesh)
        name = path = PurePath(scene.name).name
        scene = _read_stream(scene, name)
    up = "y" if scene is not mesh and PurePath(name).suffix.lower() in (".glb", ".gltf") else "z"
    shapes = [("mesh", scene, np.eye(4))]
    if not is_mesh:
        placements = [(str(node), *scene.graph[node]) for node in sorted(scene.graph.nodes_geometry)]
        shapes = [(node, scene.geometry[key], transform) for node, transform, key in placements]
    shapes = [shape for shape in shapes if len(getattr(shape[1], "faces", ()))]
    if max_faces is not None and (count := sum(len(shape.faces) for _, shape, _ in shapes)) > max_faces:
        raise BlockError(f"contains {count} triangles; use a coarser mesh of at most {max_faces}", path=path)
    if not shapes:
        message = "contains no faces; a mesh of triangles is required, not points, lines or other text"
        raise BlockError(message, path=path)
    parts = tuple(_place_part(*shape) for shape in shapes)
    if not all(np.all(np.isfinite(part.vertices)) for part in parts):
        raise BlockError("has corners that are not finite numbers; export the mesh again", path=path)
    return MeshParts(parts, name, up)


def _read_file(file: Path, path: str) -> Scene:
    if file.is_dir():
        raise BlockError("this is a folder, not a file; choose a file in it", path=path)
    if not file.is_file():
        hint = f"; the mesh that ships is {', '.join(SHIPPED_MESHES)}" if not file.suffix else ""
        raise BlockError(f"there is no such file{hint}", path=path)
    return _load_scene(file, path)


def _read_stream(stream: BinaryIO, name: str) -> Scene:
    """Read a stream, but no file or address named in it. An unnamed mesh has the name of the stream."""
    scene = _load_scene(stream, name, resolver={})
    if PurePath(name).suffix.lower() in (".ply", ".stl") and len(scene.geometry) == 1:
        (mesh,) = scene.geometry.values()
        scene = type(scene)()
        scene.add_geometry(mesh, node_name=name)
    return scene


def _load_scene(source: Path | BinaryIO, path: str, **options: Any) -> Scene:
    """Read a file or stream, and files named in it, with trimesh."""
    try:
        import trimesh
    except ImportError:
        message = f"meshes are read with trimesh, which is not installed: {describe_install('mesh')}"
        raise OptionError(message) from None
    suffix = PurePath(source.name).suffix.lower().removeprefix(".")
    # Objects and groups of OBJ files are parts, regardless of material. Corners are unchanged.
    options |= {"split_objects": True, "split_groups": True, "skip_materials": True, "group_material": False}
    try:
        return trimesh.load_scene(source, file_type=suffix, process=False, **options)
    except Exception as error:  # readers of foreign files raise any type
        formats = sorted(trimesh.available_formats())
        cause = f"{error} is missing" if isinstance(error, KeyError) else " ".join(str(error).split())
        message = f"{cause or type(error).__name__}; check that the file is complete and has the correct suffix"
        if suffix not in formats:
            message = f"trimesh reads only the formats {', '.join(formats)}"
        raise BlockError(f"cannot be read: {escape_braces(message)}", path=path) from None


def _place_part(name: str, mesh: Any, transform: Any) -> MeshPart:
    vertices = np.asarray(mesh.vertices, dtype=np.float64)
    matrix = np.asarray(transform, dtype=np.float64)
    faces = np.asarray(mesh.faces, dtype=np.int64)
    if not np.array_equal(matrix, np.eye(4)):
        vertices = vertices @ matrix[:3, :3].T + matrix[:3, 3]
        if np.linalg.det(matrix[:3, :3]) < 0.0:  # a mirror image reverses the normals
            faces = faces[:, ::-1]
    return MeshPart(name, vertices, faces)


def parse_length_unit(unit: object) -> float:
    """Return the length of the unit of a mesh, m, from its name or a number."""
    if isinstance(unit, str):
        return LENGTH_UNITS[checks.choice(unit, "unit", BlockError, [*LENGTH_UNITS])]
    return checks.positive(unit, "unit", BlockError, "m")


def compute_upright_rotation(up: object) -> Floats:
    """Return the smallest rotation, shape (3, 3), of an axis of a mesh to z."""
    if isinstance(up, str):
        axis = checks.choice(up, "up", BlockError, ["x", "y", "z", "-x", "-y", "-z"])
        u = np.eye(3)["xyz".index(axis[-1])] * (-1.0 if axis[0] == "-" else 1.0)
    else:
        u = checks.numbers(up, "up", BlockError)  # type: ignore[arg-type]
        length = float(np.linalg.norm(u)) if u.shape == (3,) else 0.0
        if not 0.0 < length < np.inf:
            raise BlockError("{} must be x, y or z, or a vector of three numbers that points up", "up", value=up)
        u = u / length
    if u[2] < 0.0 and not u[0] * u[0] + u[1] * u[1] > 0.0:
        return np.diag([1.0, -1.0, -1.0])
    x, y, _ = u
    # Rodrigues' formula for the axis u x z: 1 + V + V^2/(1 + u_z), whose divisor loses digits near -z.
    v = np.array([[0.0, 0.0, -x], [0.0, 0.0, -y], [x, y, 0.0]])
    factor = 1.0 / (1.0 + u[2]) if u[2] > 0.0 else (1.0 - u[2]) / (x * x + y * y)
    return np.asarray(np.eye(3) + v + v @ v * factor)


class Region(NamedTuple):
    """Part of a body.

    Its fields are name, volume, m^3, and density, kg/m^3; None if the density is not known.

    See Also
    --------
    rocking.Solid : Rigid body in space.

    Examples
    --------
    >>> import rocking
    >>> statue = rocking.Solid.from_mesh("statue", density=2650.0)
    >>> [f"{region.name}: {region.volume:.3f} m^3" for region in statue.regions]
    ['figure: 0.123 m^3', 'head: 0.009 m^3', 'plinth: 0.039 m^3']
    """

    name: str
    volume: float
    density: float | None


def compute_properties(
    mesh: Mesh,
    density: float | Mapping[str, float] | None,
    support: ArrayLike | None,
    tolerance: float | None,
    *,
    up: str | ArrayLike | None,
    unit: str | float,
    turn: float,
    max_faces: int | None = None,
) -> tuple[dict[str, Any], list[Surface]]:
    """Return the arguments of `Solid`, and closed surfaces of its parts with the lowest corner at height 0."""
    if support is not None and tolerance is not None:
        raise BlockError("{} is used only to find the support; omit it if {} is given", "tolerance", "support")
    scene = read_parts(mesh, max_faces)
    with np.errstate(over="ignore"):
        extent = max(float(np.ptp(part.vertices, axis=0).max()) for part in scene.parts) * parse_length_unit(unit)
    if extent and not 1e-9 < extent < 1e9:
        message = f"is {extent:.3g} m large, outside the range of bodies; correct {{}}"
        raise BlockError(message, "unit", path=scene.name)
    sine, cosine = (float(part) for part in sine_cosine(checks.finite(turn, "turn", BlockError)))
    clockwise = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])  # seen from above
    rotation = clockwise @ compute_upright_rotation(scene.up if up is None else up) * parse_length_unit(unit)
    parts = [part._replace(vertices=part.vertices @ rotation.T) for part in scene.parts]
    corners = np.vstack([part.vertices[np.unique(part.faces)] for part in parts])
    ground = float(corners[:, 2].min())
    corners[:, 2] -= ground
    height = float(corners[:, 2].max())
    names, surfaces = _close_surfaces(parts, density, scene.name)
    densities = _resolve_densities(density, names, [part.name for part in parts])
    part_moments = [compute_moments(surface.vertices, surface.faces) for surface in surfaces]
    for name, surface, moments in zip(names, surfaces, part_moments, strict=True):
        if not moments.amount > 1e-9 * float(np.ptp(surface.vertices, axis=0).max()) ** 3:
            prefix = "" if name == scene.name else f"{name} "
            message = f"{prefix}encloses no volume: it is a surface without an inside; give it a thickness"
            raise BlockError(message, path=scene.name)
    part_densities = [densities[name] for name in names]
    total = combine_moments(part_moments, [1.0 if value is None else value for value in part_densities])
    max_height = 1e-3 * height if tolerance is None else checks.positive(tolerance, "tolerance", BlockError, "m")
    if max_height >= height:
        message = f"{{}} must be below the height of the mesh, {height:.4g} m, not {max_height:g}"
        raise BlockError(message, "tolerance", value=tolerance)
    polygon, notes = _find_support(corners, support, max_height, scene.name)
    prefixes = [f"{name}: " if len(names) > 1 else "" for name in names]
    repairs = [prefix + repair for prefix, part in zip(prefixes, surfaces, strict=True) for repair in part.repairs]
    volumes = [part.amount for part in part_moments]
    notes = (
        *notes,
        *describe_overlaps(names, surfaces),
        *list_height_notes(height),
        *list_density_notes(part_densities),
    )
    arguments = {
        "support": polygon,
        "centre": total.centre - [0.0, 0.0, ground],
        "inertia_over_mass": total.compute_inertia(),
        "mass": None if density is None else total.amount,
        "description": scene.name,
        "height": height,
        "regions": [Region(*fields) for fields in zip(names, volumes, part_densities, strict=True)],
        "repairs": repairs,
        "notes": notes,
    }
    return arguments, [surface._replace(vertices=surface.vertices - [0.0, 0.0, ground]) for surface in surfaces]


def _resolve_densities(
    density: float | Mapping[str, float] | None, names: Sequence[str], known: Sequence[str]
) -> dict[str, float | None]:
    """Return the density of each surface, kg/m^3, by name. Every part of the mesh may have a density."""
    if density is None:
        return dict.fromkeys(names)
    if not isinstance(density, Mapping):
        return dict.fromkeys(names, checks.positive(density, "density", BlockError, "kg/m^3"))
    parts_text = f"its parts are {', '.join(known)}"
    unknown, missing = [name for name in density if name not in known], [name for name in names if name not in density]
    if unknown:
        hint = checks.suggest(str(unknown[0]), known, parts_text)
        message = f"{{}} has a part {checks.short_repr(unknown[0])}, which the mesh does not have; {hint}"
        raise BlockError(message, "density")
    if missing:
        raise BlockError(f"{{}} is missing for {', '.join(missing)}; {parts_text}", "density")
    return {name: checks.positive(density[name], "density", BlockError, "kg/m^3") for name in names}


def _close_surfaces(
    parts: Sequence[MeshPart], density: float | Mapping[str, float] | None, file: str
) -> tuple[list[str], list[Surface]]:
    """Close and name the surfaces of the parts. Open parts of one density are joined first."""
    names = [part.name for part in parts]
    surfaces = [merge_corners(file, part.vertices, part.faces) for part in parts]
    is_open = [not is_closed(surface.faces) for surface in surfaces]
    if not isinstance(density, Mapping) and sum(is_open) > 1:
        open_parts = [*itertools.compress(parts, is_open)]
        combined = combine_surfaces([Surface(part.vertices, part.faces) for part in open_parts])
        is_complete = [not has_gap for has_gap in is_open]
        names = [*itertools.compress(names, is_complete), " + ".join(part.name for part in open_parts)]
        merged = merge_corners(file, combined.vertices, combined.faces)
        surfaces = [*itertools.compress(surfaces, is_complete), merged]
    densities = density if isinstance(density, Mapping) else {}
    closed = orient_surfaces([fill_holes(surface) for surface in surfaces], [name not in densities for name in names])
    nonempty = [k for k, surface in enumerate(closed) if len(surface.faces)]
    return [names[k] for k in nonempty], [closed[k] for k in nonempty]


def _find_support(
    corners: Floats, support: ArrayLike | None, tolerance: float, path: str
) -> tuple[Floats, tuple[str, ...]]:
    """Return the support polygon, with notes, of a mesh whose lowest corner is at height zero."""
    if support is not None:
        polygon = polygons.check_polygon(support)
        outline, excess = polygons.compute_hull(corners[:, :2]), 0.0
        if outline is not None:
            azimuths, distances = polygons.compute_edges(outline - outline[0])
            excess = float(np.max((polygon - outline[0]) @ polygons.compute_directions(azimuths).T - distances))
        if outline is None or excess > 1e-6 * float(np.ptp(corners, axis=0).max()):
            (west, south, _), (east, north, _) = corners.min(axis=0), corners.max(axis=0)
            span = f"from {west:.4g} m to {east:.4g} m in the east and {south:.4g} m to {north:.4g} m in the north"
            message = f"{{}} reaches {excess:.3g} m beyond the outline of the mesh, {span}"
            hint = "its corners are (east, north) in m, in the mesh's own coordinates"
            raise BlockError(f"{message}; {hint}", "support")
        return polygon, ()
    base = polygons.compute_hull(corners[corners[:, 2] <= tolerance, :2])
    if base is None:
        message = f"stands on a point or a line: the corners within {{}}, {tolerance:.3g} m, of the lowest one span no "
        raise BlockError(f"{message}polygon; give a larger one, or {{}}", "tolerance", "support", path=path)
    wider = polygons.compute_hull(corners[corners[:, 2] <= 10.0 * tolerance, :2])
    assert wider is not None
    growth = polygons.compute_area(wider) / polygons.compute_area(base) - 1.0
    if growth <= 0.02:
        return base, ()
    return base, (
        f"the base is not flat or its edges are round: the support would be {100.0 * growth:.2g} % larger with the "
        f"corners up to {10.0 * tolerance:.2g} m above the lowest one instead of {tolerance:.2g} m",
    )
