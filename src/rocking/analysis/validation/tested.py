"""Tests on a shake table: a motion, and what was observed of a specimen under it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rocking import checks
from rocking.analysis.labels import numbered
from rocking.arrays import Flags, Floats, Integers
from rocking.errors import InvalidMotion, InvalidOption
from rocking.motion.motion import Motion
from rocking.motion.named import distinct_motions, one_motion


@dataclass(frozen=True)
class ShakeTest:
    """One test: the motion that a specimen at rest met, and what was observed.

    Parameters
    ----------
    motion : Motion
        Motion of what the specimen stood on: measured, or else commanded.
    overturned : bool, optional
        Whether it overturned. Without it a peak rotation must be given, and says so.
    peak_rotation : float, optional
        Largest rotation in size, rad; 0 where it did not rock, infinite where it overturned, NaN or nothing where it
        was not measured.
    name : str
        Name of the test; by default that of the motion.
    specimen : str
        Name of the specimen.
    nominal : str
        Command of the table: tests with the same text belong together. By default those whose motions are the same to
        the last bit do.
    group : str
        Tests that belong together otherwise, as those with one source motion at different scales: standard errors allow
        for it. By default those with one command do.

    Raises
    ------
    InvalidMotion
        If the motion is none.
    InvalidOption
        If nothing was observed, or what was observed contradicts itself.

    Examples
    --------
    >>> import rocking
    >>> ShakeTest(rocking.pulses.one_sine(3.0, 1.0), peak_rotation=0.05, name="first")
    <ShakeTest: first, stood, peak 0.05 rad>
    """

    motion: Motion
    overturned: bool | None = None
    peak_rotation: float | None = None
    name: str = ""
    specimen: str = ""
    nominal: str = ""
    group: str = ""

    def __post_init__(self) -> None:
        motion = one_motion(self.motion)
        if motion is None:
            raise InvalidMotion("a test needs the {} that the specimen met, not None", "motion")
        for label in ("name", "specimen", "nominal", "group"):
            checks.text(getattr(self, label), label, InvalidOption)
        peak, fell = _checked_peak(self.peak_rotation), _checked_outcome(self.overturned)
        if peak is None and fell is None:
            raise InvalidOption("a test needs what was observed: {}, {}, or both", "overturned", "peak_rotation")
        if fell is None:
            fell = peak == math.inf
        if peak is not None and fell != (peak == math.inf):
            said = f"it overturned, and has a largest rotation of {peak:g} rad" if fell else "it did not overturn"
            raise InvalidOption(
                f"{said}: a specimen that overturns has a {{}} that is infinite or not given, and no other has",
                "peak_rotation",
                value=peak,
            )
        object.__setattr__(self, "overturned", fell)
        object.__setattr__(self, "peak_rotation", None if fell else peak)
        object.__setattr__(self, "name", self.name or motion.name)

    def __repr__(self) -> str:
        peak = "" if self.peak_rotation is None else f", peak {self.peak_rotation:g} rad"
        return f"<ShakeTest: {self.name}, {'overturned' if self.overturned else 'stood'}{peak}>"


@dataclass(frozen=True, eq=False)
class Observed:
    """Tests as arrays: outcomes, peaks (NaN where there is none), and whole numbers that are the same in one set.

    A set of `specimens`; of `clusters`, which belong together.
    """

    overturned: Flags
    peaks: Floats
    specimens: Integers
    clusters: Integers
    names: tuple[str, ...]
    distinct: tuple[Motion, ...]
    which: Integers

    @classmethod
    def of(cls, tests: Sequence[ShakeTest]) -> Observed:
        """Arrays of tests."""
        distinct, which = distinct_motions([test.motion for test in tests])
        motions = [
            ("nominal", test.nominal) if test.nominal else ("motion", k) for test, k in zip(tests, which, strict=True)
        ]
        belonging = [("group", test.group) if test.group else label for test, label in zip(tests, motions, strict=True)]
        specimens = [test.specimen for test in tests]
        return cls(
            overturned=np.array([test.overturned for test in tests], dtype=bool),
            peaks=np.array([math.nan if test.peak_rotation is None else test.peak_rotation for test in tests]),
            specimens=numbered(specimens),
            clusters=numbered(belonging),
            names=tuple(dict.fromkeys(specimens)),
            distinct=tuple(distinct),
            which=np.array(which),
        )


def checked_tests(tests: object) -> list[ShakeTest]:
    """Return tests as a list, or say that they are none."""
    given = checks.several(tests, "tests", InvalidOption)
    if not given:
        raise InvalidOption("{} must hold at least one test", "tests", value=tests)
    for test in given:
        if not isinstance(test, ShakeTest):
            raise InvalidOption(
                f"{{}} must hold tests, ShakeTest(motion, overturned), not {checks.shown(test)}", "tests", value=test
            )
    return given


def _checked_outcome(given: object) -> bool | None:
    if given is None:
        return None
    if not isinstance(given, (bool, int, np.bool_, np.integer)) or given not in (0, 1):
        raise InvalidOption(f"{{}} must be True or False, not {checks.shown(given)}", "overturned", value=given)
    return bool(given)


def _checked_peak(given: object) -> float | None:
    if given is None:
        return None
    peak = checks.number(given, "peak_rotation", InvalidOption)
    if math.isnan(peak):
        return None
    if not (0.0 <= peak < 0.5 * math.pi or peak == math.inf):
        raise InvalidOption(
            f"{{}} must be from 0 to pi/2 rad, a size without a sign, or infinite of a specimen that overturned, "
            f"not {peak:g}{checks.hint_of_degrees(peak)}",
            "peak_rotation",
            value=given,
        )
    return peak
