"""Assessment of named objects: the numbers are those of the single analyses, and one failure stops no other object."""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
import xarray as xr

import rocking
from rocking.assessment.assess import assess
from rocking.assessment.chart import list_log_ticks, list_ticks
from rocking.assessment.ranks import compute_scores

FREQUENCIES = (0.5, 0.6, 0.7, 0.85, 1.0, 1.2, 1.5, 2.0)
MOTIONS = {f"{f} Hz": rocking.pulses.one_sine(3.0, f) for f in FREQUENCIES}
HAZARD = rocking.HazardCurve([0.5, 1.0, 2.0, 4.0, 8.0, 16.0], [1e-1, 3e-2, 5e-3, 5e-4, 4e-5, 3e-6])
VASE = rocking.Block(width=0.24, height=1.1).with_labels(name="vase", room="12")
STELE = rocking.Block(width=0.5, height=1.6).with_labels(name="stele", room="14")
TABLE = "name,width,height,room\nvase,0.24,1.1,12\nurn,0.3,-1,12\nstele,0.5,1.6,14\n"


@pytest.fixture(scope="module")
def assessment():
    return assess([STELE, VASE], MOTIONS, hazard=HAZARD, levels=12)


def test_the_fragility_of_each_object_is_that_of_the_object_alone(assessment):
    for item in assessment.objects:
        alone = rocking.fragility(item.body, MOTIONS, levels=item.levels, polarity="both")
        assert item.curve.median == alone.curves[0].median
        assert item.curve.median_interval == alone.curves[0].median_interval
        rate = alone.annual_rate(HAZARD).rate("overturning")
        assert (item.rate.annual_rate, item.rate.interval) == (rate.annual_rate, rate.interval)


def test_outcomes_of_unscaled_records_are_those_of_simulate(assessment):
    compared = 0
    for k, item in enumerate(assessment.objects):
        for m, motion in enumerate(MOTIONS.values()):
            response = rocking.simulate(item.body, motion)
            assert assessment.data.overturned.values[k, m] == response.overturned
            assert assessment.data.peak_over_alpha.values[k, m] == pytest.approx(response.peak_over_slenderness)
            compared += 1
    assert compared == 16


def test_first_levels_bracket_the_level_that_overturns(assessment):
    vase = next(k for k, item in enumerate(assessment.objects) if item.name == "vase")
    analysis = rocking.incremental_dynamic_analysis(VASE, MOTIONS, levels=assessment.objects[vase].levels)
    first = analysis.data.overturning_level.values[:, 0]
    low, high = assessment.objects[vase].first_levels
    is_found = np.isfinite(first)
    assert is_found.sum() >= 4
    assert np.all((low[is_found] <= first[is_found]) & (first[is_found] <= high[is_found]))


def test_objects_are_ranked_by_the_period_and_ranks_have_a_range(assessment):
    assert [item.name for item in assessment.objects] == ["vase", "stele"]
    assert assessment.data.rank_best.values.tolist() == [1, 2]
    same = assess([VASE, VASE.with_labels(name="copy"), STELE], MOTIONS, levels=12)
    assert [item.name for item in same.objects][2] == "stele"
    assert same.data.rank_best.values.tolist() == [1, 1, 3]
    assert same.data.rank_worst.values.tolist() == [2, 2, 3]


def test_every_table_contains_names_and_labels(assessment, tmp_path):
    pytest.importorskip("openpyxl")
    for table, rows in {"objects": 2, "outcomes": 16, "levels": 24}.items():
        frame = assessment.to_dataframe(table)
        assert len(frame) == rows
        assert {*frame["name"]} == {"vase", "stele"}
        assert {*frame["room"]} == {"12", "14"}
    records = assessment.to_dataframe("records")
    assert records["motion"].tolist() == [*MOTIONS]
    assert records["pulse_frequency_Hz"].tolist() == pytest.approx(FREQUENCIES)
    assert records["pga_m_s2"].tolist() == pytest.approx([3.0] * 8)
    assessment.to_netcdf(tmp_path / "a.nc")
    assessment.to_excel(tmp_path / "a.xlsx")
    with xr.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as read:
        assert read["name"].values.tolist() == ["vase", "stele"]
        assert read["median"].values == pytest.approx(assessment.data["median"].values)
    import openpyxl

    assert openpyxl.load_workbook(tmp_path / "a.xlsx").sheetnames == [*assessment.TABLES]


