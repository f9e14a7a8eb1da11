"""The promises of docs/reliability.md at a small size, and the program that runs them."""

import datetime
import itertools
import platform
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import verify
from oracles import leapfrog, multiprecision
from oracles.problem import Problem, linear_record
from oracles.rounding import FUSED, PRODUCTS, of_library
from promises import ALL, chattering, compile_cache, containment, cross_code, events, exact, interrupts, one_answer
from promises.promise import Found, Promise

import rocking
from rocking.kernels import compiled

ROOT = Path(__file__).parents[1]


def judge(part: int) -> Found:
    """Judge a case that fails in part 2."""
    found = Found(parts=1, cases=1, judged=1, worst=float(part))
    if part == 2:
        found.fail("two")
    return found


MADE_UP = Promise("made-up", "a promise made up", 4, 1, judge)


@pytest.mark.thorough
def test_responses_are_within_the_stated_error(monkeypatch):
    monkeypatch.setattr(containment, "CASES", 12)
    found = containment.judge(0)
    assert not found.told
    assert found.judged >= 10
    assert found.notes["rotations"] >= 30
    assert found.worst <= 1.0


@pytest.mark.parametrize("cases", [2, pytest.param(12, marks=pytest.mark.thorough)])
def test_no_event_is_missed_and_none_is_made_up(monkeypatch, cases):
    monkeypatch.setattr(events, "CASES", cases)
    found = events.judge(0)
    assert not found.told
    assert found.cases == cases * len(events.KINDS)
    assert found.judged >= 0.7 * found.cases
    assert found.worst <= 1.0


def test_a_wrong_event_would_be_found(monkeypatch):
    """What does not see the event at all, sees another or sees it late is told apart."""
    asked = events.weight(np.random.default_rng(1))
    (true,), (seen,) = asked.true, events.package(asked)[0]
    assert [events._wrong(asked, times, limit=1.0) for times in ([], [seen], [seen, seen], [float(true) * 1.001])] == [
        "missed",
        "",
        "spurious",
        "off",
    ]


@pytest.mark.parametrize("cases", [3, pytest.param(15, marks=pytest.mark.thorough)])
def test_every_rest_is_in_its_bracket_at_a_bounded_cost(monkeypatch, cases):
    monkeypatch.setattr(chattering, "CASES", cases)
    monkeypatch.setattr(chattering, "NEXT_TO_BALANCE", {"linear": cases, "nonlinear": 2})
    found = chattering.judge(0)
    assert not found.told
    assert found.judged == 2 * cases + 2
    resolved, followed = (found.notes[f"{row} at 1e-12"] for row in ("resolved", "one by one"))
    assert resolved < 0.5 * followed


@pytest.mark.slow
def test_another_code_agrees_on_whole_analyses(monkeypatch):
    monkeypatch.setattr(cross_code, "BLOCKS", 30)
    found = cross_code.judge(3)
    found.add(cross_code.judge(4))
    assert not found.told
    assert found.judged >= 55
    assert sum(found.notes[f"{row}: impacts"] for row in ("record, nonlinear", "noise, linear")) >= 1000
    assert found.worst <= 1.0


@pytest.mark.parametrize(("change", "says"), [("peak", "peak"), ("overturned", "overturned")])
def test_another_answer_of_another_code_would_be_found(monkeypatch, change, says):
    """Whatever the other code says of blocks that stay, another peak, or another verdict, is told."""
    monkeypatch.setattr(cross_code, "BLOCKS", 2)
    blocks, shaking, model = cross_code.drawn(2)
    still = cross_code.Shaking("noise", shaking.step, 1e-3 * shaking.across, shaking.up)
    monkeypatch.setattr(cross_code, "drawn", lambda part: (blocks, still, model))
    answer = {"overturned": False, "peak": 0.0, "impacts": 0, "rests": 0}
    monkeypatch.setattr(leapfrog, "follow", lambda *given, **more: leapfrog.Outcome(**answer))
    assert not cross_code.judge(2).told
    answer[change] = {"peak": 1e-6, "overturned": True}[change]
    found = cross_code.judge(2)
    assert found.failures == 4  # two blocks, alone and in an ensemble
    assert all(says in told for told in found.told)


