"""An installation needs no compiler, computes its first results at once, and the same bits on every processor."""

import json
import os
import subprocess
import sys

import pytest

from rocking.kernels import library

WITHOUT_NUMBA = "import sys; sys.modules['numba'] = sys.modules['llvmlite'] = None\n"

FIRST = """
import time
import rocking
motion = rocking.records.load("el-centro-meloland-270")
response = rocking.simulate(rocking.Block(half_width=0.12, half_height=0.55), motion)
assert "rest" in str(response.summary())
print(time.process_time())
"""

MANY = """
import time
import numpy as np
import rocking
motion = rocking.records.load("el-centro-meloland-270")
blocks = rocking.Blocks(p=np.repeat(np.linspace(1.0, 5.0, 100), 100), alpha=np.tile(np.linspace(0.1, 0.4, 100), 100))
found = rocking.simulate_many(blocks, motion, model={model!r})
assert 0.0 < float(found.overturned.mean()) < 1.0
print(time.process_time())
"""

#: One of everything that calls a kernel; prints the names of those that were called.
EVERYTHING = """
import json
import numpy as np
import rocking
from rocking import chattering
from rocking.kernels import library

called = set()
call = library.Kernel.__call__
def noting(kernel, *arguments):
    called.add(f"{kernel.__module__}.{kernel.__name__}")
    return call(kernel, *arguments)
library.Kernel.__call__ = noting

motion = rocking.records.load("el-centro-meloland-270")
shaken = motion.with_vertical(motion.scaled(0.5))
pulse = rocking.pulses.ricker(4.0, 1.0)
sine = rocking.pulses.sine(3.0, 1.0, cycles=4)
blocks = rocking.Blocks(p=np.linspace(1.0, 4.0, 7), alpha=0.2)
for model in ("linear", "nonlinear"):
    for each in (motion, shaken, pulse):
        response = rocking.simulate(rocking.Block(half_width=0.12, half_height=0.55), each, model=model)
        response.summary()
        rocking.gradient(response)
        rocking.gradient(response, "event", -1)
        rocking.simulate_many(blocks, each, model=model)
# Times as pandas and xarray give them.
times = np.linspace(0.0, 1.0, 5)
times.flags.writeable = False
response.rotation(times)
motion.spectral_acceleration(1.0)
for treatment in (rocking.AsymptoticTime(), rocking.VelocityThreshold(1e-3), rocking.IntervalThreshold(1e-3)):
    block = rocking.Block.from_parameters(p=2.0, alpha=0.1, restitution=0.9)
    rocking.simulate(block, sine, model="linear", chattering=treatment)
for method in ("exact", "semianalytical", "asymptotic", "series"):
    chattering.chattering_time(np.array([1.05, 1.1]), 3.0, 0.9, method=method)
chattering.chattering_time(1.05, 3.0, 0.9)
chattering.first_interval(1.05, 3.0)
chattering.chattering_sequence(1.05, 3.0, 0.9)
chattering.asymptotic_table(1.05, 3.0, 0.9)
chattering.critical_amplitude(3.0, [0.8, 0.9])
chattering.critical_report(3.0, 0.9)
chattering.chattering_report(1.05, 3.0, 0.9)
chattering.chattering_report(8.0, 3.0, 0.9)
motions = [motion.scaled(factor) for factor in np.linspace(0.3, 2.5, 12)]
outcomes = [rocking.simulate(rocking.Block.from_parameters(p=2.0, alpha=0.2), each).overturned for each in motions]
rocking.calibrate(motions, outcomes, model="linear", two_sided=False, candidate_count=256, seed=1)
from rocking import dynamics
ball, table = dynamics.BouncingBall(0.5), rocking.pulses.sine(15.0, 2.0, cycles=1)
rock = dynamics.stroboscopic_map(ball, table)
rock([0.1, 0.5])
rock.derivative([0.1, 0.5])
dynamics.lyapunov_exponents(ball, table, [0.1, 0.5], 20, transient_periods=5)
dynamics.basins(ball, table, [0.01, 0.05], [0.0, 0.1], period_count=10)
mirrored = rocking.Block.from_parameters(p=2.0, alpha=0.6, restitution=0.55)
def swing(amplitude):
    return mirrored, rocking.pulses.sine(amplitude, 0.8, cycles=1)
orbit = dynamics.periodic_orbits(*swing(16.0), model="linear", starts=8)[0]
dynamics.continue_orbit(orbit, swing, 16.0, (15.9, 16.1))
dynamics.simulate(dynamics.ImpactOscillator(1.0, 0.8, damping_ratio=0.1, stop=0.01), table)
print(json.dumps(sorted(name.removeprefix("rocking.kernels.") for name in called)))
"""

