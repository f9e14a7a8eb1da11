"""Equivalent Python code and commands for cases and maps."""

from __future__ import annotations

from typing import Final

from rocking.core.constants import STANDARD_GRAVITY
from rocking.explorer.inputs import Case
from rocking.explorer.maps import Axis, MapGrid, sign_of
from rocking.explorer.motions import arguments_of, is_pulse, pulse_call
from rocking.explorer.parameters import BLOCK_NAMES, NAMES
from rocking.explorer.periodic import KEPT, PASSED, Sweep, call_at
from rocking.inputs.texts import command_line

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

_OTHER: Final = """\
def quantity(response):
    times, kinds = response.events["time"], response.events["kind"]
    uplifts, rests = times[kinds == "uplift"], times[kinds == "rest"]
{quantity}


found = np.array(
    [[quantity(rocking.simulate(at.block, at.motion, model=at.model)) for at in (case(y, x) for x in xs)] for y in ys]
)
print(found)"""

#: Python code that computes the quantities of a map from the response at a point.
_QUANTITY: Final = {
    "rest": """\
    # Time, s, from the first uplift to the first rest; NaN where the block never rests.
    return rests[0] - uplifts[0] if len(rests) else np.nan""",
    "peak": """\
    # Peak rotation over the slenderness, the smaller one of two; infinite where the block overturns.
    slenderness = min(side.alpha for side in one_block(response.block).sides)
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
print(rock.orbit(({rotation!r}, {velocity!r}), {last})[-{kept}:])

found = dynamics.bifurcation_diagram(
    case, {values}, (0.0, 0.0), direction="both", transient={transient}, kept={kept}, parameter={name!r}{options}
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
    numbers = {
        "model": None if case.model == "nonlinear" else case.model,
        "chattering": case.texts.get("chattering"),
        "duration": case.duration,
        "initial_rotation": case.initial_rotation or None,
        "initial_velocity": case.initial_velocity or None,
    }
    options = "".join(f", {name}={value!r}" for name, value in numbers.items() if value is not None)
    return "\n".join(
        [
            "import rocking",
            "",
            f"block = rocking.{case.block_call}",
            *filter(None, [case.motion_before]),
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
    left_out = {*BLOCK_NAMES, "motion", "vertical"}
    options = {**case.block_options} | {name: case.texts[name] for name in NAMES if name in {*case.texts} - left_out}
    return command_line(["rocking", "simulate", *case.words], options)


def map_as_python(grid: MapGrid, quantity: str) -> str:
    """Write a complete script that computes a quantity of a map."""
    texts = {"x": grid.x.name, "y": grid.y.name, "xs": _values(grid.x), "ys": _values(grid.y)}
    before = grid.case.motion_before
    return _MAP.format(
        **texts,
        before=before and f"{before}\n",
        block=_block(grid),
        motion=_motion(grid),
        model=grid.case.model,
        found=_OUTCOME.format(**texts) if quantity == "outcome" else _OTHER.format(quantity=_QUANTITY[quantity]),
    )


def sweep_as_python(sweep: Sweep) -> str:
    """Write a complete script that computes the steady state of a case, and a sweep."""
    case, name = sweep.case, sweep.axis.name
    given = {"model": case.model, "chattering": case.texts.get("chattering")}
    return _SWEEP.format(
        block=case.block_call,
        motion=call_at(sweep),
        options="".join(f", {option}={value!r}" for option, value in given.items() if value is not None),
        name=name,
        at=sweep.value,
        values=_values(sweep.axis),
        rotation=case.initial_rotation,
        velocity=case.initial_velocity,
        kept=KEPT,
        transient=PASSED - 1,
        last=PASSED + KEPT - 1,
    )


def _values(axis: Axis) -> str:
    return f"np.linspace({float(axis.values[0])!r}, {float(axis.values[-1])!r}, {len(axis.values)})"


def _block(grid: MapGrid) -> str:
    """Return the call that creates the block, with the names of the axes as arguments."""
    varied = {grid.x.name, grid.y.name} & {"p", "alpha", "restitution"}
    texts, sides = grid.case.texts, grid.case.block.sides
    if not varied:
        return grid.case.block_call
    slowest = min(side.p for side in sides)
    arguments = {
        "p": _pair([f"p * {side.p / slowest!r}" if "p" in varied else repr(side.p) for side in sides]),
        "alpha": "np.radians(alpha)" if "alpha" in varied else _pair([repr(side.alpha) for side in sides]),
    }
    if "restitution" in varied:
        arguments["restitution"] = "restitution"
    elif "alpha" not in varied or "restitution" in texts:
        arguments["restitution"] = _pair([repr(side.restitution) for side in sides])
    if "gravity" in texts:
        arguments["gravity"] = repr(grid.case.block.gravity)
    return f"Block.from_parameters({', '.join(f'{name}={value}' for name, value in arguments.items())})"


def _pair(sides: list[str]) -> str:
    plain = [each.removesuffix(" * 1.0") for each in sides]
    return plain[0] if plain[0] == plain[1] else f"[{', '.join(plain)}]"


def _motion(grid: MapGrid) -> str:
    """Return the call that creates the motion, with the names of the axes among its arguments."""
    names, made = {grid.x.name, grid.y.name}, grid.case.motion_call
    text = grid.case.texts.get("motion", "")
    if "omega" in names and is_pulse(text):
        p = min(side.p for side in grid.case.block.sides)
        given = arguments_of(text)
        frequency = f"omega * {p!r} / (2.0 * math.pi)"
        written = {name: repr(value) for name, value in given.items()}
        written |= {"amplitude": repr(sign_of(grid.case.texts) * given["amplitude"]), "frequency": frequency}
        if "duration" in given:
            written["duration"] = f"{given['duration'] * given['frequency']!r} / ({frequency})"
        made = pulse_call(text, written)
    if "a" in names:
        return f"{made}.scaled_to(a * min(block.uplift_thresholds({grid.case.model!r})))"
    if "pga" in names:
        return f"{made}.scaled_to(pga * {STANDARD_GRAVITY!r})"
    return f"{made}.scaled_to({grid.motion.pga!r})" if "omega" in names else made
