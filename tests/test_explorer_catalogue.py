"""The list of records: what belongs to one station, what is known of each, how many files are kept."""

from pathlib import Path

import numpy as np
import pytest

import rocking
from rocking.errors import OptionError, RecordError
from rocking.explorer import uploads
from rocking.explorer.catalogue import describe_entries, list_records, read_entries
from rocking.explorer.motions import read_motion
from rocking.explorer.uploads import UploadStore

FORMATS = Path(__file__).parent / "data" / "formats"


def samples(seed, count=400):
    return "\n".join(f"{value:.6g}" for value in np.random.default_rng(seed).normal(size=count))


def groups_of(store, answers=()):
    return [group for group in list_records(store, answers)["groups"] if group["rows"][0]["key"]]


def test_shipped_records_are_listed_by_station_with_their_measures():
    groups = list_records(UploadStore())["groups"]
    assert [group["title"] for group in groups] == [
        "Ridgecrest 2019, China Lake", "Ridgecrest 2019, Tower 2", "Imperial Valley 1979, El Centro Meloland overpass",
    ]  # fmt: skip
    judged = 0
    for group in groups:
        assert [row["is_up"] for row in group["rows"]] == [False, False, True]
        for row in group["rows"]:
            motion = rocking.records.load(row["texts"]["motion"])
            assert row["measures"]["pga"] == motion.pga and row["measures"]["pgv"] == motion.pgv
            assert row["measures"]["significant"] == motion.significant_duration(0.05, 0.95)
            assert row["vertical"] == ("" if row["is_up"] else group["rows"][2]["texts"]["motion"])
            judged += 1
    assert judged == 9 and groups[0]["rows"][0]["title"] == "Ridgecrest 2019, China Lake, 090"


@pytest.mark.parametrize(
    ("names", "found"),
    [
        (["RSN6_I-ELC180.txt", "RSN6_I-ELC270.txt", "RSN6_I-ELC-UP.txt"], [("180", "270", "UP")]),
        (["a_ns.txt", "b_ns.txt", "a_ew.txt", "a_ud.txt"], [("ns", "ew", "ud"), ("",)]),
        (["quake1.txt", "quake2.txt", "quake3.txt"], [("",), ("",), ("",)]),
        (["n.NS", "n.EW", "n.UD"], [("NS", "EW", "UD")]),
        (["s-000.txt", "s-090.txt", "s-180.txt"], [("000", "090"), ("",)]),
        (["t.HNE", "t.HNN", "t.HNZ"], [("HNE", "HNN", "HNZ")]),
    ],
)
def test_components_of_one_station_are_found_by_the_names_of_files(names, found):
    store = UploadStore()
    for seed, name in enumerate(names):
        store.add_file(name, samples(seed).encode())
    groups = groups_of(store)
    assert [len(group["rows"]) for group in groups] == [len(labels) for labels in found]
    for group, labels in zip(groups, found, strict=True):
        assert any(name.lower().startswith(group["title"].lower()) for name in names)
        if len(labels) > 1:
            assert tuple(row["label"] for row in group["rows"]) == labels
            ups = [row for row in group["rows"] if row["is_up"]]
            assert all(row["vertical"] == (ups[0]["texts"]["motion"] if ups else "") for row in group["rows"][:2])


def test_another_length_or_step_is_another_station_and_headings_are_believed():
    store = UploadStore()
    store.add_file("a_ns.txt", samples(1).encode())
    store.add_file("a_ew.txt", samples(2, 300).encode())
    assert [len(group["rows"]) for group in groups_of(store)] == [1, 1]
    store = UploadStore()
    east = (FORMATS / "knet.ns").read_bytes()
    for direction in (b"N-S", b"E-W", b"U-D"):
        store.add_file(direction.decode()[0].lower(), east.replace(b"N-S", direction))
    (group,) = groups_of(store)
    assert [row["label"] for row in group["rows"]] == ["N-S", "E-W", "U-D"]
    store = UploadStore()
    key = store.add_file("two.v2", (FORMATS / "two.v2").read_bytes())
    (group,) = groups_of(store)
    assert group["reason"] == "" and len(group["rows"]) == 2
    assert describe_entries([group["rows"][1]["texts"]], store) == [("two.v2, 90 Deg", 0)]
    assert read_motion(group["rows"][1]["texts"], store).motion.pga == group["rows"][1]["measures"]["pga"]
    assert store.list_records() == (key,)


