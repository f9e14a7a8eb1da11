"""A motion by name: of a record file, or of a shipped record."""

from __future__ import annotations

from pathlib import Path

from rocking.motion import formats, records
from rocking.motion.motion import Motion


def named_motion(
    name: str,
    *,
    channel: str | None = None,
    dt: float | None = None,
    units: str | None = None,
    scale: float = 1.0,
) -> Motion:
    """Motion of a record file, or of a shipped record of that name, times a factor.

    Parameters
    ----------
    name : str
        Path of a file, or name of a shipped record; where both exist, the file.
    channel, dt, units
        As for `rocking.read`.
    scale : float
        Factor on the motion.

    Raises
    ------
    UnreadableRecord
        If there is neither, or the file cannot be read.
    """
    if not Path(name).exists() and name in records.names():
        motion = records.load(name)
    else:
        motion = formats.read(name, channel=channel, dt=dt, units=units)
    return motion if scale == 1.0 else motion.scaled(scale)