def test_objects_and_motions_that_fail_are_named_and_stop_no_other():
    wall = rocking.Block.one_sided(width=0.4, height=4.0).with_labels(name="wall", friction="0.5")
    nothing = rocking.Motion.from_samples([0.0, 0.0], dt=0.01)
    found = assess([VASE, wall, STELE], MOTIONS | {"silence": nothing}, levels=8)
    assert [item.name for item in found.objects] == ["vase", "stele"]
    assert [*found.failures] == ["wall"]
    assert [*found.skipped] == ["silence"]
    assert "friction is not available for blocks with" in found.failures["wall"]
    assert "silence" not in found.motions
    assert "not assessed: wall" in found.summary()
    assert "not used: silence" in found.summary()
    assert found.to_dataframe("failures")["name"].tolist() == ["wall", "silence"]


def test_labels_of_clusters_are_those_of_the_motions_that_are_used():
    nothing = rocking.Motion.from_samples([0.0, 0.0], dt=0.01)
    labels = [0, 0, 1, 1, 2, 2, 3, 3]
    plain = assess(VASE, MOTIONS, levels=8, clusters=labels)
    more = assess(VASE, {"silence": nothing} | MOTIONS, levels=8, clusters=["none", *labels])
    assert more.objects[0].curve.median_interval == plain.objects[0].curve.median_interval
    assert more.objects[0].curve.cluster_count == 4


def test_ranks_are_those_of_the_same_resampled_motions():
    """Two objects whose intervals overlap widely, but of which one is weaker under every motion, keep their ranks."""
    weaker = rocking.Block(width=0.238, height=1.1).with_labels(name="weaker")
    found = assess([VASE, weaker], MOTIONS, levels=16)
    first, second = found.objects
    assert first.name == "weaker"
    assert first.curve.median_interval[1] > second.curve.median_interval[0]
    assert found.data.rank_worst.values.tolist() == [1, 2]
    assert found.data.rank_best.values.tolist() == [1, 2]
    few = assess([VASE, STELE], dict([*MOTIONS.items()][:2]), levels=16)
    assert few.data.rank_worst.values.tolist() == [2, 2]


def test_weights_of_one_reproduce_the_curve_and_the_rate(assessment):
    """The score of a resample with every motion once is that of the fitted curve."""
    for item in assessment.objects:
        ones = np.ones((1, len(MOTIONS)))
        assert compute_scores(item, ones, None)[0] == pytest.approx(np.log(item.curve.median), abs=1e-9)
        assert compute_scores(item, ones, HAZARD)[0] == pytest.approx(-np.log(item.rate.annual_rate), abs=1e-8)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"levels": 1}, "levels must be"),
        ({"confidence": 2.0}, "confidence must be"),
        ({"years": -1.0}, "years must be"),
        ({"sample_count": 1}, "sample_count must be"),
        ({"measure": "pgv", "hazard": HAZARD}, "must have the same measure"),
        ({"friction": 0.5, "blocks": rocking.Block.one_sided(width=0.4, height=4.0)}, "no object can be assessed"),
        ({"motions": rocking.Motion.from_samples([0.0, 0.0], dt=0.01)}, "no motion can be scaled"),
    ],
)
def test_wrong_arguments_are_refused(arguments, sentence):
    with pytest.raises(rocking.RockingError, match=sentence):
        assess(**{"blocks": VASE, "motions": MOTIONS, **arguments})


def test_an_object_that_no_level_overturns_has_a_bound_instead_of_a_curve():
    found = assess([VASE, STELE], MOTIONS, hazard=HAZARD, levels=[0.1, 0.2, 0.3])
    assert [item.curve for item in found.objects] == [None, None]
    assert all("exceed" in item.fault for item in found.objects)
    assert np.isinf(found.data.overturns_at.values).all()
    # 0.3 m/s^2 is below the first point of the hazard curve, so that nothing is known.
    assert found.tabulate()[1][0][6] == "> 0"
    beyond = assess(VASE, MOTIONS, hazard=rocking.HazardCurve([0.05, 0.2], [1e-1, 1e-3]), levels=[0.1, 0.2, 0.3])
    assert beyond.tabulate()[1][0][6] == "> 1000"  # at 0.2 m/s^2, the last point
    # At no level an object whose friction is too low to rock overturns: it follows those that do.
    sliding = VASE.with_labels(name="sliding", friction=0.05)
    mixed = assess([sliding, VASE, STELE], MOTIONS, levels=12)
    assert [item.name for item in mixed.objects] == ["vase", "stele", "sliding"]