def test_entries_of_one_station_have_one_number():
    store = UploadStore()
    keys = [store.add_file(name, samples(seed).encode()) for seed, name in enumerate(("a-ns.txt", "b.txt", "a-ew.txt"))]
    east = (FORMATS / "knet.ns").read_bytes()
    keys += [store.add_file(name, east.replace(b"N-S", name[:3].encode())) for name in ("N-S", "E-W")]
    two = store.add_file("two.v2", (FORMATS / "two.v2").read_bytes())
    entries = [{"motion": f"file:{key}", "dt": "0.01", "units": "m/s2"} for key in keys[:3]]
    entries += [{"motion": f"file:{key}"} for key in keys[3:]]
    entries += [{"motion": f"file:{two}", "channel": channel} for channel in ("1", "2")]
    shipped = ("el-centro-meloland-360", "ridgecrest-clc-090", "el-centro-meloland-270", "el-centro-meloland-360")
    entries += [{"motion": name} for name in shipped]
    assert [number for _, number in describe_entries(entries, store)] == [0, 1, 0, 2, 2, 3, 3, 4, 5, 4, 4]


@pytest.mark.parametrize("said", ["names", "headings", "both"])
def test_a_sensor_in_a_borehole_and_one_at_the_surface_have_a_vertical_component_each(said):
    """KiK-net numbers the directions of both from 1 to 6, and names the files as here."""
    store, record = UploadStore(), (FORMATS / "knet.ns").read_bytes()
    kinds = ["EW1", "EW2", "NS1", "NS2", "UD1", "UD2"]
    for seed, kind in enumerate(kinds):
        number = {"NS1": b"1", "EW1": b"2", "UD1": b"3", "NS2": b"4", "EW2": b"5", "UD2": b"6"}[kind]
        data = samples(seed).encode() if said == "names" else record.replace(b"N-S", number)
        store.add_file(f"file {seed}" if said == "headings" else f"TST0019901021800.{kind}", data)
    keys = dict(zip(kinds, store.list_records(), strict=True))
    groups = groups_of(store)
    assert [[row["key"] for row in group["rows"]] for group in groups] == [
        [keys[f"{direction}{sensor}"] for direction in ("EW", "NS", "UD")] for sensor in (1, 2)
    ]
    for group, sensor in zip(groups, (1, 2), strict=True):
        assert [row["vertical"] for row in group["rows"]] == [f"file:{keys[f'UD{sensor}']}"] * 2 + [""]


def test_nothing_is_said_of_a_file_before_its_units_and_step_are_answered():
    store = UploadStore()
    key = store.add_file("a.txt", samples(1).encode())
    (row,) = groups_of(store)[0]["rows"]
    assert set(row["missing"]) == {"dt", "units"} and row["measures"] is None and "units" not in row["texts"]
    assert set(row["raw"]) == {"pga", "duration"}
    (row,) = groups_of(store, [{"key": key, "dt": "0.02", "units": "gal"}])[0]["rows"]
    assert row["missing"] == [] and row["texts"] == {"motion": f"file:{key}", "dt": "0.02", "units": "gal"}
    assert row["measures"]["pga"] == read_motion(row["texts"], store).motion.pga


@pytest.mark.parametrize("other", [{"channel": "2"}, {"dt": 0.02}, {"units": "gal"}])
def test_a_file_that_is_read_otherwise_is_another_motion(other, tmp_path):
    store, path = UploadStore(), tmp_path / "two.txt"
    path.write_text("NS,EW\n" + samples(1).replace("\n", ",0.5\n") + ",0.25\n")
    key = store.add_file("two.txt", path.read_bytes())
    usual = {"channel": "1", "dt": 0.01, "units": "g"}
    for asked in (usual, usual | other, usual):
        motion, own = store.read(key, **asked), rocking.read(path, **asked | {"channel": int(asked["channel"])})
        assert np.array_equal(motion.breakpoints, own.breakpoints)
        assert np.array_equal(motion.coefficients, own.coefficients)


def test_what_is_said_of_a_file_is_said_for_the_step_and_the_units_that_are_given():
    store = UploadStore()
    key = store.add_file("a.txt", samples(1).encode())
    for dt, units, size in ((0.01, "g", 9.80665), (0.01, "gal", 0.01), (0.02, "gal", 0.01), (0.01, "g", 9.80665)):
        ((told,),) = [store.describe_file(key, dt=dt, units=units)["channels"]]
        assert told["measures"]["duration"] == pytest.approx(399 * dt)
        assert told["measures"]["pga"] == pytest.approx(size * np.max(np.abs(np.array(samples(1).split(), float))))


def test_motions_of_the_program_are_told_apart_by_everything_that_is_theirs():
    store, sine = UploadStore(), rocking.pulses.one_sine(2.0, 1.0)
    motions = [sine, sine * 1.5, rocking.pulses.one_sine(2.0, 1.1), *map(sine.with_vertical, (sine, sine * 0.5))]
    keys = [store.add_motion(each) for each in motions]
    assert len({*keys}) == len(motions)
    assert [store.get_motion(key) for key in keys] == motions


