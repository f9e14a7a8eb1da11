"""Equivalent Python code and commands for cases, maps and sweeps."""

from __future__ import annotations

from typing import Final

from rocking.core.constants import STANDARD_GRAVITY
from rocking.explorer.inputs import Case
from rocking.explorer.maps import Axis, MapGrid, read_polarity
from rocking.explorer.motions import is_pulse, read_pulse_arguments, write_pulse_call
from rocking.explorer.parameters import BLOCK_NAMES, NAMES
from rocking.explorer.periodic import STORED_STATES, TRANSIENT_PERIODS, Sweep, write_sine_call
from rocking.inputs.texts import write_command

_MAP: Final = """\
import math

import numpy as np

import rocking
from rocking.chattering import chattering_map, families

{before}xs, ys = {xs}, {ys}


def case({y}, {x}):
    block = rocking.{block}
    motion = {motion}
    return families.SimulationInput(block, motion, {model!r})


{found}
"""

_OUTCOME: Final = """\
found = chattering_map(case, {{"{y}": ys, "{x}": xs}})
print(found.summary())"""

_GRID: Final = """\
def quantity(response):
    times, kinds = response.events["time"], response.events["kind"]
    uplifts, rests = times[kinds == "uplift"], times[kinds == "rest"]
{quantity}


found = np.array(
    [[quantity(rocking.simulate(at.block, at.motion, model=at.model)) for at in (case(y, x) for x in xs)] for y in ys]
)
print(found)"""

#: Python code that computes the quantities of a map from the response at a point.
_QUANTITIES: Final = {
    "rest": """\
    # Time, s, from the first uplift to the first rest; NaN where the block never rests.
    return rests[0] - uplifts[0] if len(rests) else np.nan""",
    "peak": """\
    # Peak rotation over the slenderness, the smaller one of two; infinite where the block overturns.
    slenderness = min(side.alpha for side in response.block.sides)
    return np.inf if response.overturned else response.peak_rotation / slenderness""",
    "mode": """\
    # -4: overturns after a rest; -3: no uplift; -2: rests before the motion is over; -1: rocks; else overturns, and
    # after how many impacts.
    if response.overturned:
        return -4 if len(uplifts) > 1 else len(response.impacts)
    rested = len(uplifts) > 1 or (len(rests) and rests[-1] <= response.motion.duration)
    return -3 if not len(uplifts) else -2 if rested else -1""",
}

_SWEEP: Final = """\
import math

import numpy as np

import rocking
from rocking import dynamics

block = rocking.{block}


def case({name}):
    return block, {motion}


rock = dynamics.stroboscopic_map(*case({at!r}){options})
print(rock.orbit(({rotation!r}, {velocity!r}), {last})[-{recorded}:])

found = dynamics.bifurcation_diagram(
    case, {values}, (0.0, 0.0), direction="both",
    transient_periods={transient}, recorded_periods={recorded}, parameter={name!r}{options}
)
print(found.summary())
"""


def case_as_python(case: Case) -> str:
    """Write the case as a complete script.

    Examples
    --------
    >>> from rocking.explorer.inputs import read_case
    >>> from rocking.explorer.uploads import UploadStore
    >>> texts = {"p": "2", "alpha": "0.2", "motion": "none", "initial_rotation": "0.02"}
    >>> print(case_as_python(read_case(texts, UploadStore())))
    import rocking
    <BLANKLINE>
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2)
    motion = None
    response = rocking.simulate(block, motion, initial_rotation=0.02)
    print(response.summary())
    """
    arguments = {
        "model": None if case.model == "nonlinear" else case.model,
        "chattering": case.texts.get("chattering"),
        "duration": case.duration,
        "initial_rotation": case.initial_rotation or None,
        "initial_velocity": case.initial_velocity or None,
        "friction": case.friction,
    }
    options = "".join(f", {name}={value!r}" for name, value in arguments.items() if value is not None)
    return "\n".join(
        [
            "import rocking",
            "",
            f"block = rocking.{case.block_call}",
            *filter(None, [case.motion_preamble]),
            f"motion = {case.motion_call}",
            f"response = rocking.simulate(block, motion{options})",
            "print(response.summary())",
        ]
    )


