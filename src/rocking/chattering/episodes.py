"""Complete chattering in one response: each episode with its bracket, and how long the block rests amid the shaking."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking.arrays import without_dust
from rocking.errors import InvalidOption
from rocking.motion.exceedance import exceedances
from rocking.response import Response
from rocking.result import Result
from rocking.tables import rows_of, text_table

EPISODE: Final = np.dtype(
    [
        ("uplift", float),
        ("proven", float),
        ("rest", float),
        ("lower", float),
        ("upper", float),
        ("duration", float),
        ("impacts", np.int64),
        ("ground", float),
    ]
)


@dataclass(frozen=True, eq=False, repr=False)
class ChatteringEpisodes(Result):
    """The episodes of a response, from `chattering_episodes`; ``print`` it for a table.

    Attributes
    ----------
    episodes : structured array
        One row for each stretch of rocking that complete chattering ends: uplift (s; 0 where the block was already
        moving); proven (time of the impact from which chattering is proven to be complete, s); rest, and lower and
        upper bound on it (s); duration from uplift to rest (s); impacts resolved in it; ground (acceleration at the
        rest, m/s^2).
    shaking : tuple of float
        Bracketed duration: when the motion first passes a threshold of the block, and when it falls below one for the
        last time or the block has overturned, s; NaN where it never does before the simulation ends.
    at_rest : float
        Time at rest within the bracketed duration, s.
    """

    episodes: NDArray[np.void]
    shaking: tuple[float, float]
    at_rest: float

    def _headline(self) -> str:
        return f"{len(self.episodes)}, at rest for {self.at_rest:.3f} s of the shaking"

    @property
    def share_at_rest(self) -> float:
        """Share of the bracketed duration during which the block is at rest; NaN where there is none."""
        start, end = self.shaking
        return self.at_rest / (end - start) if end > start else math.nan

    @property
    def amid_shaking(self) -> NDArray[np.bool_]:
        """Whether each episode ends before the motion passes a threshold for the last time."""
        return np.asarray(self.episodes["upper"] < self.shaking[1])

    def __str__(self) -> str:
        return self.summary()

    def summary(self) -> str:
        header = ["uplift, s", "rest, s", "bracket, s", "duration, s", "impacts", "ground, m/s^2"]
        rows = [
            [
                f"{row['uplift']:.6f}",
                f"{row['rest']:.9f}",
                f"{row['upper'] - row['lower']:.1e}",
                f"{row['duration']:.6f}",
                int(row["impacts"]),
                f"{row['ground']:+.4f}",
            ]
            for row in self.episodes
        ]
        start, end = self.shaking
        about = (
            "the motion never passes a threshold of the block before the simulation ends"
            if math.isnan(start)
            else f"at rest for {self.share_at_rest:.1%} of the shaking from {start:.3f} s to {end:.3f} s"
        )
        return f"{text_table(header, rows)}\n{about}"

    def to_dict(self) -> dict[str, Any]:
        return {
            "episodes": rows_of(self.episodes),
            "shaking_s": self.shaking,
            "at_rest_s": self.at_rest,
            "share_at_rest": self.share_at_rest,
        }


def chattering_episodes(response: Response) -> ChatteringEpisodes:
    """List the episodes of complete chattering in a response.

    Parameters
    ----------
    response : Response
        From `rocking.simulate` with certified chattering. Rests that are not proven are no episodes.

    Returns
    -------
    ChatteringEpisodes
        The episodes with duration and bracket, and the share of the shaking during which the block is at rest. The
        shaking is the bracketed duration for this block: from the first to the last time that the motion is beyond one
        of the block's own thresholds.

    Raises
    ------
    InvalidOption
        If it is given anything but the `Response` of a block without restraints.

    Examples
    --------
    >>> import rocking
    >>> response = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.records.load("ridgecrest-clc-090"))
    >>> found = chattering_episodes(response)
    >>> len(found.episodes), bool((found.episodes["upper"] - found.episodes["lower"] < 1e-11).all())
    (6, True)
    >>> print(f"{found.share_at_rest:.3f}")
    0.498
    """
    if not isinstance(response, Response):
        raise InvalidOption(
            f"{{}} must be a Response, not a {type(response).__name__}: simulate(block, motion) makes one", "response"
        )
    proven = response.chattering[np.isfinite(response.chattering["upper"])]
    starts = response.events["time"][response.events["kind"] == "uplift"]
    impacts = response.impacts["time"]
    episodes = np.zeros(len(proven), EPISODE)
    before = np.searchsorted(starts, proven["end"], side="left") - 1
    episodes["uplift"] = np.where(before >= 0, np.append(starts, 0.0)[before], 0.0)
    for name, source in (("proven", "start"), ("rest", "end"), ("lower", "lower"), ("upper", "upper")):
        episodes[name] = proven[source]
    episodes["duration"] = episodes["rest"] - episodes["uplift"]
    impacts_before = np.searchsorted(impacts, episodes["uplift"], "left")
    episodes["impacts"] = np.searchsorted(impacts, proven["end"], "right") - impacts_before
    if response.motion is None:
        return ChatteringEpisodes(episodes, (math.nan, math.nan), 0.0)
    episodes["ground"] = response.motion.acceleration(proven["end"])
    beyond = exceedances(response.motion, response.block.uplift_thresholds(response.model), response.block.gravity)
    if not len(beyond) or beyond[0, 0] >= response.duration:
        return ChatteringEpisodes(episodes, (math.nan, math.nan), 0.0)
    start, end = float(beyond[0, 0]), min(float(beyond[-1, 1]), response.duration)
    # The shaking starts with an uplift, to rounding.
    at_rest = without_dust(np.diff(np.clip(response.rest_intervals, start, end)), end).sum()
    return ChatteringEpisodes(episodes, (start, end), float(at_rest))