@pytest.mark.slow
def test_the_other_code_agrees_with_many_digits():
    """Short records of all kinds; what does not overturn has the same peak to some thousand units of rounding."""
    worst, moved, fell = 0.0, 0, 0
    for number in range(24):
        rng = np.random.default_rng([67, number])
        p, alpha, e = (tuple(rng.uniform(low, high, 2).tolist()) for low, high in ((1, 6), (0.1, 0.3), (0.5, 0.9)))
        step, count, model = 0.05, int(rng.integers(10, 40)), ("linear", "nonlinear")[number % 2]
        across = 9.80665 * min(alpha) * np.append(rng.normal(0.0, rng.uniform(0.8, 2.0), count), 0.0)
        up = 9.80665 * np.append(rng.uniform(-0.5, 0.5, count) * (number % 3 == 0), 0.0)
        found = leapfrog.follow(model, p, alpha, e, step, across, up)
        problem = Problem(model, p, alpha, e, *linear_record(across, step), vertical=linear_record(up, step))
        true = multiprecision.follow(problem, closest=1e-6, digits=32)
        assert found.overturned == true.overturned
        assert found.rests == sum(event[1] == "rest" for event in true.events)
        moved, fell = moved + (true.peak > 0), fell + true.overturned
        if not true.overturned:
            worst = max(worst, abs(found.peak - float(true.peak)))
    assert moved >= 20
    assert fell >= 2
    assert worst < 1e-12


@pytest.mark.thorough
def test_an_ensemble_has_one_answer(monkeypatch):
    monkeypatch.setattr(one_answer, "BLOCKS", 30)
    found = one_answer.judge(1)
    assert not found.told
    assert found.judged == 8


def test_the_closed_form_of_a_rest_is_the_sum_of_its_impacts():
    sides = exact.Side(2.0, 0.2, 0.6), exact.Side(3.0, 0.1, 0.5)
    time, speed = next(itertools.islice(exact.impacts(sides, 0.3, 0.2, 1), 60, None))
    assert abs(exact.rest(sides, 0.3, 0.2, 1) - time) < 10.0 * speed
    assert abs(exact.rest(sides, 0.3, float(speed), 0) + time - exact.rest(sides, 0.3, 0.2, 1)) < 1e-30


def test_parts_add_up_and_a_failure_is_told():
    total = Found()
    for part in range(4):
        total.add(judge(part))
    assert (total.parts, total.cases, total.failures, total.worst) == (4, 4, 1, 3.0)
    assert MADE_UP.faults(total) == ["made-up: two"]


def test_a_part_that_cannot_be_judged_does_not_stop_the_others(monkeypatch, tmp_path, capsys):
    """With threads in the place of processes, which would not know what is made up here."""

    def fails(part):
        if part == 1:
            raise TimeoutError("too late")
        return judge(0)

    monkeypatch.setattr(verify, "ALL", {"made-up": Promise("made-up", "a promise made up", 4, 1, fails)})
    monkeypatch.setattr(verify, "ProcessPoolExecutor", lambda jobs, **given: ThreadPoolExecutor(jobs))
    assert verify._judged({"made-up": [0, 1, 2]}, {"made-up": tmp_path}, 1) == 1
    assert "made-up 1: not judged: TimeoutError: too late" in capsys.readouterr().out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0.json", "2.json"]
    assert verify._parts(MADE_UP, "kept", tmp_path) == [0, 2]
    assert verify._parts(MADE_UP, "full", tmp_path) == [0, 1, 2, 3]


def test_a_run_of_some_promises_leaves_the_rows_of_the_others(tmp_path):
    verify.write(
        tmp_path, [ALL["soak"], ALL["reading"]], {"soak": Found(6, 12, 12, 0, 0.03, 297.0), "reading": Found()}
    )
    verify.write(tmp_path, [ALL["rounding"]], {"rounding": Found(1, 60, 60, 1, 0.5, 9.0)})
    lines = (tmp_path / "reliability-all.txt").read_text("utf-8").splitlines()
    today = datetime.date.today().isoformat()
    assert len(lines) == 2 + len(ALL)
    assert f"| {ALL['soak'].says} | 6 of 6 | 12 | 12 | 0 | 0.03 | 297 | {today} |" in lines
    assert f"| {ALL['rounding'].says} | 1 of 2 | 60 | 60 | 1 | 0.5 | 9 | {today} |" in lines
    assert sum("not judged yet" in line for line in lines) == len(ALL) - 2
    assert not (tmp_path / "reliability-reading.txt").exists()
    verify.write(tmp_path, [ALL["soak"]], {"soak": Found(6, 13, 13, 0, 0.03, 297.0)})
    assert f"| {ALL['soak'].says} | 6 of 6 | 13 |" in (tmp_path / "reliability-all.txt").read_text("utf-8")


