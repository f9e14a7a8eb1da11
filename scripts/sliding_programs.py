"""Table of three cases with friction by other programs, docs/_tables/sliding-programs.txt.

    python scripts/sliding_programs.py --siconos PYTHON --mujoco PYTHON

The options name the interpreters in which Siconos (with a C compiler) and MuJoCo are installed. These interpreters run
this file with the name of a program and need numpy only. In the frame of the ground, a rectangle with centre (x, y)
and clockwise rotation r has two corners that may touch the ground, and the force -m a(t).
"""

from __future__ import annotations

import argparse
import importlib
import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

GRAVITY: Final = 9.80665

#: Rotation, rad, at which an overturning block is compared: its upper corners are still above the ground.
END_ROTATION: Final = 1.5

Floats = NDArray[np.float64]


class Case(NamedTuple):
    """A rectangle (m) with a coefficient of friction under one sine (m/s^2, Hz) or with an initial rotation (rad)."""

    title: str
    width: float
    height: float
    friction: float
    amplitude: float
    frequency: float
    rotation: float
    duration: float

    def acceleration(self, time: float) -> float:
        """Return the acceleration of the ground, m/s^2."""
        return self.amplitude * math.sin(2.0 * math.pi * self.frequency * time) if time < 1.0 / self.frequency else 0.0

    @property
    def start(self) -> list[float]:
        """Centre and rotation at the start, with the lower corner on the ground."""
        b, h, r = 0.5 * self.width, 0.5 * self.height, self.rotation
        c, s = math.cos(r), math.sin(r)
        return [b - b * c + h * s, b * s + h * c, r]

    @property
    def inertia(self) -> float:
        """Moment of inertia about the centre for a mass of 1 kg, kg m^2."""
        return (self.width**2 + self.height**2) / 12.0


CASES: Final = (
    Case("slides", 0.5, 1.6, 0.25, 4.0, 1.0, 0.0, 1.5),
    Case("rocks freely", 0.5, 1.5, 0.2, 0.0, 1.0, 0.15, 4.5),
    Case("overturns", 0.5, 1.5, 0.35, 5.0, 1.0, 0.0, 3.0),
)

HEADING: Final = (
    "Case", "Result", "`rocking`", "Siconos, 1 ms", "Siconos, 0.1 ms", "MuJoCo, default", "MuJoCo, stiff",
)  # fmt: skip

#: Settings that are not defaults: steps of Siconos, and step, contact and solver of MuJoCo.
SICONOS_STEPS: Final = (1e-3, 1e-4)
MUJOCO_SETTINGS: Final = (
    (2e-3, "", ""),
    (1e-4, 'impratio="100" tolerance="1e-14" iterations="200"', 'solref="0.002 1"'),
)

#: Gaps and slips of the corners, and their derivatives, for Siconos.
CORNERS: Final = """
#include <math.h>
#define ARGUMENTS unsigned n, const double *q, unsigned m, double *y, unsigned k, double *size
static void gap(double side, const double *q, double *y, const double *size) {
    double c = cos(q[2]), s = sin(q[2]);
    y[0] = q[1] - side * size[0] * s - size[1] * c;
    y[1] = q[0] + side * size[0] * c - size[1] * s;
}
static void jacobian(double side, const double *q, double *y, const double *size) {
    double c = cos(q[2]), s = sin(q[2]);
    y[0] = 0; y[1] = 1; y[2] = 1; y[3] = 0;
    y[4] = -side * size[0] * c + size[1] * s;
    y[5] = -side * size[0] * s - size[1] * c;
}
void gap_right(ARGUMENTS) { gap(1, q, y, size); }
void gap_left(ARGUMENTS) { gap(-1, q, y, size); }
void jacobian_right(ARGUMENTS) { jacobian(1, q, y, size); }
void jacobian_left(ARGUMENTS) { jacobian(-1, q, y, size); }
"""


def measure(case: Case, times: Floats, rotations: Floats, slips: Floats) -> dict[str, float]:
    """Return the results of a case by their titles, until an overturning block reaches `END_ROTATION`."""
    fallen = np.flatnonzero(np.abs(rotations) >= END_ROTATION)
    end = int(fallen[0]) if len(fallen) else len(times) - 1
    found = {"largest slip, mm": 1e3 * float(np.abs(slips[: end + 1]).max())}
    found["slip at the end, mm"] = 1e3 * float(slips[end])
    if case.rotation:
        found["peak of the other side, rad"] = -float(rotations.min())
    if len(fallen):
        found[f"time at {END_ROTATION} rad, s"] = float(times[end])
    return found


def measure_states(case: Case, states: list[list[float]]) -> dict[str, float]:
    """Return the results of a case from rows of time, centre and rotation."""
    time, x, _, r = np.array(states).T
    side = np.where(r >= 0.0, 1.0, -1.0)
    slip = x + 0.5 * case.width * side * (np.cos(r) - 1.0) - 0.5 * case.height * np.sin(r)
    return measure(case, time, r, slip)


def run_rocking(case: Case) -> dict[str, float]:
    """Simulate a case by rocking."""
    import rocking

    block = rocking.Block(width=case.width, height=case.height)
    motion = rocking.pulses.one_sine(case.amplitude, case.frequency) if case.amplitude else None
    response = rocking.simulate(block, motion, friction=case.friction, initial_rotation=case.rotation)
    times = np.arange(0.0, response.duration, 1e-5)
    return measure(case, times, np.asarray(response.rotation(times)), np.asarray(response.slip(times)))


