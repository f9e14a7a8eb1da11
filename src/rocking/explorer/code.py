"""Equivalent Python code and commands for cases, maps and sweeps."""

from __future__ import annotations

from typing import Final

from rocking.core.constants import STANDARD_GRAVITY
from rocking.explorer.inputs import Case
from rocking.explorer.maps import Axis, MapGrid, compute_angular_frequency
from rocking.explorer.parameters import BLOCK_NAMES, NAMES
from rocking.explorer.periodic import RECORDED_PERIODS, SWEPT, TRANSIENT_PERIODS, Sweep
from rocking.inputs.texts import format_command

_CASE: Final = """\
import rocking

block = rocking.{block}
{before}motion = {motion}
response = rocking.simulate(block, motion{options})
print(response.summary())"""

_MAP: Final = """\
import numpy as np

import rocking
from rocking.chattering import chattering_map, families

{before}xs, ys = {xs}, {ys}


def case({y}, {x}):
    block = rocking.{block}
    return families.SimulationInput(block, {motion}, {model!r})


found = chattering_map(case, {{"{y}": ys, "{x}": xs}})
print(found.summary())


def find_peak(at):
    response = rocking.simulate(at.block, at.motion, model=at.model)
    slenderness = min(side.alpha for side in at.block.sides)
    return np.inf if response.overturned else response.peak_rotation / slenderness


peaks = [[find_peak(case(y, x)) for x in xs] for y in ys]
"""

_SWEEP: Final = """\
import numpy as np

import rocking
from rocking import dynamics

block = rocking.{block}


def case({name}):
    return block, rocking.pulses.sine({amplitude}, {frequency}, cycles=1, phase={phase!r})


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
    options = "".join(f", {name}={value!r}" for name, value in case.options.items())
    return _CASE.format(
        block=case.block_call, before=case.motion_preamble, motion=case.motion_call, options=options
    )  # fmt: skip


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
    return format_command(["rocking", "simulate", *case.words], options)


def map_as_python(grid: MapGrid) -> str:
    """Write a complete script that computes a map."""
    preamble = grid.case.motion_preamble
    if "omega" in grid.names:
        preamble += "# A pulse of another frequency is equivalent to a block of another p, in other units of time.\n"
    return _MAP.format(
        before=preamble,
        x=grid.x.name,
        y=grid.y.name,
        xs=_write_axis(grid.x),
        ys=_write_axis(grid.y),
        block=_write_block(grid),
        motion=_write_motion(grid),
        model=grid.case.model,
    )


def sweep_as_python(sweep: Sweep) -> str:
    """Write a complete script that computes a bifurcation diagram."""
    case, sine, name = sweep.case, sweep.sine, sweep.axis.name
    options = {name: case.options[name] for name in ("model", "chattering") if name in case.options}
    numbers = {"amplitude": repr(sine.amplitude), "frequency": repr(sine.frequency)}
    return _SWEEP.format(
        **numbers | {SWEPT[name]: f"{name} * {sweep.unit!r}"},
        block=case.block_call,
        phase=sine.phase,
        options="".join(f", {option}={value!r}" for option, value in options.items()),
        name=name,
        values=_write_axis(sweep.axis),
        recorded=RECORDED_PERIODS,
        transient=TRANSIENT_PERIODS,
    )


def _write_axis(axis: Axis) -> str:
    return f"np.linspace({float(axis.values[0])!r}, {float(axis.values[-1])!r}, {len(axis.values)})"


def _write_block(grid: MapGrid) -> str:
    """Return the call that creates the block, with the names of the axes as arguments."""
    case, varied = grid.case, grid.names & {"omega", "p", "alpha", "restitution"}
    if not varied:
        return case.block_call
    p = next(iter(varied & {"p", "omega"}), "")
    if p == "omega":
        p = f"{compute_angular_frequency(case)!r} / omega"
    slowest = min(side.p for side in case.block.sides)
    arguments = {
        "p": _write_pair([f"{p} * {side.p / slowest!r}" if p else repr(side.p) for side in case.block.sides]),
        "alpha": "np.radians(alpha)" if "alpha" in varied else _write_pair([repr(s.alpha) for s in case.block.sides]),
    }
    if "restitution" in varied:
        arguments["restitution"] = "restitution"
    elif "alpha" not in varied or "restitution" in case.texts:
        arguments["restitution"] = _write_pair([repr(side.restitution) for side in case.block.sides])
    if "gravity" in case.texts:
        arguments["gravity"] = repr(case.block.gravity)
    return f"Block.from_parameters({', '.join(f'{name}={value}' for name, value in arguments.items())})"


def _write_pair(sides: list[str]) -> str:
    numbers = [number.removesuffix(" * 1.0") for number in sides]
    return numbers[0] if numbers[0] == numbers[1] else f"[{', '.join(numbers)}]"


def _write_motion(grid: MapGrid) -> str:
    """Return the call that creates the motion, with the names of the axes among its arguments."""
    peaks = {"a": f"a * min(block.uplift_thresholds({grid.case.model!r}))", "pga": f"pga * {STANDARD_GRAVITY!r}"}
    peak = next((peaks[name] for name in grid.names if name in peaks), "")
    return f"{grid.case.motion_call}.scaled_to({peak})" if peak else grid.case.motion_call