def case_as_command(case: Case) -> str | None:
    """Write the case as a command, or return None if the command line does not support it.

    Examples
    --------
    >>> from rocking.explorer.inputs import read_case
    >>> from rocking.explorer.uploads import UploadStore
    >>> texts = {"p": "2", "alpha": "12deg", "motion": "ridgecrest-clc-090", "sa": "0.4g@1"}
    >>> case_as_command(read_case(texts, UploadStore()))
    'rocking simulate ridgecrest-clc-090 --p 2 --alpha 12deg --sa 0.4g@1'
    """
    if not case.words or "gravity" in case.texts:
        return None
    excluded = {*BLOCK_NAMES, "motion", "vertical"}
    options = {**case.block_options} | {name: case.texts[name] for name in NAMES if name in {*case.texts} - excluded}
    return write_command(["rocking", "simulate", *case.words], options)


def map_as_python(grid: MapGrid, quantity: str) -> str:
    """Write a complete script that computes a quantity of a map."""
    axis_texts = {"x": grid.x.name, "y": grid.y.name, "xs": _write_axis(grid.x), "ys": _write_axis(grid.y)}
    preamble = grid.case.motion_preamble
    return _MAP.format(
        **axis_texts,
        before=preamble and f"{preamble}\n",
        block=_write_block(grid),
        motion=_write_motion(grid),
        model=grid.case.model,
        found=_OUTCOME.format(**axis_texts) if quantity == "outcome" else _GRID.format(quantity=_QUANTITIES[quantity]),
    )


def sweep_as_python(sweep: Sweep) -> str:
    """Write a complete script that computes the steady state of a case, and a sweep."""
    case, name = sweep.case, sweep.axis.name
    arguments = {"model": case.model, "chattering": case.texts.get("chattering")}
    return _SWEEP.format(
        block=case.block_call,
        motion=write_sine_call(sweep),
        options="".join(f", {option}={value!r}" for option, value in arguments.items() if value is not None),
        name=name,
        at=sweep.value,
        values=_write_axis(sweep.axis),
        rotation=case.initial_rotation,
        velocity=case.initial_velocity,
        recorded=STORED_STATES,
        transient=TRANSIENT_PERIODS - 1,
        last=TRANSIENT_PERIODS + STORED_STATES - 1,
    )


def _write_axis(axis: Axis) -> str:
    return f"np.linspace({float(axis.values[0])!r}, {float(axis.values[-1])!r}, {len(axis.values)})"


def _write_block(grid: MapGrid) -> str:
    """Return the call that creates the block, with the names of the axes as arguments."""
    varied = {grid.x.name, grid.y.name} & {"p", "alpha", "restitution"}
    texts, sides = grid.case.texts, grid.case.block.sides
    if not varied:
        return grid.case.block_call
    slowest = min(side.p for side in sides)
    arguments = {
        "p": _write_pair([f"p * {side.p / slowest!r}" if "p" in varied else repr(side.p) for side in sides]),
        "alpha": "np.radians(alpha)" if "alpha" in varied else _write_pair([repr(side.alpha) for side in sides]),
    }
    if "restitution" in varied:
        arguments["restitution"] = "restitution"
    elif "alpha" not in varied or "restitution" in texts:
        arguments["restitution"] = _write_pair([repr(side.restitution) for side in sides])
    if "gravity" in texts:
        arguments["gravity"] = repr(grid.case.block.gravity)
    return f"Block.from_parameters({', '.join(f'{name}={value}' for name, value in arguments.items())})"


def _write_pair(sides: list[str]) -> str:
    numbers = [number.removesuffix(" * 1.0") for number in sides]
    return numbers[0] if numbers[0] == numbers[1] else f"[{', '.join(numbers)}]"


def _write_motion(grid: MapGrid) -> str:
    """Return the call that creates the motion, with the names of the axes among its arguments."""
    axis_names, call = {grid.x.name, grid.y.name}, grid.case.motion_call
    text = grid.case.texts.get("motion", "")
    if "omega" in axis_names and is_pulse(text):
        p = min(side.p for side in grid.case.block.sides)
        pulse = read_pulse_arguments(text)
        frequency = f"omega * {p!r} / (2.0 * math.pi)"
        written = {name: repr(value) for name, value in pulse.items()}
        written |= {"amplitude": repr(read_polarity(grid.case.texts) * pulse["amplitude"]), "frequency": frequency}
        if "duration" in pulse:
            written["duration"] = f"{pulse['duration'] * pulse['frequency']!r} / ({frequency})"
        call = write_pulse_call(text, written)
    if "a" in axis_names:
        return f"{call}.scaled_to(a * min(block.uplift_thresholds({grid.case.model!r})))"
    if "pga" in axis_names:
        return f"{call}.scaled_to(pga * {STANDARD_GRAVITY!r})"
    return f"{call}.scaled_to({grid.motion.pga!r})" if "omega" in axis_names else call
