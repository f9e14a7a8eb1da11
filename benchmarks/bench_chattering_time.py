"""Chattering times, critical amplitudes and series coefficients per second.

Run ``python benchmarks/bench_chattering_time.py`` from the repository's root. Times are processor times of one core
(other programs do not count), except where it says "wall".
"""

import math
import time
from unittest.mock import patch

import numpy as np

from rocking import chattering
from rocking.chattering import duration
from rocking.core.threads import count_cores

CASE = (1.03, 2.0, 0.92)
REPETITIONS = 5
LARGE = 1_000_000


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
    eta, omega, share = rng.uniform(0.5, 0.97, LARGE), rng.uniform(0.5, 8.0, LARGE), rng.uniform(0.0, 1.0, LARGE)
    critical = chattering.critical_amplitude(omega, eta)
    return {
        "the paper's case (1.03, 2, 0.92)": tuple(value * np.ones(LARGE) for value in CASE),
        "random, all complete": (1.0 + share * (critical - 1.0), omega, eta),
        "random, half of them complete": (1.0 + 2.0 * share * (critical - 1.0), omega, eta),
    }


def main():
    """Print the table."""
    for name, parameters in cases().items():
        start = time.perf_counter()
        incomplete = np.isnan(chattering.chattering_time(*parameters)).mean()
        wall = time.perf_counter() - start
        with patch.object(duration, "cores", lambda: 1):
            each = seconds_per_call(lambda parameters=parameters: chattering.chattering_time(*parameters)) / LARGE
        print(f"{name}: {1e9 * each:.0f} ns, {1e-6 / each:.2f} million per second and core")
        print(
            f"  on {count_cores()} cores (wall) {1e-6 * LARGE / wall:.2f} million per second, "
            f"{incomplete:.0%} incomplete"
        )
    single = seconds_per_call(lambda: [chattering.chattering_time(*CASE) for _ in range(1000)]) / 1000
    critical = seconds_per_call(lambda: chattering.critical_amplitude(np.linspace(0.4, 10.0, 200), 0.92)) / 200
    series = seconds_per_call(lambda: [chattering.series_coefficients(2.0, 0.92, order=4) for _ in range(100)]) / 100
    print(f"one call for one time: {1e6 * single:.0f} us; one exact critical amplitude: {1e6 * critical:.0f} us")
    print(f"four coefficients of the series: {1e3 * series:.2f} ms")


if __name__ == "__main__":
    main()