#: A digest of many responses, from the library that an argument names.
DIGEST = """
import ctypes
import hashlib
import sys
import numpy as np
import rocking
from rocking.kernels import library

handle = ctypes.CDLL(str(library.FOLDER / sys.argv[1]))
library.open_library = lambda: library.Library(sys.argv[1], handle, library.read_manifest()["kernels"])
digest = hashlib.sha256()
motion = rocking.records.load("el-centro-meloland-270")
n = int(sys.argv[2])
blocks = rocking.Blocks(p=np.repeat(np.linspace(1.0, 5.0, n), n), alpha=np.tile(np.linspace(0.1, 0.4, n), n))
for model in ("linear", "nonlinear"):
    for each in (motion, motion.with_vertical(motion.scaled(0.5))):
        found = rocking.simulate_many(blocks, each, model=model)
        for name in sorted(found.data_vars):
            digest.update(np.ascontiguousarray(found[name].values).tobytes())
omega, eta = np.meshgrid(np.linspace(0.5, 8.0, 20), np.linspace(0.5, 0.95, 20))
digest.update(rocking.chattering.critical_amplitude(omega, eta).tobytes())
digest.update(rocking.chattering.chattering_time(1.02, omega, eta).tobytes())
print(digest.hexdigest())
"""


def answer(code: str, *arguments: str) -> str:
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    command = [sys.executable, "-c", WITHOUT_NUMBA + code, *arguments]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_first_response_takes_less_than_a_second_of_processor_time() -> None:
    assert float(answer(FIRST)) < 1.0


@pytest.mark.thorough
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_ten_thousand_blocks_need_no_compiler(model: str) -> None:
    assert float(answer(MANY.format(model=model))) > 0.0


FRAGILITY = """
import time
import rocking
blocks = rocking.Blocks(p=[2.0, 3.0, 4.0], alpha=0.2)
motions = [rocking.records.load(name) for name in ("el-centro-meloland-270", "ridgecrest-clc-090")]
rocking.fragility(blocks, motions, levels=[2.0, 4.0, 8.0, 16.0])
print(time.process_time())
"""


def test_the_first_fragility_takes_less_than_two_seconds_of_processor_time() -> None:
    # The first process may have to compile the modules of the libraries.
    assert min(float(answer(FRAGILITY)) for _ in range(2)) < 2.0


@pytest.mark.thorough
def test_everything_that_computes_needs_no_compiler() -> None:
    # Only other kernels call this one.
    expected = {*library.open_library().kernels} - {"sine.sequence.find_rest_phase"}
    assert set(json.loads(answer(EVERYTHING))) == expected


#: A digest of a response, an ensemble, a fragility, a spectrum and a study.
KINDS = """
import hashlib
import sys
import tempfile
import numpy as np
import rocking

digest = hashlib.sha256()
motion = rocking.records.load("el-centro-meloland-270")
blocks = rocking.Blocks(p=np.linspace(1.0, 5.0, 5), alpha=0.2)
response = rocking.simulate(rocking.Block(half_width=0.12, half_height=0.55), motion)
digest.update(response.impacts.tobytes() + response.events.tobytes())
found = rocking.fragility(blocks, [motion, motion.scaled(1.5)], levels=[2.0, 4.0, 8.0, 16.0])
spectrum = rocking.rocking_spectrum(blocks, [motion])
digest.update(repr(found.to_dict()).encode() + repr(spectrum.to_dict()).encode())
sets = [rocking.simulate_many(blocks, motion)]
with tempfile.TemporaryDirectory() as folder:
    study = rocking.create_study(folder, blocks, [motion, motion.scaled(2.0)])
    study.run()
    sets.append(study.results().load())
for data in sets:
    for name in sorted(map(str, data.data_vars)):
        digest.update(np.ascontiguousarray(data[name].values).tobytes())
print(digest.hexdigest(), sys.modules.get("numba") is not None)
"""


@pytest.mark.slow
def test_numba_finds_the_same_bits() -> None:
    environment = {**os.environ, "ROCKING_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", KINDS], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == [answer(KINDS).split()[0], "True"]


def test_every_kind_of_analysis_needs_no_compiler(capsys) -> None:
    exec(KINDS, {})
    assert capsys.readouterr().out.split()[0] == answer(KINDS).split()[0]


@pytest.mark.thorough
@pytest.mark.parametrize("n", [4, pytest.param(20, marks=pytest.mark.thorough)])
def test_libraries_of_all_levels_give_the_same_bits(n: int) -> None:
    best = library.open_library().name
    names = [each["file"] for each in library.read_manifest()["libraries"]]
    digests = {answer(DIGEST, name, str(n)) for name in names[: names.index(best) + 1]}
    assert len(digests) == 1
