"""Fixtures shared by all tests."""

import functools
import gc
import inspect
import json
import os
import signal
import sys
import tempfile
import traceback
import zlib
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import hypothesis
import numpy as np
import pytest

from rocking.kernels import state

# The same examples on every run, and few; `pytest --hypothesis-profile=default` draws new ones, and more. None of them
# is judged by the clock: on a busy machine all is slow.
hypothesis.settings.register_profile(
    "fixed",
    derandomize=True,
    max_examples=40,
    deadline=None,
    suppress_health_check=[hypothesis.HealthCheck.too_slow],
)
hypothesis.settings.register_profile("few", hypothesis.settings.get_profile("fixed"), max_examples=20)
hypothesis.settings.load_profile("fixed")

# Figures are not looked at here, whatever display there is.
os.environ["MPLBACKEND"] = "agg"


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Look for no garbage while thousands of tests are collected."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_unconfigure() -> None:
    """Look for garbage once in the end: pytest looks ten times, through all that there is."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Spread the cases of a function over the tiers, as its mark `cases` says: mixed, and always in the same way."""
    functions: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("cases"):
            functions.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for cases in functions.values():
        numbers = cases[0].get_closest_marker("cases").kwargs
        cases.sort(key=lambda case: (_tier(case), zlib.crc32(case.nodeid.encode())))
        for case in cases[numbers["fast"] :]:
            case.add_marker("thorough")
        for case in cases[numbers.get("thorough", len(cases)) :]:
            case.add_marker("slow")


def _tier(case: pytest.Item) -> int:
    """Tier of a case by the marks of its own."""
    return 2 if case.get_closest_marker("slow") else 1 if case.get_closest_marker("thorough") else 0


def pytest_configure(config: pytest.Config) -> None:
    """Keep Matplotlib's settings and list of fonts to the tests, and let Ctrl-C be heard."""
    gc.set_threshold(20_000, 25, 10)  # looking for garbage as often as by default takes one part in thirty of the time
    # A user's own settings change what is drawn and said.
    cached = config.pluginmanager.hasplugin("cacheprovider")
    os.environ["MPLCONFIGDIR"] = str(config.cache.mkdir("matplotlib")) if cached else tempfile.mkdtemp()
    # A shell has what it starts in the background ignore Ctrl-C, and so would all that is tested.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def coarsely() -> Callable[[], AbstractContextManager[None]]:
    """Calibrations within it search less and draw less, for what does not hang on how well a block is known."""
    from rocking.calibration import history, search

    @contextmanager
    def shortened() -> Iterator[None]:
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(search, "_SAMPLE_COUNT", 64)
            patched.setattr(search, "_PROPOSAL_ROUND_COUNT", 1)
            patched.setattr(search, "_COMPARISON_ROUND_COUNT", 2)
            patched.setattr(search, "_ANNEALING_EXPONENTS", (0.1, 1.0))
            patched.setattr(search, "_MAX_EXTENSIONS", 0)
            patched.setattr(history, "_START_COUNT", 256)
            patched.setattr(history, "_FIT_STAGES", ((0.15, 6), (0.3, 3), (1.0, 1)))
            patched.setattr(history, "_CLOUD_POINT_COUNT", 16)
            yield

    return shortened


@pytest.fixture
def coarse(coarsely: Callable[[], AbstractContextManager[None]]) -> Iterator[None]:
    """Calibrations of one test that search less."""
    with coarsely():
        yield


#: Errors of doubles since the test began.
FAULTS: list[Exception] = []
MISTAKES = (AssertionError, AttributeError, LookupError, NameError, TypeError)


def as_taken(real: Callable[..., Any], double: Callable[..., Any]) -> Callable[..., Any]:
    """Double that takes what a function takes, and whose own mistakes fail the test, whoever catches them.

    What a double raises on purpose is any other error.
    """
    signature = inspect.signature(real)

    @functools.wraps(double)
    def called(*arguments: Any, **options: Any) -> Any:
        try:
            signature.bind(*arguments, **options)
            return double(*arguments, **options)
        except MISTAKES as error:
            *_, (frame, _) = traceback.walk_tb(error.__traceback__)
            if frame.f_code.co_filename.startswith((str(TESTS), inspect.__file__)):
                FAULTS.append(error)
            raise

    return called


