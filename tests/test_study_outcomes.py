"""Studies that keep chosen outcomes only: the same values in less room, and a sentence where one is missing."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from rocking.studies.product import ALWAYS_KEPT, OUTCOMES

import rocking
from rocking.explorer.studies import StudyView
from rocking.studies import read_study

BLOCKS = rocking.Blocks.grid(p=np.linspace(1.0, 6.0, 130), alpha=[0.1, 0.2, 0.25, 0.3], restitution=[0.85])
FEW = BLOCKS.select(slice(None, None, 27))
MOTIONS = [rocking.pulses.one_sine(1.0, frequency) for frequency in (0.5, 1.0, 2.0)]
LEVELS = [2.0, 4.0, 8.0]
OPTIONS = {"levels": LEVELS, "measure": "pga", "polarity": "both", "model": "linear"}
TWO = ["peak_rotation", "overturned"]
KEPT = ["overturned", "peak_rotation", *ALWAYS_KEPT]


def made(folder, blocks=BLOCKS, **changes):
    return rocking.study(folder, blocks, MOTIONS, **({"outcomes": TWO} | OPTIONS | {"unit_blocks": 512} | changes))


def contents(folder):
    """All that a study is, by its name."""
    files = (path for path in sorted(Path(folder).rglob("*")) if path.is_file())
    return {f"{p.relative_to(folder)}": p.read_bytes() for p in files if p.name not in ("lock", "runs.jsonl")}


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    folder = tmp_path_factory.mktemp("two") / "study"
    made(folder).run(threads=1)
    return folder


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole") / "study"
    made(folder, outcomes=None).run(threads=1)
    return folder


@pytest.fixture(scope="module")
def few_blocks(tmp_path_factory):
    """Study of all outcomes whose blocks are few enough for a fragility of each."""
    study = made(tmp_path_factory.mktemp("few") / "study", FEW, outcomes=None)
    study.run(threads=1)
    return study


@pytest.fixture(scope="module")
def reference():
    return rocking.simulate_many(BLOCKS, MOTIONS, **OPTIONS)


def test_what_is_kept_is_what_simulate_many_computes(complete, reference):
    found = rocking.study(complete).results()
    assert [*found.data_vars] == KEPT
    xr.testing.assert_identical(found.load(), reference[KEPT])
    part = {"motion": 1, "scale": [2, 0], "block": [511, 3, 512]}
    xr.testing.assert_identical(rocking.study(complete).results().isel(part).load(), reference[KEPT].isel(part))


def test_a_unit_holds_only_what_is_kept(complete, whole):
    units = {name: len(data) for name, data in contents(complete).items() if name.startswith("result/c.")}
    more = contents(whole)
    assert units.keys() == {name for name in more if name.startswith("result/c.")}
    for name, size in units.items():
        assert size == pytest.approx(8 * 512 * len(KEPT), abs=100)
        assert len(more[name]) == pytest.approx(8 * 512 * len(OUTCOMES), abs=100)


@pytest.mark.parametrize(
    "outcomes", [None, OUTCOMES, OUTCOMES[::-1], [name for name in OUTCOMES if name not in ALWAYS_KEPT]]
)
def test_without_a_choice_or_with_all_outcomes_a_study_keeps_all(few_blocks, tmp_path, outcomes):
    made(tmp_path, FEW, outcomes=outcomes).run(threads=1)
    found = contents(tmp_path)
    assert found == contents(few_blocks.place)
    about = json.loads(found["study.json"])
    assert (about["format"], about["outcomes"]) == (3, [*OUTCOMES])


def test_the_order_of_the_store_is_that_of_the_outcomes_and_those_always_kept_may_be_named(complete, tmp_path):
    made(tmp_path, outcomes=["stopped", "overturned", "peak_rotation"]).run(threads=2)
    assert contents(tmp_path) == contents(complete)
    about = json.loads(contents(complete)["study.json"])
    assert (about["format"], about["outcomes"]) == (3, KEPT)


def test_a_unit_of_another_choice_is_damage(complete, whole, tmp_path):
    study = made(tmp_path)
    study.run(threads=1)
    name = "result/c.0.0.0.0.0"
    (tmp_path / name).write_bytes(contents(whole)[name])
    (fault,) = study.verify()
    assert "c.0.0.0.0.0 is damaged, it holds 53248 bytes, not 20480" in fault


@pytest.mark.parametrize(
    ("before", "after", "sentence"),
    [
        (TWO, None, "the outcomes (overturned, peak_rotation, stalled, unfinished, stopped then; all now) changed"),
        (None, ["rests"], "the outcomes (all then; rests, stalled, unfinished, stopped now) changed"),
        (
            ["rests"],
            ["impacts"],
            "(rests, stalled, unfinished, stopped then; impacts, stalled, unfinished, stopped now)",
        ),
    ],
)
def test_another_choice_is_refused_with_what_it_was(tmp_path, before, after, sentence):
    made(tmp_path, outcomes=before)
    with pytest.raises(rocking.StudyError, match=re.escape(sentence)):
        made(tmp_path, outcomes=after)
    assert made(tmp_path, outcomes=before).status.units == 36


@pytest.mark.parametrize(
    ("outcomes", "sentence"),
    [
        ("overturned", "outcomes must be a list, not 'overturned'"),
        ([], "outcomes must name one or more of overturned, peak_rotation, "),
        (["overturned", "peak"], "each of outcomes must be one of overturned, peak_rotation, .*, not 'peak'"),
        (["rests", "overturned", "rests"], "outcomes names rests more than once"),
    ],
)
def test_a_choice_that_is_none_is_one_sentence_before_anything_is_made(tmp_path, outcomes, sentence):
    with pytest.raises(rocking.InvalidOption, match=sentence) as caught:
        made(tmp_path / "study", outcomes=outcomes)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "study").exists()


def test_what_is_made_of_two_outcomes_is_what_is_made_of_all(few_blocks, tmp_path):
    two, all_ = made(tmp_path, FEW), few_blocks
    two.run(threads=1)
    limits = {"overturning": np.inf, "half": 0.5}
    assert two.block_fragilities(limits=limits).data.identical(all_.block_fragilities(limits=limits).data)
    assert two.fragility(limits=limits).to_dict() == all_.fragility(limits=limits).to_dict()
    assert two.spectrum().data.identical(all_.spectrum().data)
    assert two.critical_scales().identical(all_.critical_scales())


def test_motions_of_a_study_that_belong_together_count_as_those_of_a_fragility_do(tmp_path):
    motions = [rocking.pulses.one_sine(1.0, frequency) for frequency in np.linspace(0.3, 1.5, 12)]
    blocks, levels = rocking.Blocks.grid(p=[1.8, 2.0], alpha=[0.2], restitution=[0.9]), np.geomspace(2.0, 6.0, 6)
    labels = [k // 3 for k in range(len(motions))]
    study = rocking.study(tmp_path, blocks, motions, levels=levels, unit_blocks=512)
    study.run(threads=1)

    def expected(chosen):
        curve = rocking.fragility(chosen, motions, levels=levels, clusters=labels).curves[0]
        assert curve.clusters == 4 and 0.0 < curve.median_interval[0] < curve.median_interval[1] < np.inf
        return pytest.approx(curve.median_interval, rel=1e-6)

    assert study.fragility(clusters=labels).curves[0].median_interval == expected(blocks)
    each = study.block_fragilities(clusters=labels).data.isel(block=1, limit_state=0)
    assert (float(each.median_lower), float(each.median_upper)) == expected(blocks.select(slice(1, 2)))


def test_overturning_alone_is_enough_for_its_own_fragility_and_for_no_more(few_blocks, tmp_path):
    study = made(tmp_path, FEW, outcomes=["overturned"])
    study.run(threads=1)
    assert study.fragility().to_dict() == few_blocks.fragility().to_dict()
    assert study.block_fragilities().data.identical(few_blocks.block_fragilities().data)
    lacking = "needs peak_rotation, and the study keeps only overturned, stalled, unfinished, stopped: create one with"
    for make, what in (
        (study.spectrum, "a spectrum"),
        (lambda: study.fragility(limits={"overturning": np.inf, "half": 0.5}), "limits.half"),
        (lambda: study.block_fragilities(limits={"half": 0.5}), "limits.half"),
    ):
        with pytest.raises(rocking.InvalidOption, match=f"^{what} {lacking}") as caught:
            make()
        assert str(caught.value).endswith('outcomes = ["overturned", "peak_rotation"]')


def test_what_was_stopped_is_no_verdict_whatever_is_kept(tmp_path):
    study = made(tmp_path, outcomes=["overturned"], duration=0.5)
    study.run(threads=1)
    assert study.results().stopped.values.any()
    with pytest.raises(rocking.StudyError, match="without a duration"):
        study.fragility()


def test_rests_alone_are_enough_for_nothing_else(tmp_path):
    study = made(tmp_path, outcomes=["rests"])
    study.run(threads=1)
    for make, sentence in (
        (study.fragility, "a fragility needs overturned, and"),
        (study.spectrum, "a spectrum needs overturned and peak_rotation, and"),
        (study.critical_scales, "a critical scale of overturning needs overturned, and"),
        (
            lambda: study.critical_scales("complete_chattering"),
            "a critical scale of complete chattering needs complete_chattering, and",
        ),
    ):
        with pytest.raises(rocking.InvalidOption, match=sentence):
            make()


def test_an_export_has_a_column_for_each_outcome_that_is_kept(complete, tmp_path, reference):
    pandas = pytest.importorskip("pandas")
    rocking.study(complete).to_csv(tmp_path / "all.csv")
    table = pandas.read_csv(tmp_path / "all.csv")
    assert [*table.columns][-5:] == ["overturned", "peak_rotation_rad", *ALWAYS_KEPT]
    assert not {"impacts_resolved", "rests"} & {*table.columns}
    np.testing.assert_array_equal(table.peak_rotation_rad, reference.peak_rotation.values.ravel())


def test_the_explorer_draws_what_is_kept(complete, tmp_path, reference):
    view = StudyView(complete)
    assert view.describe()["quantities"] == ["overturned", "peak_rotation"]
    drawn = view.slice({"x": "p", "y": "alpha", "quantity": "peak_rotation"}).arrays["values"].reshape(4, 130)
    np.testing.assert_array_equal(drawn.T.ravel(), reference.peak_rotation.values[0, 0, 0])
    with pytest.raises(rocking.InvalidOption, match="quantity must be one of overturned, peak_rotation, not"):
        view.slice({"x": "p", "y": "alpha", "quantity": "impacts"})
    made(tmp_path / "few", outcomes=["uplifts"]).run(threads=1)
    with pytest.raises(rocking.StudyError, match=r"keeps only uplifts, .*; a map needs one of overturned, peak"):
        StudyView(tmp_path / "few")


TEXT = """\
[blocks]
p = [1.5, 2.0, 3.0]
alpha = [0.1, 0.2]

