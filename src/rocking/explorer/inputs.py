"""Conversion of a case from texts and back.

The texts come from the page's address and have the names and the format of the command line's options
(``alpha=12deg``, ``pga=0.5g``), so that addresses are readable.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from rocking.block import Block
from rocking.core.constants import STANDARD_GRAVITY, Model
from rocking.engine.schemes import ChatteringScheme, chattering_scheme
from rocking.errors import MotionError, OptionError
from rocking.explorer.meshes import MeshBody
from rocking.explorer.motions import read_motion_values
from rocking.explorer.parameters import (
    BLOCK_NAMES,
    MESH_OPTIONS,
    PARAMETERS,
    SHAPES,
    Texts,
    Values,
    read_texts,
)
from rocking.explorer.uploads import UploadStore
from rocking.inputs.bodies import create_block, find_description, write_block_call
from rocking.inputs.texts import format_arguments
from rocking.motion.motion import Motion
from rocking.motion.piecewise import MAX_ACCELERATION, TOO_STRONG
from rocking.response import Response
from rocking.simulation.simulate import simulate
from rocking.solid.solid import compute_plane

#: Maximum product of both restitutions for which a page waits until the block rests.
_MAX_RESTITUTION_PRODUCT: Final = 0.998

#: Shortest duration, s; below it rounding errors dominate.
_MIN_DURATION: Final = 1e-12


#: Arguments of `rocking.simulate` besides block and motion.
_OPTION_NAMES: Final = ("model", "chattering", "duration", "initial_rotation", "initial_velocity", "friction")


@dataclass(frozen=True, eq=False)
class Case:
    """Arguments of `rocking.simulate`, with equivalent Python code and words of a command."""

    texts: Texts  # from which the case was read
    options: dict[str, Any]  # arguments besides block and motion
    block: Block
    block_expression: str  # Python expression
    block_options: Texts  # of the command
    body: MeshBody | None  # of a mesh
    motion: Motion | None
    motion_expression: str  # Python expression
    words: tuple[str, ...]  # of the command; empty if the motion has no name
    motion_preamble: str  # line of Python before the motion, or empty

    @property
    def model(self) -> Model:
        """Equation of motion."""
        model: Model = self.options.get("model", "nonlinear")
        return model

    @property
    def chattering(self) -> ChatteringScheme:
        """Scheme that ends chattering."""
        return chattering_scheme(self.options.get("chattering", "certified"))

    @property
    def azimuth(self) -> float:
        """Azimuth of the plane of a body, degrees."""
        return float(PARAMETERS["azimuth"].read(self.texts.get("azimuth", "0")))

    def simulate(self, **options: Any) -> Response:
        """Return the response, perhaps with other options."""
        return simulate(self.block, self.motion, **self.options | options)


def read_case(texts: Texts, uploads: UploadStore) -> Case:
    """Read a case from texts named as in `PARAMETERS`, with the command line's defaults.

    ``motion`` is the name of a shipped record, a pulse (``sine:amplitude=0.3g,frequency=1,cycles=2.5``), ``file:KEY``,
    ``given:KEY`` or ``none``. ``vertical`` is the name of a shipped record, ``file:KEY``, ``file:KEY#CHANNEL``, or a
    channel of the motion's own file. ``mesh`` is the name of a shipped mesh, or ``file:KEY``.

    Examples
    --------
    >>> texts = {"width": "0.24", "height": "1.1", "motion": "ridgecrest-clc-090", "pga": "0.4g"}
    >>> case = read_case(texts, UploadStore())
    >>> case.block, round(case.motion.pga, 6)
    (<Block: rectangular block, 0.24 m x 1.1 m; p = 3.6146 rad/s, alpha = 0.21482 rad, restitution = 0.93184>, 3.92266)
    """
    case_texts, values = read_texts(texts)
    block, motion = _read_block(case_texts, values, uploads), read_motion_values(case_texts, values, uploads)
    if "duration" not in values:
        require_rest(side.restitution for side in block.block.sides)
    elif values["duration"] < _MIN_DURATION:
        raise OptionError(f"{{}} must be {_MIN_DURATION:g} s or more here", "duration", value=values["duration"])
    zeros = {name for name in values if name.startswith("initial") and values[name] == 0.0}
    options: dict[str, Any] = {name: values[name] for name in _OPTION_NAMES if name in values and name not in zeros}
    chattering_scheme(options.get("chattering", "certified"))  # raises for an unknown scheme
    return Case(case_texts, options, *block, *motion)


def reject_friction(case: Case) -> None:
    """Raise `OptionError` if a case has friction, which maps, diagrams and assessments do not support."""
    if "friction" in case.options:
        raise OptionError("{} is simulated for the response alone; leave it empty here", "friction")


def require_rest(restitutions: Iterable[float]) -> None:
    """Raise `OptionError` unless a block with these restitutions comes to rest within an acceptable time."""
    if math.prod(restitutions) > _MAX_RESTITUTION_PRODUCT:
        raise OptionError(
            f"the product of {{}} on both sides is above {_MAX_RESTITUTION_PRODUCT:g}, so that the block hardly comes "
            "to rest: lower it, or simulate it in Python",
            "restitution",
        )


def check_peak_acceleration(peak: float) -> None:
    """Reject a peak acceleration, m/s^2, that no motion can have, before the motions are created."""
    if peak > MAX_ACCELERATION:
        raise MotionError(TOO_STRONG)


def block_to_texts(block: Block) -> dict[str, str]:
    """Return the sizes of a rectangular block, else the parameters of both sides."""
    pairs = {name: [getattr(side, name) for side in block.sides] for name in ("p", "alpha", "restitution")}
    texts = {name: ",".join(map(repr, dict.fromkeys(pair))) for name, pair in pairs.items()}
    if block.gravity != STANDARD_GRAVITY:
        texts["gravity"] = repr(block.gravity)
    if block.width is None or block.height is None:
        return texts
    del texts["p"], texts["alpha"]
    sizes = {"width": block.width, "height": block.height} | ({"offset": block.offset} if block.offset else {})
    default_block = Block(width=block.width, height=block.height, offset=block.offset, gravity=block.gravity)
    if block.sides == default_block.sides:
        del texts["restitution"]
    return {name: repr(size) for name, size in sizes.items()} | texts


class _WrittenBlock(NamedTuple):
    """Block with equivalent Python code and options of a command."""

    block: Block
    expression: str  # Python
    options: Texts
    body: MeshBody | None = None  # of a mesh


def _read_block(texts: Texts, values: Values, uploads: UploadStore) -> _WrittenBlock:
    """Create the block of a case."""
    if find_description(values, SHAPES).name == "mesh":
        return _read_mesh_block(texts, values, uploads)
    block_values = {name: values[name] for name in (*BLOCK_NAMES, "gravity") if name in values}
    options = {name: texts[name] for name in BLOCK_NAMES if name in texts}
    return _WrittenBlock(create_block(block_values), write_block_call(block_values), options)


def _read_mesh_block(texts: Texts, values: Values, uploads: UploadStore) -> _WrittenBlock:
    """Create the block of a mesh in the plane of an azimuth."""
    body = uploads.read_body(texts["mesh"], **{name: texts[name] for name in MESH_OPTIONS if name in texts})
    plane = compute_plane(body.solid, values["azimuth"])
    distances = ",".join(map(repr, plane.pivots.distance.tolist()))
    options = {"pivots": distances, "height_of_mass": repr(plane.height), "gyration": repr(plane.gyration)}
    restitution = {name: values[name] for name in ("restitution",) if name in values}
    options |= {name: texts[name] for name in restitution}
    written_arguments = ", ".join(filter(None, (repr(values["azimuth"]), format_arguments(restitution))))
    expression = f"{body.expression}.block({written_arguments})"
    return _WrittenBlock(body.solid.block(values["azimuth"], **restitution), expression, options, body)