def test_friction_of_a_label_decides_whether_an_object_slides():
    slides = VASE.with_labels(name="slides", friction="0.1")
    rocks = VASE.with_labels(name="rocks", friction="0.5")
    found = assess([slides, rocks], MOTIONS, levels=8)
    by_name = {item.name: item for item in found.objects}
    assert by_name["slides"].slides_first
    assert not by_name["rocks"].slides_first
    k = [item.name for item in found.objects].index("slides")
    assert not found.data.overturned.values[k].any()
    assert found.data.largest_slip.values[k].max() > 0.0
    alone = rocking.simulate_many(VASE, MOTIONS, friction=0.1)
    assert found.data.largest_slip.values[k] == pytest.approx(alone.largest_slip.values[:, 0])


def test_an_uncertain_object_is_sampled(tmp_path):
    path = tmp_path / "inventory.csv"
    path.write_text("name,width,height\nknown,0.24,1.1\nuncertain,0.24 +- 0.03,1.1\n")
    inventory = rocking.read_inventory(path)
    found = {item.name: item for item in assess(inventory, MOTIONS, levels=10, sample_count=20).objects}
    assert (found["known"].sample_count, found["uncertain"].sample_count) == (1, 20)
    assert found["uncertain"].curve.dispersion > found["known"].curve.dispersion
    pooled = rocking.fragility(inventory.sample(1, 20), MOTIONS, levels=found["uncertain"].levels, polarity="both")
    assert found["uncertain"].curve.median == pooled.curves[0].median


class Page(HTMLParser):
    """Text of a page, and its links, tags and sources."""

    def __init__(self, text):
        super().__init__()
        self.words, self.ids, self.links, self.sources = [], set(), set(), []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.ids |= {values["id"]} if "id" in values else set()
        self.links |= {values["href"]} if "href" in values else set()
        self.sources += [(tag, name) for name in values if name in ("src", "srcset")]

    def handle_data(self, data):
        self.words.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())


def test_the_page_is_complete_without_any_other_file(assessment, tmp_path):
    assessment.to_html(tmp_path / "report.html", command="rocking assess <inventory>")
    page = Page((tmp_path / "report.html").read_text())
    assert page.sources == []
    assert page.links == {"#object-1", "#object-2"}
    assert {"object-1", "object-2", "records", "method"} <= page.ids
    assert "rocking assess <inventory>" in page.text
    assert f"rocking {rocking.__version__}" in page.text
    assert len(re.findall("<svg", (tmp_path / "report.html").read_text())) == 1 + 2 + 16
    for name in MOTIONS:
        assert page.text.count(name) >= 3


def test_names_in_a_page_are_text_and_no_markup(tmp_path):
    vase = VASE.with_labels(name="<script>alert(1)</script>", room='"A" & B')
    silence = {"<b>": rocking.Motion.from_samples([0.0, 0.0], dt=0.01)}
    found = assess(vase, MOTIONS | silence, levels=6)
    replace(found, failures={"<b>": "<i>"}).to_html(tmp_path / "r.html")
    text = (tmp_path / "r.html").read_text()
    assert "<script>" not in text
    assert "<i>" not in text
    assert "&lt;script&gt;" in text


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (0.0, 0.43), (2.0, 2.3), (0.0, 1e-5), (0.0, 5000.0)])
def test_ticks_are_round_and_inside(low, high):
    ticks = list_ticks(low, high)
    assert 2 <= len(ticks) <= 9
    assert all(low <= tick <= high * (1 + 1e-12) for tick in ticks)
    assert all(len(f"{tick:g}") <= 6 for tick in ticks)
    assert all(0.1 <= tick <= 7.0 for tick in list_log_ticks(0.1, 7.0))


def test_the_command_writes_the_report_and_names_what_it_leaves_out(run, tmp_path):
    (tmp_path / "inventory.csv").write_text(TABLE)
    (tmp_path / "hazard.csv").write_text("pga_g,annual_rate\n0.05,3e-2\n0.2,3e-3\n0.8,1e-4\n")
    records = tmp_path / "records"
    records.mkdir()
    (records / "read me.txt").write_text("These are the records.\n")
    for name, motion in MOTIONS.items():
        rows = [
            f"{t:.3f},{a:.6f}"
            for t, a in zip(np.arange(0, 3, 0.01), motion.acceleration(np.arange(0, 3, 0.01)), strict=True)
        ]
        (records / f"{name}.csv").write_text("time (s),acceleration (m/s2)\n" + "\n".join(rows))
    out = tmp_path / "report"
    arguments = ("--hazard", tmp_path / "hazard.csv", "--count", "8", "--out", out)
    code, printed, err = run("assess", tmp_path / "inventory.csv", records, *arguments)
    assert code == 0, err
    assert {file.name for file in out.iterdir()} >= {"report.html", "assessment.nc"}
    assert "2 objects under 8 motions" in printed
    assert "not assessed: urn (line 3): height must be" in printed
    assert re.search(r"not used: .*read me\.txt: the format of this text is unknown", printed)
    page = Page((out / "report.html").read_text()).text
    assert "urn (line 3)" in page
    assert "2.0 Hz.csv" in page
    for options, sentence in (
        (
            ("--measure", "pgv"),
            "--measure must be the measure of the hazard curve, peak ground acceleration (g): omit it",
        ),
        (
            ("--floor", "period=0.4,damping=0.05"),
            "--hazard describes the ground, not the motion of --floor: omit one of them",
        ),
    ):
        code, _, err = run("assess", tmp_path / "inventory.csv", records, *arguments, *options)
        assert (code, err.splitlines()[-1]) == (2, f"rocking: {sentence}")
    code, printed, _ = run("assess", tmp_path / "inventory.csv", records, "--count", "6", "--json")
    result = json.loads(printed)
    assert [entry["name"] for entry in result["objects"]] == ["vase", "stele"]
    assert len(result["outcomes"]) == 16
    assert [*result["failures"]] == ["urn (line 3)"]
    assert [*result["skipped"]] == [str(records / "read me.txt")]


