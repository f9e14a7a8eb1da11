"""Meshes from files, streams and trimesh: the parts of each, with a name, corners and triangles."""

from __future__ import annotations

from os import PathLike
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from rocking import checks
from rocking.arrays import Floats, Integers
from rocking.errors import InvalidBlock, InvalidOption, install, literal

if TYPE_CHECKING:
    from typing import BinaryIO

    from trimesh import Scene, Trimesh

    #: A file, the name of the mesh that ships with the package, a stream with a name, or what trimesh has read.
    Mesh = str | PathLike[str] | BinaryIO | Trimesh | Scene

#: The mesh that ships with the package, and its name.
SHIPPED: Final = {"statue": Path(__file__).with_name("data") / "statue.obj"}

#: Formats whose vertical axis is y, by their standard.
_Y_UP: Final = frozenset({".glb", ".gltf"})

#: Formats of one mesh without a name.
_NAMELESS: Final = frozenset({".ply", ".stl"})

#: Lengths of units, m.
UNITS: Final = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}


class Part(NamedTuple):
    """One part of a mesh: its corners, shape (n, 3), and three of them for each triangle, shape (m, 3)."""

    name: str
    vertices: Floats
    faces: Integers


class Parts(NamedTuple):
    """All parts of a mesh, what it is called, and the axis that points up in it."""

    parts: tuple[Part, ...]
    name: str
    up: str


def parts_of(mesh: Mesh, most: int | None = None) -> Parts:
    """Return the parts of a mesh, which share no name, in the order of their names; of so many triangles at most."""
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
            name, up = file.name, "y" if file.suffix.lower() in _Y_UP else "z"
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
    if not file.stat().st_size:
        raise InvalidBlock("this file is empty: export the mesh again", path=named)
    return _loaded(file, named)


class _NothingElse:
    """What a stream may read beside itself: nothing, neither files nor addresses that it names."""

    def __init__(self, file_name: str) -> None:
        self.file_name = file_name

    def __getitem__(self, other: str) -> bytes:
        if other == "model.gltf":  # what trimesh looks for where a text is no JSON
            raise ValueError("it is no JSON")
        raise InvalidBlock(
            f"names another file, {checks.shown(other[:60])}, which is not read: export the mesh as one file",
            path=self.file_name,
        )


def _streamed(stream: BinaryIO, name: str) -> Scene:
    """Read a stream; a mesh that the format gives no name has the stream's, as one that is read from a path."""
    scene = _loaded(stream, name, resolver=_NothingElse(name))
    if PurePath(name).suffix.lower() in _NAMELESS and len(scene.geometry) == 1:
        (mesh,) = scene.geometry.values()
        scene = type(scene)()
        scene.add_geometry(mesh, node_name=name)
    return scene


def _loaded(source: Path | BinaryIO, named: str, **how: Any) -> Scene:
    """Read a file or a stream with trimesh, with all that it names."""
    try:
        import trimesh
    except ImportError:
        raise InvalidOption(f"meshes are read with trimesh, which is not installed: {install('mesh')}") from None
    suffix = PurePath(source.name).suffix.lower().removeprefix(".")
    # Every object and group of an OBJ file is a part, whatever its material; corners stay as they are.
    how |= {"split_objects": True, "split_groups": True, "skip_materials": True, "group_material": False}
    try:
        return trimesh.load_scene(source, file_type=suffix, process=False, **how)
    except InvalidBlock:
        raise
    except Exception as error:  # what a reader of foreign files raises is of any kind
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
        if np.linalg.det(matrix[:3, :3]) < 0.0:  # a mirror image turns the normals round
            faces = faces[:, ::-1]
    return Part(name, vertices, faces)


def length_of(unit: object) -> float:
    """Return the length of the unit that a mesh's coordinates are in, m: by its name, or as a number."""
    if isinstance(unit, str):
        return UNITS[checks.one_of(unit, "unit", InvalidBlock, [*UNITS])]
    return checks.positive(unit, "unit", InvalidBlock, "m")


def upright(up: object) -> Floats:
    """Return the rotation, shape (3, 3), by the shortest way, that turns an axis of a mesh to z.

    The axis is x, y or z, with a minus sign or without, or a vector.
    """
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
    # Rodrigues' formula for the axis u x z: 1 + V + V^2/(1 + u_z), whose divisor loses its digits near -z.
    v = np.array([[0.0, 0.0, -x], [0.0, 0.0, -y], [x, y, 0.0]])
    share = 1.0 / (1.0 + u[2]) if u[2] > 0.0 else (1.0 - u[2]) / (x * x + y * y)
    return np.asarray(np.eye(3) + v + v @ v * share)
