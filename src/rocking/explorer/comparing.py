"""Two responses beside each other: which moments are laid over each other, and both as one table. It knows no web."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Final

from rocking import checks
from rocking.errors import InvalidOption
from rocking.motion.measures import significant_span
from rocking.response import Response
from rocking.tables import named


def _begun(response: Response) -> float:
    motion = response.motion
    found = math.nan if motion is None else significant_span(motion, start=0.05)[0]
    return 0.0 if math.isnan(found) else found


def _lifted(response: Response) -> float:
    times = response.events["time"][response.events["kind"] == "uplift"]
    return float(times[0]) if len(times) else 0.0


#: Moments, s, that are laid over each other; 0 where a response has no such one.
ALIGNED: Final[Mapping[str, Callable[[Response], float]]] = {
    "start": lambda _: 0.0,
    "uplift": _lifted,
    "arias": _begun,
}


def shift_of(first: Response, second: Response, align: str) -> float:
    """Return by how much later, s, the second is drawn than it happens, for the chosen moments to coincide.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.24, height=1.1)
    >>> first, second = (rocking.simulate(block, rocking.pulses.sine(3.0, f, cycles=2)) for f in (1.0, 2.0))
    >>> f"{shift_of(first, second, 'uplift'):.4f}"
    '0.0632'
    """
    moment = ALIGNED[checks.one_of(align, "align", InvalidOption, list(ALIGNED))]
    return moment(first) - moment(second)


def as_csv(responses: Mapping[str, Response], shift: float) -> str:
    """Return the histories of two responses below each other, each under its name, in its own time and the common one.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.24, height=1.1)
    >>> response = rocking.simulate(block, rocking.pulses.sine(3.0, 1.0, cycles=1))
    >>> as_csv({"one": response, "other": response}, 2.0).splitlines()[0]
    'case,common_time_s,time_s,rotation_rad,angular_velocity_rad_s,ground_acceleration_m_s2'
    """
    import pandas as pd

    frames = []
    for (name, response), later in zip(responses.items(), (0.0, shift), strict=True):
        frame = response.to_dataframe("histories").reset_index()
        frame.insert(0, named("common_time", "s"), frame[named("time", "s")] + later)
        frame.insert(0, "case", name)
        frames.append(frame)
    return str(pd.concat(frames).to_csv(index=False))
