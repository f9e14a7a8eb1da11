"""Conversion of a case from texts and back.

The texts come from the page's address and have the names and the format of the command line's options
(``alpha=12deg``, ``pga=0.5g``), so that addresses are readable.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, NamedTuple

from rocking.block import Block, one_block
from rocking.core.constants import STANDARD_GRAVITY, Model
from rocking.engine.schemes import ChatteringScheme, chattering_scheme
from rocking.errors import InvalidBlock, InvalidMotion, InvalidOption
from rocking.explorer.meshes import Body, pivots_of
from rocking.explorer.motions import motion_of, texts_of_motion
from rocking.explorer.parameters import BLOCK_NAMES, NAMES, PARAMETERS, SHAPES, Texts, Values, given_texts
from rocking.explorer.uploads import UploadStore
from rocking.inputs.bodies import block_of, call_of
from rocking.motion.motion import Motion
from rocking.motion.piecewise import MAX_ACCELERATION, TOO_STRONG
from rocking.response import Response
from rocking.simulation.simulate import simulate

#: Maximum product of both restitutions for which a page waits until the block rests.
_LIVELIEST: Final = 0.998

#: Shortest duration, s; below it rounding errors dominate.
_SHORTEST: Final = 1e-12


@dataclass(frozen=True, eq=False)
class Case:
    """Arguments of `rocking.simulate`, with the texts from which they were read.

    ``block_call`` and ``motion_call`` (after the line ``motion_before``, if any) are Python expressions.
    ``block_options`` and ``words`` belong to the command line, and are None if the motion has no name. The block of a
    mesh has a ``body`` and an ``azimuth``, degrees, of its plane.
    """

    texts: Texts
    block: Block
    motion: Motion | None
    model: Model
    chattering: ChatteringScheme
    duration: float | None
    initial_rotation: float
    initial_velocity: float
    block_call: str
    block_options: Texts
    body: Body | None
    azimuth: float
    motion_call: str
    motion_before: str
    words: tuple[str, ...]

    def simulate(self) -> Response:
        """Return the response."""
        return simulate(
            self.block,
            self.motion,
            model=self.model,
            chattering=self.chattering,
            duration=self.duration,
            initial_rotation=self.initial_rotation,
            initial_velocity=self.initial_velocity,
        )


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
    given = given_texts(texts)
    values = {name: PARAMETERS[name].read(text) for name, text in given.items()}
    found_block = _block(given, values, uploads)
    block = found_block.block
    found = motion_of(given, values, uploads)
    if "duration" not in values:
        require_rest(side.restitution for side in block.sides)
    elif values["duration"] < _SHORTEST:
        raise InvalidOption(f"{{}} must be {_SHORTEST:g} s or more here", "duration", value=values["duration"])
    return Case(
        texts=given,
        block=block,
        motion=found.motion,
        model=values.get("model", "nonlinear"),
        chattering=chattering_scheme(values.get("chattering", "certified")),
        duration=values.get("duration"),
        initial_rotation=values.get("initial_rotation", 0.0),
        initial_velocity=values.get("initial_velocity", 0.0),
        block_call=found_block.python,
        block_options=found_block.options,
        body=found_block.body,
        azimuth=values.get("azimuth", 0.0),
        motion_call=found.python,
        motion_before=found.before,
        words=found.words,
    )


def require_rest(restitutions: Iterable[float]) -> None:
    """Raise `InvalidOption` unless a block with these restitutions comes to rest within an acceptable time."""
    if math.prod(restitutions) > _LIVELIEST:
        raise InvalidOption(
            f"the product of {{}} on both sides is above {_LIVELIEST:g}, so that the block hardly comes to rest: lower "
            "it, or simulate it in Python",
            "restitution",
        )


def require_possible(peak: float) -> None:
    """Reject a peak acceleration, m/s^2, that no motion can have, before the motions are created."""
    if peak > MAX_ACCELERATION:
        raise InvalidMotion(TOO_STRONG)


def texts_of(response: Response, uploads: UploadStore) -> dict[str, str]:
    """Write a response as the texts of its case; the store keeps a motion that no text can name."""
    block, motion = one_block(response.block), response.motion
    texts = _texts_of_block(block)
    texts |= {"motion": "none"} if motion is None else texts_of_motion(motion, uploads)
    if response.model != "nonlinear":
        texts["model"] = response.model
    if str(response.chattering) != str(chattering_scheme("certified")):
        texts["chattering"] = str(response.chattering)
    rules = response.solution.trail.settings
    if not rules["no_end_time"]:
        texts["duration"] = repr(float(rules["stop"]))
    rotation, velocity = float(response.rotation(0.0)), float(response.angular_velocity(0.0))
    if rotation or velocity:
        texts |= {"initial_rotation": repr(rotation), "initial_velocity": repr(velocity)}
    return texts


def _texts_of_block(block: Block) -> dict[str, str]:
    """Return the sizes of a rectangular block, else the parameters of both sides."""
    pairs = {name: [getattr(side, name) for side in block.sides] for name in ("p", "alpha", "restitution")}
    texts = {name: ",".join(repr(value) for value in pair) for name, pair in pairs.items()}
    if block.gravity != STANDARD_GRAVITY:
        texts["gravity"] = repr(block.gravity)
    if block.width is None or block.height is None:
        return texts
    del texts["p"], texts["alpha"]
    sizes = {"width": block.width, "height": block.height} | ({"offset": block.offset} if block.offset else {})
    same = Block(width=block.width, height=block.height, offset=block.offset, gravity=block.gravity)
    if block.sides == same.sides:
        del texts["restitution"]
    return {name: repr(size) for name, size in sizes.items()} | texts


class _FoundBlock(NamedTuple):
    """Block, its Python expression, its command-line options, and its body."""

    block: Block
    python: str
    options: Texts
    body: Body | None = None


def _block(given: Texts, values: Values, uploads: UploadStore) -> _FoundBlock:
    """Create the block."""
    chosen = values.keys() & BLOCK_NAMES - {"restitution"}
    shape = next((each for each in SHAPES if {*each.needed} <= chosen <= {*each.needed, *each.optional}), None)
    if shape is None:
        raise InvalidBlock(
            "a block has either {} and {} (m) and perhaps {}, or {} (rad/s) and {}, or {}, {} and {} (m), or {} and "
            "{} (degrees)",
            *(name for each in SHAPES[:-1] for name in (*each.needed, *each.optional)),
            *SHAPES[-1].needed,
        )
    if shape.name == "mesh":
        return _of_mesh(given, values, uploads)
    described = {name: values[name] for name in NAMES if name in BLOCK_NAMES or name == "gravity" if name in values}
    options = {name: given[name] for name in described if name != "gravity"}
    return _FoundBlock(block_of(described), call_of(described), options)


def _of_mesh(given: Texts, values: Values, uploads: UploadStore) -> _FoundBlock:
    """Create the block of a mesh in the plane of an azimuth."""
    body = uploads.body(given["mesh"], given, values.get("tolerance"), values.get("gravity"))
    azimuth, restitution = values["azimuth"], values.get("restitution")
    block = body.solid.block(azimuth, restitution=restitution)
    distances, height, gyration = pivots_of(body, azimuth)
    options = {"pivots": ",".join(map(repr, distances)), "height_of_mass": repr(height), "gyration": repr(gyration)}
    if restitution is not None:
        options["restitution"] = given["restitution"]
    python = f"{body.call}.block({azimuth!r}" + ("" if restitution is None else f", restitution={restitution!r}") + ")"
    return _FoundBlock(block, python, options, body)
