"""Motions as arguments: anything else is refused, with how it becomes a motion."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rocking.errors import InvalidMotion, InvalidOption
from rocking.motion import records
from rocking.motion.motion import Motion

#: One motion, several, or several by names that replace their own.
Motions = Motion | Mapping[str, Motion] | Sequence[Motion]


def one_motion(motion: Motion | None) -> Motion | None:
    """Return the motion (None is free rocking).

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


def several_motions(motions: Motions) -> list[Motion]:
    """Return one motion or several as a list; those of a mapping under its names.

    Examples
    --------
    >>> from rocking import pulses
    >>> [motion.name for motion in several_motions({"weak": pulses.one_sine(1.0, 2.0)})]
    ['weak']
    """
    if isinstance(motions, Motion):
        return [motions]
    if isinstance(motions, (str, Path, np.ndarray)) or not isinstance(motions, Iterable):
        raise InvalidMotion(_refusal(motions))
    gathered = list(motions.values() if isinstance(motions, Mapping) else motions)
    if not gathered:
        raise InvalidOption("{} must hold at least one motion", "motions")
    for motion in gathered:
        if not isinstance(motion, Motion):
            whole = isinstance(motion, (int, float, np.number)) and not isinstance(motion, bool)
            raise InvalidMotion(_refusal(motions if whole else motion))
    if isinstance(motions, Mapping):
        return [replace(motion, name=name) for name, motion in motions.items()]
    return gathered


def motions_by_name(motions: Motions) -> dict[str, Motion]:
    """Return one motion or several by the names of a mapping, or else by their own."""
    several = several_motions(motions)
    if isinstance(motions, Mapping):
        return dict(motions)
    return dict(zip(names_of(several), several, strict=True))


def names_of(motions: Sequence[Motion]) -> list[str]:
    """Names of motions, numbered where several share one: a row of a table must say which it is."""
    shared = {name for name, count in Counter(motion.name for motion in motions).items() if count > 1}
    seen: Counter[str] = Counter()
    names = []
    for motion in motions:
        seen[motion.name] += 1
        names.append(f"{motion.name} #{seen[motion.name]}" if motion.name in shared else motion.name)
    return names


def _refusal(given: Any) -> str:
    if isinstance(given, (str, Path)):
        how = "rocking.records.load" if str(given) in records.names() else "rocking.read"
        return f'a Motion is needed, not {str(given)!r}: load it with {how}("{given}")'
    made = "make one with Motion.from_samples(array, dt), in m/s^2 and s"
    if given is None:
        return f"a Motion is needed, not None: {made}"
    return f"a Motion is needed, not a {type(given).__name__}: {made}"