@pytest.mark.parametrize(
    ("answer", "words"),
    [({"dt": "0"}, "“Sampling step”"), ({"dt": "soon"}, "“Sampling step”"), ({"units": "furlong"}, "furlong")],
)
def test_a_wrong_answer_is_said_of_its_file_and_leaves_the_list(answer, words):
    store = UploadStore()
    wrong, right = (store.add_file(f"{name}.txt", samples(seed).encode()) for seed, name in enumerate(("odd", "even")))
    given = {"dt": "0.01", "units": "g"}
    groups = groups_of(store, [{"key": wrong, **given, **answer}, {"key": right, **given}])
    assert len(groups) == 2 and [group["rows"][0]["key"] for group in groups] == [wrong, right]
    assert groups[0]["reason"].startswith("odd.txt: ") and words in groups[0]["reason"]
    assert groups[0]["rows"][0]["missing"] == [*answer] and groups[0]["rows"][0]["measures"] is None
    assert groups[1]["reason"] == "" and groups[1]["rows"][0]["missing"] == []


def test_entries_of_an_address_are_those_of_motions_and_not_too_many():
    assert read_entries("") == []
    with pytest.raises(OptionError, match="has 160 entries"):
        read_entries("motion=none;" * 161)
    assert read_entries("motion=" + "n" * 39_993) == [{"motion": "n" * 39_993}]
    with pytest.raises(OptionError, match="40000 letters at most"):
        read_entries("motion=" + "n" * 39_994)


def test_a_file_that_finds_no_room_is_refused_until_one_is_taken_out(monkeypatch):
    store = UploadStore()
    monkeypatch.setattr(uploads, "MAX_FILES", 3)
    keys = [store.add_file(f"{seed}.txt", samples(seed).encode()) for seed in range(3)]
    with pytest.raises(RecordError, match="3 files and 256 MiB are kept at most; remove records from the list"):
        store.add_file("4.txt", samples(4).encode())
    assert store.add_file("1.txt", samples(1).encode()) == keys[1]
    store.describe_file(keys[0])
    store.read(keys[0], dt=0.01, units="g")
    store.remove(keys[0])
    assert store.count_usage()["files"] == 2
    with pytest.raises(RecordError, match="not here any more"):
        store.get_file(keys[0])
    monkeypatch.setattr(uploads, "MAX_BYTES", store.count_usage()["bytes"] + 10)
    with pytest.raises(RecordError, match="cannot be kept"):
        store.add_file("4.txt", samples(4).encode())


def test_new_files_take_none_out_and_of_what_was_read_what_was_used_longest_ago_goes_first(monkeypatch):
    """A motion that is asked for again stays, though it was read first; what goes is read anew from its file."""
    count = 100
    monkeypatch.setattr(uploads, "_MAX_MOTIONS", 3)
    store = UploadStore()
    keys = [store.add_file(f"{seed}.txt", samples(seed, count).encode()) for seed in range(5)]
    assert store.list_records() == tuple(keys)
    first, *_ = [store.read(key, dt=0.01, units="g") for key in keys[:3]]
    assert store.read(keys[0], dt=0.01, units="g") is first
    third = store.read(keys[2], dt=0.01, units="g")
    for k in (0, 3, 0, 4, 0):
        again = store.read(keys[k], dt=0.01, units="g")
        assert len(again.breakpoints) == count and (k != 0 or again is first)
    assert store.read(keys[2], dt=0.01, units="g") is not third
    store.remove(keys[2])
    assert store.list_records() == (keys[0], keys[1], keys[3], keys[4])
    assert store.add_file("2.txt", samples(2, count).encode()) == keys[2]
    assert store.list_records() == (keys[0], keys[1], keys[3], keys[4], keys[2])


def test_a_corrected_record_is_listed_and_read_as_corrected():
    store = UploadStore()
    key = store.add_file("a.csv", "\n".join(f"{0.01 * k:.2f},{0.001 * k}" for k in range(900)).encode())
    given = {"key": key, "units": "g"}
    (plain,) = groups_of(store, [given])[0]["rows"]
    (row,) = groups_of(store, [{**given, "baseline": "1"}])[0]["rows"]
    assert row["texts"] == {"motion": f"file:{key}", "units": "g", "baseline": "1"}
    assert row["measures"]["pga"] < 1e-9 < plain["measures"]["pga"] == pytest.approx(0.899 * 9.80665)
    read = read_motion(row["texts"], store)
    assert (
        read.motion.pga == row["measures"]["pga"]
        and read.expression == "rocking.read('a.csv', units='g', baseline='1')"
    )
    (wrong,) = groups_of(store, [{**given, "baseline": "much"}])
    assert "“Baseline, degree” must be the degree" in wrong["reason"]
    assert wrong["rows"][0]["measures"] == plain["measures"]
    with pytest.raises(OptionError, match="baseline corrects the record of a file"):
        read_motion({"motion": "ridgecrest-clc-090", "baseline": "1"}, store)