[[motions.pulses]]
family = "one_sine"
amplitude = 1.0
frequency = "0.3:1.6:9"

[scales]
pga = "1:9:8"

[simulation]
outcomes = ["peak_rotation", "overturned"]

[report.fragility]
measure = "pga"
limits = { overturning = inf, half = 0.5 }

[report.spectrum]
"""


@pytest.mark.thorough
def test_a_file_chooses_outcomes_and_the_commands_go_on_with_them(run, tmp_path):
    file = tmp_path / "museum.toml"
    file.write_text(TEXT)
    assert read_study(file).outcomes == tuple(KEPT)
    assert run("study", "run", file)[0] == 0
    assert [*rocking.study(tmp_path / "museum").results().data_vars] == KEPT
    assert run("study", "verify", tmp_path / "museum", "--recompute", 2)[0] == 0
    assert run("study", "report", tmp_path / "museum")[0] == 0
    file.write_text(TEXT.replace('"peak_rotation", "overturned"', '"peak_rotation", "overturned", "rests"'))
    code, _, err = run("study", "run", file)
    assert code == 2
    assert "then; overturned, peak_rotation, rests, stalled, unfinished, stopped now) changed" in err
    assert [line.split(": ")[1] for line in err.splitlines()].count("note") == err.count("\n") - 1


@pytest.mark.parametrize(
    ("outcomes", "line", "sentence"),
    [
        ('["rests", "rests"]', 14, "outcomes names rests more than once"),
        ('["overturned"]', 18, "limits.half needs peak_rotation, and the study keeps only overturned"),
    ],
)
def test_a_choice_that_is_none_or_too_little_for_the_report_is_told_with_its_line(tmp_path, outcomes, line, sentence):
    file = tmp_path / "museum.toml"
    file.write_text(TEXT.replace('["peak_rotation", "overturned"]', outcomes))
    with pytest.raises(rocking.StudyError, match=sentence) as caught:
        read_study(file)
    assert str(caught.value).startswith(f"{file}, line {line}: ")
    assert "\n" not in str(caught.value)