def write_three_channels(path, first, second):
    """Write a table with two horizontal channels and a vertical one."""
    times = np.arange(0.0, 3.0, 0.01)
    columns = np.column_stack([times, first.acceleration(times), second.acceleration(times), 0.1 * np.sin(times)])
    rows = "\n".join(",".join(f"{value:.6f}" for value in row) for row in columns)
    path.write_text(f"time (s),N-S (m/s2),E-W (m/s2),U-D (m/s2)\n{rows}\n")


def test_both_horizontal_channels_of_a_file_are_a_pair_and_its_vertical_is_named(run, tmp_path):
    (tmp_path / "inventory.csv").write_text(TABLE)
    records = tmp_path / "records"
    records.mkdir()
    motions = [*MOTIONS.values()]
    for k in range(4):
        write_three_channels(records / f"station {k}.csv", motions[k], motions[k + 4])
    code, printed, err = run("assess", tmp_path / "inventory.csv", records, "--count", "8", "--json")
    assert code == 0, err
    result = json.loads(printed)
    names = [entry["motion"] for entry in result["records"]]
    assert names == [f"station {k}.csv, {channel}" for k in range(4) for channel in ("N-S", "E-W")]
    assert [*result["skipped"]] == [f"station {k}.csv, U-D" for k in range(4)]
    peaks = [entry["pga_m_s2"] for entry in result["records"]]
    expected = [motion.pga for k in range(4) for motion in (motions[k], motions[k + 4])]
    assert peaks == pytest.approx(expected, rel=0.01)
    code, printed, _ = run(
        "assess", tmp_path / "inventory.csv", records, "--count", "8", "--component", "rotd50", "--json"
    )
    assert code == 0
    rotated = json.loads(printed)["records"]
    assert [entry["pga_m_s2"] for entry in rotated] == pytest.approx(peaks, rel=1e-12)
    assert all(entry["intensity_m_s2"] != entry["pga_m_s2"] for entry in rotated)
    code, _, err = run("ida", records / "station 0.csv", "--width", "0.3", "--height", "1")
    assert code == 2
    assert "3 channels; give --channel as one of 1 'N-S', 2 'E-W', 3 'U-D'" in err


def test_the_friction_of_a_label_is_that_of_surveys_and_of_comparisons_with_rules():
    block = VASE.with_labels(name="vase", friction="0.1")
    motion = {"0.5 Hz": MOTIONS["0.5 Hz"]}
    slides, rocks = (rocking.simulate(VASE, MOTIONS["0.5 Hz"], friction=friction) for friction in (0.1, None))
    assert (slides.overturned, rocks.overturned) == (False, True)
    for found in (rocking.survey([block, VASE], motion), rocking.rules.compare_rules([block, VASE], motion)):
        assert [response.overturned for response in found.responses] == [False, True]
        assert found.responses[0].peak_rotation == slides.peak_rotation


def test_levels_of_a_measure_that_grows_with_the_square_reach_the_same_factors():
    """With the Arias intensity the levels extend as far as with the PGA."""
    by_pga, by_arias = (assess(VASE, MOTIONS, levels=8, measure=measure) for measure in ("pga", "arias"))
    arias = np.median([motion.arias_intensity for motion in MOTIONS.values()])
    factor = by_pga.objects[0].levels[-1] / 3.0
    assert by_arias.objects[0].levels[-1] == pytest.approx(factor**2 * arias, rel=0.6)
    assert by_arias.objects[0].curve is not None