def run_siconos(case: Case, step: float) -> dict[str, float]:
    """Simulate a case by Siconos: Moreau-Jean with a Gauss-Seidel solver, in a folder with the compiled corners."""
    kernel, numerics = (importlib.import_module(f"siconos.{name}") for name in ("kernel", "numerics"))
    body = kernel.LagrangianLinearTIDS(np.array(case.start), np.zeros(3), np.diag([1.0, 1.0, case.inertia]))
    size = np.array([0.5 * case.width, 0.5 * case.height])
    body.setzPtr(size)
    system = kernel.NonSmoothDynamicalSystem(0.0, case.duration)
    system.insertDynamicalSystem(body)
    law, used = kernel.NewtonImpactFrictionNSL(0.0, 0.0, case.friction, 2), []
    for side in ("right", "left"):
        relation = kernel.LagrangianScleronomousR(f"Corners:gap_{side}", f"Corners:jacobian_{side}")
        used += [relation, kernel.Interaction(law, relation)]
        system.link(used[-1], body)
    problem = kernel.FrictionContact(2, numerics.SICONOS_FRICTION_2D_NSGS)
    options = problem.numericsSolverOptions()
    options.dparam[0], options.iparam[0] = 1e-14, 100_000
    scheme, times = kernel.MoreauJeanOSI(0.5), kernel.TimeDiscretisation(0.0, step)
    simulation, states = kernel.TimeStepping(system, times, scheme, problem), []
    while simulation.hasNextEvent():
        time = simulation.startingTime()
        force = np.array([-case.acceleration(time + 0.5 * step), -GRAVITY, 0.0])
        body.setFExtPtr(force)
        simulation.computeOneStep()
        states.append([time + step, *body.q()])
        simulation.nextStep()
        if abs(states[-1][3]) >= END_ROTATION:
            break
    return measure_states(case, states)


def run_mujoco(case: Case, step: float, solver: str, contact: str) -> dict[str, float]:
    """Simulate a case by MuJoCo: a box in the plane, with elliptic cones."""
    mujoco = importlib.import_module("mujoco")
    contact += f' friction="{case.friction} 0 0" condim="3"'
    joints = "".join(
        f'<joint type="{kind}" axis="{axis}"/>'
        for kind, axis in (("slide", "1 0 0"), ("slide", "0 0 1"), ("hinge", "0 1 0"))
    )
    size = f"{0.5 * case.width} 0.5 {0.5 * case.height}"
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{step}" gravity="0 0 {-GRAVITY}" cone="elliptic" {solver}/><worldbody>'
        f'<geom type="plane" size="5 5 1" {contact}/>'
        f'<body>{joints}<geom type="box" size="{size}" mass="1" {contact}/></body></worldbody></mujoco>'
    )
    data, states = mujoco.MjData(model), []
    data.qpos[:] = case.start
    for k in range(round(case.duration / step)):
        data.qfrc_applied[0] = -case.acceleration((k + 0.5) * step)
        mujoco.mj_step(model, data)
        states.append([data.time, *data.qpos])
        if abs(states[-1][3]) >= END_ROTATION:
            break
    return measure_states(case, states)


#: Results of the settings of each program, for each case.
PROGRAMS: Final[dict[str, Callable[[Case], list[dict[str, float]]]]] = {
    "siconos": lambda case: [run_siconos(case, step) for step in SICONOS_STEPS],
    "mujoco": lambda case: [run_mujoco(case, *settings) for settings in MUJOCO_SETTINGS],
}


def run_elsewhere(program: str, python: str) -> list[list[dict[str, float]]]:
    """Run all cases by a program under its interpreter."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "Corners.c")
        source.write_text(CORNERS, encoding="utf-8")
        if program == "siconos":
            subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", "Corners.so", source.name], cwd=folder, check=True)
        command = [python, str(Path(__file__).resolve()), program]
        output = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout
    found: list[list[dict[str, float]]] = json.loads(output.splitlines()[-1])
    return found


def build_rows(pythons: dict[str, str]) -> list[tuple[str, ...]]:
    """Return a row for each result of each case."""
    others = [run_elsewhere(program, python) for program, python in pythons.items()]
    rows = []
    for k, case in enumerate(CASES):
        columns: list[dict[str, Any]] = [run_rocking(case), *(result for found in others for result in found[k])]
        for n, title in enumerate(columns[0]):
            digits = 2 if title.endswith("mm") else 4
            values = (f"{column[title]:.{digits}f}" if title in column else "none" for column in columns)
            rows.append((case.title if n == 0 else "", title, *values))
    return rows


def main() -> None:
    """Run the cases by one program, or write the table of all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", nargs="?", choices=[*PROGRAMS])
    for name in PROGRAMS:
        parser.add_argument(f"--{name}", default=sys.executable)
    options = parser.parse_args()
    if options.program:
        print(json.dumps([PROGRAMS[options.program](case) for case in CASES]))
        return
    import pages

    rows = build_rows({name: getattr(options, name) for name in PROGRAMS})
    pages.write({"sliding-programs.txt": pages.markdown(HEADING, rows)})


if __name__ == "__main__":
    main()