def test_too_few_decided_cases_are_a_fault():
    assert MADE_UP.faults(Found(cases=3, judged=2)) == ["made-up: only 2 of 3 cases were decided"]


def test_the_page_tells_of_every_promise_and_shows_its_table():
    page = (ROOT / "docs" / "reliability.md").read_text("utf-8")
    tables = {f"reliability-{name}.txt" for name in ("all", "made", *(n for n, each in ALL.items() if each.table))}
    assert set(re.findall(r"_tables/(reliability-\S+)", page)) == tables
    for name in ALL:
        assert f"`python stress/verify.py {name}`" in page
    whole = (ROOT / "docs" / "_tables" / "reliability-all.txt").read_text("utf-8")
    for promise in ALL.values():
        assert f"| {promise.says} | " in whole


def test_what_is_kept_is_known_by_its_sources(monkeypatch, tmp_path):
    promise = ALL["containment"]
    before = verify.key(promise)
    assert before == verify.key(promise)
    changed = tmp_path / "containment.py"
    changed.write_text(Path(containment.__file__).read_text("utf-8") + "\n", "utf-8")
    monkeypatch.setattr(containment, "__file__", str(changed))
    assert verify.key(promise) != before


def test_modules_beside_a_promise_count_and_layers_above_do_not(monkeypatch, tmp_path):
    files = [file.name for file in verify._modules(ALL["chattering"].judge.__module__)]
    assert files[0] == "chattering.py"
    assert {"exact.py", "promise.py"} <= {*files}
    package = Path(rocking.__file__).parent
    page, kernel = package / "explorer" / "server.py", package / "kernels" / "march.py"
    assert page.exists() and kernel.exists()
    assert verify._counts(kernel, package, ALL["containment"])
    assert not verify._counts(page, package, ALL["containment"])
    assert verify._counts(page, package, ALL["serving"])
    assert not verify._counts(package / "kernels" / "__pycache__" / "march.pyc", package, ALL["serving"])


@pytest.mark.skipif(sys.platform != "linux", reason="memory and rights of processes are as on Linux")
@pytest.mark.skipif(compiled.UNCOMPILED, reason="nothing is compiled")
@pytest.mark.slow
def test_processes_that_compile_at_once_or_are_killed_leave_right_code(monkeypatch):
    monkeypatch.setattr(compile_cache, "ROUNDS", 2)
    found = compile_cache.judge(0)
    assert not found.told
    assert found.notes["rounds"] == 2
    assert found.notes["killed"] >= 1
    assert found.notes["updates"] == 1
    assert found.notes["damaged files"] >= 3
    assert found.judged >= 2 * 6 + len(compile_cache.FOLDERS)


@pytest.mark.skipif(platform.machine() != "x86_64" or sys.platform != "linux", reason="for processors of Intel's kind")
def test_a_fused_operation_in_a_library_would_be_seen(tmp_path):
    if not (shutil.which("cc") and shutil.which("objdump")):
        pytest.skip("no C compiler or no objdump")
    source, library = tmp_path / "a.c", tmp_path / "a.so"
    source.write_text("double f(double a, double b, double c) { return a * b + c; }\n")
    for contract, fused in (("fast", 1), ("off", 0)):
        options = ["-O2", "-mfma", f"-ffp-contract={contract}", "-shared", "-fPIC", "-nostdlib"]
        subprocess.run(["cc", *options, "-o", str(library), str(source)], check=True)
        assembly = of_library(library)
        assert len(FUSED.findall(assembly)) == fused
        assert len(PRODUCTS.findall(assembly)) == 1 - fused


@pytest.mark.skipif(sys.platform != "linux", reason="processor time of another process is read as on Linux")
@pytest.mark.thorough
def test_a_fork_is_interrupted_as_a_process_is(tmp_path):
    seconds, whole = interrupts.undisturbed("critical", forked=True)
    assert whole
    found = Found()
    for share in (0.3, 0.6):
        folder = tmp_path / str(share)
        folder.mkdir()
        one = interrupts.ended("critical", folder, share * seconds, forked=True)
        interrupts._judge_end(found, "critical", one, folder / "out", whole)
    assert not found.told
    assert found.cases == 2
