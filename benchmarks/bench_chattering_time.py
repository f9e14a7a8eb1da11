"""Chattering times per second: this package against SciPy's event loop, in one run.

Run ``python benchmarks/bench_chattering_time.py`` from the repository's root. The baseline is the loop of Fig. 8b as
one writes it in Python: DOP853 with an event per impact, rtol 1e-12, until the speed falls below 1e-12, so that it
too is accurate to 1e-9. Times are processor times of one core (other programs do not count), except where it says
"wall".
"""

import math
import time

import numpy as np
from scipy.integrate import solve_ivp

from rocking import chattering
from rocking.chattering import duration

CASE = (1.03, 2.0, 0.92)
CASE_TIME = 1.1259476769338108721
VELOCITY_TOLERANCE = 1e-12
RELATIVE_TOLERANCE = 1e-12
REPETITIONS = 5
LARGE = 1_000_000


def scipy_chattering_time(a, omega, eta):
    """Chattering time by restarting SciPy's integrator at each impact; NaN once half a period is over."""
    phase = math.asin(1.0 / a)
    tau, side, speed = 0.0, -1.0, 0.0
    while tau < math.pi / omega:
        pull = 1.0 + side * a * math.sin(omega * tau + phase)
        # An arc lasts about 2 speed/pull. Longer steps would step over it, and none is known at uplift.
        step = speed / pull if speed > 0.0 else math.inf
        scale = speed if speed > 0.0 else 1.0

        def equation(t, state, tau=tau, side=side):
            return state[1], state[0] - 1.0 - side * a * math.sin(omega * (tau + t) + phase)

        def impact(t, state):
            return state[0]

        impact.terminal, impact.direction = True, -1.0  # type: ignore[attr-defined]
        solution = solve_ivp(
            equation,
            (0.0, math.pi / omega),
            (0.0, speed),
            method="DOP853",
            events=impact,
            rtol=RELATIVE_TOLERANCE,
            atol=(1e-13 * scale * scale, 1e-13 * scale),
            max_step=step,
            first_step=1e-3 if speed == 0.0 else None,
        )
        tau += solution.t[-1]
        speed = eta * abs(solution.y[1, -1])
        side = -side
        if speed < VELOCITY_TOLERANCE:
            return tau
    return math.nan


def seconds_per_call(function):
    """Least processor time of some calls."""
    best = math.inf
    for _ in range(REPETITIONS):
        start = time.process_time()
        function()
        best = min(best, time.process_time() - start)
    return best


def cases():
    """Arrays of parameters to time."""
    rng = np.random.default_rng(1)
    ones = np.ones(LARGE)
    eta = rng.uniform(0.5, 0.97, LARGE)
    omega = rng.uniform(0.5, 8.0, LARGE)
    critical = chattering.critical_amplitude(omega, eta, method="approximation")
    share = rng.uniform(0.0, 1.0, LARGE)
    return {
        "the paper's case (1.03, 2, 0.92)": (CASE[0] * ones, CASE[1] * ones, CASE[2] * ones),
        "random, all complete": (1.0 + share * (critical - 1.0), omega, eta),
        "random, half of them complete": (1.0 + 2.0 * share * (critical - 1.0), omega, eta),
    }


def main():
    """Print the table."""
    baseline = seconds_per_call(lambda: scipy_chattering_time(*CASE))
    error = abs(scipy_chattering_time(*CASE) / CASE_TIME - 1.0)
    print(f"SciPy DOP853, an event per impact: {1e3 * baseline:.1f} ms, relative error {error:.0e}")
    for name, parameters in cases().items():
        times = chattering.chattering_time(*parameters)
        start = time.perf_counter()
        chattering.chattering_time(*parameters)
        wall = time.perf_counter() - start
        replaced = vars(duration)
        cores, replaced["cores"] = replaced["cores"], lambda: 1
        each = seconds_per_call(lambda parameters=parameters: chattering.chattering_time(*parameters)) / LARGE
        replaced["cores"] = cores
        print(f"{name}: {1e9 * each:.0f} ns, {1e-6 / each:.2f} million per second and core")
        incomplete = np.isnan(times).mean()
        print(f"  on {cores()} cores (wall) {1e-6 * LARGE / wall:.2f} million per second, {incomplete:.0%} incomplete")
        if parameters[0].min() == parameters[0].max():
            print(
                f"  {baseline / each:,.0f} times SciPy per core, relative error {abs(times[0] / CASE_TIME - 1.0):.0e}"
            )
    single = seconds_per_call(lambda: [chattering.chattering_time(*CASE) for _ in range(1000)]) / 1000
    print(f"one call for one time: {1e6 * single:.0f} us")
    critical = seconds_per_call(lambda: chattering.critical_amplitude(np.linspace(0.4, 10.0, 200), 0.92)) / 200
    print(f"one exact critical amplitude: {1e6 * critical:.0f} us")
    grid = np.meshgrid(np.linspace(0.4, 10.0, 500), np.linspace(0.5, 0.97, 500))
    surface = seconds_per_call(lambda: chattering.critical_amplitude(*grid, method="approximation"))
    print(f"500 x 500 approximate critical amplitudes: {1e3 * surface:.1f} ms")
    series = seconds_per_call(lambda: [chattering.series_coefficients(2.0, 0.92, order=4) for _ in range(100)]) / 100
    print(f"four coefficients of the series: {1e3 * series:.2f} ms")


if __name__ == "__main__":
    main()
