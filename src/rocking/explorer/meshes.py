"""Bodies of meshes: cached reading, drawings and descriptions, independent of the web."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, BinaryIO, Final

import numpy as np

from rocking.core.arrays import Floats
from rocking.core.constants import STANDARD_GRAVITY
from rocking.explorer.payload import Payload
from rocking.solid import ResistanceRose, Solid
from rocking.solid.mesh import compute_properties
from rocking.solid.solid import compute_plane
from rocking.solid.support import Sections, compute_directions, compute_sections

#: Maximum number of triangles of a mesh; about six seconds of work.
MAX_TRIANGLES: Final = 500_000

#: Lock while a mesh is read, because this needs much memory.
_read_lock = threading.Lock()

#: Azimuths of the rose, degrees.
_AZIMUTHS: Final = np.arange(0.0, 360.0, 2.0)


@dataclass(frozen=True, eq=False)
class MeshBody:
    """Body of a mesh, with its sections, and the Python expression that creates it."""

    solid: Solid
    sections: Sections
    expression: str

    @cached_property
    def rose(self) -> ResistanceRose:
        """Resistance of the body in every direction."""
        return self.solid.rose(_AZIMUTHS)

    def find_outline(self, azimuth: float) -> Floats:
        """Return its outline seen along the axis perpendicular to an azimuth, from its centre of mass; shape (n, 6)."""
        outline = self.sections.compute_outline(azimuth)
        outline[:, 2:] -= float(self.solid.centre[:2] @ np.asarray(compute_directions(azimuth)[0]))
        return outline

    def describe_plane(self, azimuth: float) -> dict[str, Any]:
        """Describe the section in the plane of an azimuth: the rocking edges, m from its centre of mass."""
        plane = compute_plane(self.solid, azimuth)
        distance, low, high = (np.asarray(pivot_values).tolist() for pivot_values in plane.pivots)
        return {
            "name": self.solid.description,
            "azimuth": plane.azimuth,
            "edges": [list(edge) for edge in zip(distance, low, high, strict=True)],
        }


def describe_body(body: MeshBody) -> Payload:
    """Return plan, rose and summary of a body for the page; m from its centre of mass."""
    solid, rose = body.solid, body.rose
    pieces = body.sections.hulls[:: -(-len(body.sections.hulls) // 40)]
    corners = np.vstack(pieces) - solid.centre[:2]
    support = solid.support - solid.centre[:2]
    header = {
        "summary": solid.summary().splitlines(),
        "weakest_azimuth": rose.data.weakest_azimuth,
        "weakest": rose.data.weakest_acceleration,
        "gravity_g": solid.gravity / STANDARD_GRAVITY,
        "height_of_mass": float(solid.centre[2]),
    }
    arrays = {
        "azimuth": _AZIMUTHS,
        "acceleration": rose.data.acceleration.values,
        "support": support.ravel(),
        "plan": corners.ravel(),
        "piece": np.cumsum([len(piece) for piece in pieces], dtype=float),
    }
    return Payload(header, arrays)


def read_body(name: str, stream: BinaryIO | None, arguments: Mapping[str, Any]) -> MeshBody:
    """Read a mesh, one at a time."""
    options = {"density": None, "support": None, "tolerance": None, "up": None, "unit": "m", "turn": 0.0, **arguments}
    gravity = options.pop("gravity", STANDARD_GRAVITY)
    with _read_lock:
        parts, surfaces = compute_properties(stream or name, **options, max_faces=MAX_TRIANGLES)
        sections = compute_sections(surfaces)
    written = "".join(f", {argument}={value!r}" for argument, value in arguments.items())
    file = stream.name if stream else name
    return MeshBody(Solid(gravity=gravity, **parts), sections, f"Solid.from_mesh({file!r}{written})")
