"""`rocking schemes`: one case by every scheme for impacts, against the certified response."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Annotated

from rocking.cli.body_options import BodyOptions
from rocking.cli.options import BLOCK, MODEL, WHOLE, ModelOptions, measured, written
from rocking.cli.output import OUTPUT, OutputOptions, print_result, write_results, write_tables
from rocking.cli.records import RECORDS, MotionOptions, Names
from rocking.dynamics import compare_schemes, scheme_of
from rocking.dynamics.comparison import Scheme
from rocking.dynamics.schemes import STEPPINGS, TREATMENTS
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion
from rocking.quantities import duration, of_state


@dataclass(frozen=True)
class _Start:
    """How a simulation starts and ends."""

    duration: Annotated[
        float | None, measured("Time to stop at, s; by default when the body is at rest after the motion.", duration)
    ] = None
    initial_position: Annotated[
        str | None, written("Rotation at the start, 2deg or 0.03 (rad); position of another body, 1m.")
    ] = None
    initial_velocity: Annotated[
        str, written("Angular velocity at the start, 5deg/s or 0.09 (rad/s); velocity of another body, 1m/s.")
    ] = "0"


def schemes(
    *names: Names,
    schemes: str | None = None,
    repetitions: Annotated[int, WHOLE] = 3,
    start: Annotated[_Start, MODEL] = _Start(),
    body: Annotated[BodyOptions, BLOCK] = BodyOptions(),
    motion: Annotated[MotionOptions, RECORDS] = MotionOptions(),
    model: Annotated[ModelOptions, MODEL] = ModelOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Compare treatments of chattering and time stepping with the certified response: error against cost.

    One record or pulse, or free motion from --initial-position. --out holds schemes.png, .pdf (errors of position and
    time of rest against processor time), schemes.csv, rests.csv (each rest by each scheme) and result.json.

    Parameters
    ----------
    schemes
        What to compare, as velocity=5e-2,bypass=1e-3,interval=1e-6,time,moreau-jean=1e-3,schatzman-paoli=1e-3 (over
        p alpha, of other bodies in m/s; s; steps in s); by default several of each.
    repetitions
        Runs from which the processor time is taken; 0: it is not measured.
    """
    chosen: Sequence[Scheme] = (
        (*TREATMENTS, *STEPPINGS) if schemes is None else [scheme_of(text) for text in schemes.split(",")]
    )
    what = body.body()
    read_position, read_velocity = of_state(what.coordinate.unit)
    at = None if start.initial_position is None else read_position(start.initial_position, "initial_position")
    velocity = read_velocity(start.initial_velocity, "initial_velocity")
    with output.folder() as folder:
        found = compare_schemes(
            what,
            _one_motion(names, motion, free=at is not None or velocity != 0.0),
            schemes=chosen,
            model=model.equation,
            duration=start.duration,
            initial_position=at,
            initial_velocity=velocity,
            repetitions=repetitions,
        )
        if folder is not None:
            write_tables(folder, found)
            write_results(folder, figures={"schemes": found.plot}, result=found.to_dict())
        print_result(found.to_dict(), found.summary(), as_json=output.as_json)


def _one_motion(names: Sequence[str], motion: MotionOptions, *, free: bool) -> Motion | None:
    """Return the one motion, or None where none is given and the body moves without."""
    if free and not names and not motion.pulse:
        for option in fields(motion):
            if getattr(motion, option.name) != option.default:
                raise InvalidOption("{} is of a record or a pulse: name one, or leave it out", option.name)
        return None
    motions = motion.read_all(names).motions
    if len(motions) != 1:
        raise InvalidOption(f"schemes are compared on one motion at a time, not on {len(motions)}")
    return next(iter(motions.values()))