class MonkeyPatch(pytest.MonkeyPatch):
    """One that holds doubles of functions to what these take."""

    def setattr(self, *arguments: Any, **options: Any) -> None:
        super().setattr(*arguments, **options)
        owner, name, real = self._setattr[-1]
        double = inspect.getattr_static(owner, name)
        if inspect.isfunction(double) and (inspect.isfunction(real) or inspect.ismethod(real)):
            super().setattr(owner, name, as_taken(real, double))


@pytest.fixture
def monkeypatch() -> Iterator[pytest.MonkeyPatch]:
    """Replace attributes for the time of a test, which fails where a double does something that it does not mean to."""
    with MonkeyPatch.context() as patched:
        yield patched
    faults = FAULTS.copy()
    FAULTS.clear()
    if faults:
        raise faults[0]


TESTS = Path(__file__).resolve().parent
SHARED = TESTS.parents[1] / "shared"


@pytest.fixture(scope="session", autouse=True)
def _no_waiting_for_disks() -> Iterator[None]:
    """Let no test wait until a disk has confirmed what it writes; tests of that replace the call themselves."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(os, "fsync", lambda file: None)
        yield


@pytest.fixture(autouse=True)
def _no_pyplot_stays() -> Iterator[None]:
    """Forget pyplot after a test that has loaded it: from then on it would be told of every figure, and keep them."""
    yield
    if (pyplot := sys.modules.pop("matplotlib.pyplot", None)) is not None:
        pyplot.close("all")


@pytest.fixture
def unarranged(monkeypatch: pytest.MonkeyPatch) -> None:
    """Write figures as they are, without a layout, in a third of the time: `test_figures.py` looks at layouts."""
    from matplotlib.figure import Figure

    saved = Figure.savefig

    def save(figure: Figure, *arguments: Any, **options: Any) -> None:
        layout = figure.get_layout_engine()
        figure.set_layout_engine("none")
        saved(figure, *arguments, **options)
        figure.set_layout_engine(layout)

    monkeypatch.setattr(Figure, "savefig", save)


@pytest.fixture
def run(unarranged: None, capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """Run the command line: exit code, output, and errors."""
    from rocking.cli import main

    def call(*arguments: object) -> tuple[int, str, str]:
        code = 0
        try:
            main([str(argument) for argument in arguments])
        except SystemExit as stop:
            code = int(stop.code or 0)
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return call


@pytest.fixture
def small_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give simulations of ensembles up soon."""
    monkeypatch.setattr("rocking.engine.tasks.STEP_BUDGET", 0)


@pytest.fixture(scope="session")
def few_steps() -> Callable[[int], AbstractContextManager[None]]:
    """Single simulations within it are given up after so many steps."""

    @contextmanager
    def limited(steps: int) -> Iterator[None]:
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr("rocking.simulation.simulate.count_slices", lambda ground: 1)
            patched.setattr("rocking.simulation.simulate.STEPS_PER_SLICE", steps)
            yield

    return limited


@pytest.fixture
def undrawn(monkeypatch):
    """Make figures and their files, but draw nothing into these."""
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda figure, file, **options: file.write(b"not drawn"))


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder with records and reference values that do not ship with the project; absent on most machines."""
    if not SHARED.is_dir():
        pytest.skip("the shared folder with reference data is not on this machine")
    return SHARED


@pytest.fixture(scope="session")
def reference() -> dict[str, Any]:
    """Values of many digits that were computed elsewhere: chattering, and responses to records."""
    path = Path(__file__).parent / "data" / "reference.json"
    values: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return values


@pytest.fixture(scope="module")
def parts_run_by_python() -> Iterator[None]:
    """Let Python run the parts of kernels, which only kernels call elsewhere; kernels themselves stay compiled."""
    with pytest.MonkeyPatch.context() as patch, np.errstate(all="ignore"):
        patch.setattr(state, "UNCOMPILED", True)
        yield
