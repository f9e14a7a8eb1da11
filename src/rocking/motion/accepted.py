"""Motions as the package's functions take them: anything else is refused, and told how it becomes a motion."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from rocking.errors import InvalidMotion, InvalidOption
from rocking.motion import records
from rocking.motion.motion import Motion


def one_motion(motion: Motion | None) -> Motion | None:
    """Return the motion (None is free rocking).

    Raises
    ------
    InvalidMotion
        If it is anything else.

    Examples
    --------
    >>> one_motion("RSN6.AT2")
    Traceback (most recent call last):
        ...
    rocking.errors.InvalidMotion: a Motion is needed, not 'RSN6.AT2': load it with rocking.read("RSN6.AT2")
    """
    if motion is not None and not isinstance(motion, Motion):
        raise InvalidMotion(_refusal(motion))
    return motion


def several_motions(motions: Motion | Iterable[Motion]) -> list[Motion]:
    """Return one motion or several as a list.

    Raises
    ------
    InvalidOption
        If there is none.
    InvalidMotion
        If one of them is anything else.
    """
    if isinstance(motions, Motion):
        return [motions]
    if isinstance(motions, (str, Path, np.ndarray)) or not isinstance(motions, Iterable):
        raise InvalidMotion(_refusal(motions))
    gathered = list(motions)
    if not gathered:
        raise InvalidOption("motions must hold at least one motion")
    for motion in gathered:
        if not isinstance(motion, Motion):
            whole = isinstance(motion, (int, float, np.number)) and not isinstance(motion, bool)
            raise InvalidMotion(_refusal(motions if whole else motion))
    return gathered


def _refusal(given: Any) -> str:
    if isinstance(given, (str, Path)):
        how = "rocking.records.load" if str(given) in records.names() else "rocking.read"
        return f'a Motion is needed, not {str(given)!r}: load it with {how}("{given}")'
    made = "make one with Motion.from_samples(array, dt), in m/s^2 and s"
    if given is None:
        return f"a Motion is needed, not None: {made}"
    return f"a Motion is needed, not a {type(given).__name__}: {made}"
