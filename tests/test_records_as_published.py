"""Records as they are downloaded: archives, workbooks, selections, components of a station, offsets of instruments."""

import io
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from oracles import record_files as written

import rocking
from rocking import records, studies
from rocking.cli import main
from rocking.core.progress import notes_for
from rocking.errors import MotionError, RecordError
from rocking.inputs.notes import list_motion_notes
from rocking.records import channels, group_components, identify, read
from rocking.records.formats import source
from rocking.records.formats.source import Request
from rocking.records.named import expand_record_names, load_motion

GRAVITY = 9.80665
G3 = "".join(f"{v:14.6E}" + "\n" * (k % 5 == 4) for k, v in enumerate(written.in_g(written.series(1))))


def packed(files: dict[str, str | bytes]) -> bytes:
    """A ZIP archive."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in files.items():
            archive.writestr(name, text)
    return content.getvalue()


@pytest.fixture
def station(tmp_path: Path) -> Path:
    """A folder with the three files of a station of K-NET."""
    for suffix, direction, seed in (("EW", "E-W", 1), ("NS", "N-S", 2), ("UD", "U-D", 3)):
        (tmp_path / f"TST001.{suffix}").write_text(written.knet(written.counts(seed, 200), direction=direction))
    return tmp_path


def refusal(call: Callable[[], object], error: type[Exception] = RecordError) -> str:
    """The message with which a call fails."""
    with pytest.raises(error) as caught:
        call()
    return str(caught.value)


# Plain numbers, times of the day, workbooks


def test_rows_of_numbers_without_a_heading_are_one_series_if_their_step_is_given(tmp_path: Path) -> None:
    path = tmp_path / "ARL360.g3"
    path.write_text(G3)
    assert identify(path).format == "wrapped numbers"
    motion = read(path, dt=0.005, units="g")
    np.testing.assert_allclose(motion.samples, np.array(written.series(1)) / 100.0, atol=2e-6 * GRAVITY)
    assert (motion.dt, len(motion.samples)) == (0.005, 37)
    assert "each line holds 5 numbers, not one (acceleration) or two" in refusal(lambda: read(path, units="g"))
    assert "give units as one of" in refusal(lambda: read(path, dt=0.005))
    path.write_text("".join(f"{0.01 * k:.2f} {v:.4f} {-v:.4f}\n" for k, v in enumerate(written.series(1))))
    assert "of which the first ones seem to be times" in refusal(lambda: read(path, dt=0.01, units="gal"))


@pytest.mark.parametrize(
    ("first", "rest"),
    [
        ("23:59:59.98", ["23:59:59.99", "24:00:00.00"]), ("00:00:00.00", ["00:00:00.01", "00:00:00.02"]),
        ("2023-12-31T23:59:59.99", ["2024-01-01T00:00:00.00", "2024-01-01T00:00:00.01"]),
        ("2024-02-29 12:00:00.000Z", ["2024-02-29 12:00:00.010Z", "2024-02-29 12:00:00.020Z"]),
    ],
)  # fmt: skip
@pytest.mark.parametrize(
    "heading", ["time,a (g)\n", "Time (hh:mm:ss.sss),a (g)\n", "Time (yyyy-mm-dd hh:mm:ss),a (g)\n"]
)
def test_times_of_the_day_are_read_as_seconds(first: str, rest: list[str], heading: str, tmp_path: Path) -> None:
    path = tmp_path / "logger.csv"
    path.write_text(heading + "".join(f"{time},{k}.5\n" for k, time in enumerate([first, *rest])))
    (channel,) = channels(path)
    assert channel.dt == pytest.approx(0.01, rel=1e-12)
    assert channel.acceleration.tolist() == [0.5 * GRAVITY, 1.5 * GRAVITY, 2.5 * GRAVITY]
    path.write_text(path.read_text().replace(rest[1], first))
    assert "the time does not increase" in refusal(lambda: channels(path))


def test_the_first_sheet_of_a_workbook_is_a_table(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    workbook, path = openpyxl.Workbook(), tmp_path / "record.xlsx"
    workbook.active.append(["time (s)", "NS (cm/s2)", "EW (cm/s2)"])
    for k in range(5):
        workbook.active.append([0.01 * k, 1.5 * k, -2.5 * k])
    workbook.save(path)
    north, east = channels(path)
    assert (north.name, east.name, north.dt) == ("NS", "EW", 0.01)
    np.testing.assert_allclose(east.acceleration, -0.025 * np.arange(5), atol=1e-15)
    path.write_bytes(packed({"xl/workbook.xml": "x", "xl/worksheets/sheet1.xml": "x"}))
    assert "this workbook is damaged or too large" in refusal(lambda: channels(path))


# Archives


def test_an_archive_is_a_folder_of_its_records(station: Path) -> None:
    files = {path.name: path.read_bytes() for path in sorted(station.iterdir())}
    inner = packed({"data/nga.at2": written.fixtures()["nga.at2"], "readme.pdf": b"%PDF", "__MACOSX/x.at2": b""})
    path = station / "all.ZIP"
    path.write_bytes(packed(files | {"inner.zip": inner, "folder/": b""}))
    names = expand_record_names([str(path)])
    assert [name.removeprefix(f"{path}/") for name in names] == [*files, "inner.zip/data/nga.at2"]
    assert expand_record_names([str(station)])[-4:] == names or set(names) < set(expand_record_names([str(station)]))
    for name in names[:3]:
        assert np.array_equal(read(name).samples, read(station / name.rpartition("/")[2]).samples)
    assert read(names[3]).pga == read(written.FOLDER / "nga.at2").pga
    assert "contains 4 files; give one of " in refusal(lambda: read(path))
    assert "there is no such file" in refusal(lambda: read(f"{path}/none.at2"))
    single = station / "one.zip"
    single.write_bytes(packed({"nga.at2": written.fixtures()["nga.at2"]}))
    assert read(single).pga == read(names[3]).pga
    assert load_motion(names[3], vertical_name=names[2]).vertical is not None


def test_a_damaged_archive_is_refused_in_a_sentence(tmp_path: Path) -> None:
    content, path = packed({"a.at2": written.fixtures()["nga.at2"], "b.at2": "x"}), tmp_path / "cut.zip"
    refused = 0
    for k in range(0, len(content), 7):
        for damaged in (content[:k], content[:k] + b"\xff\xff" + content[k + 2 :]):
            path.write_bytes(damaged)
            for name in (str(path), f"{path}/a.at2"):
                try:
                    read(name)
                except RecordError as error:
                    refused += "\n" not in str(error)
    assert refused > 100


def test_archives_in_archives_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    content = packed({"nga.at2": written.fixtures()["nga.at2"]})
    for _ in range(6):
        content = packed({"inner.zip": content})
    path = tmp_path / "deep.zip"
    path.write_bytes(content)
    assert expand_record_names([str(path)]) == [f"{path}/inner.zip/inner.zip/inner.zip"]
    path.write_bytes(packed({"a{}.csv": "0\n" * 99, "b.csv": "1"}))
    assert "give one of " in refusal(lambda: read(path)) and "a{}.csv" in refusal(lambda: read(path))
    monkeypatch.setattr(source, "_MAX_MEMBER_SIZE", 100)
    assert "is larger than 0 MiB; unpack it" in refusal(lambda: read(f"{path}/a{{}}.csv"))


# Selections


@pytest.mark.parametrize("delimiter", [",", ";"])
def test_a_selection_scales_its_files(delimiter: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("one.at2", "two.at2"):
        (tmp_path / name).write_text(written.fixtures()["nga.at2"])
    rows = ["A selection", "", "Id,Scale Factor,Horizontal-1 Filename,Horizontal-2 Filename,Vertical Filename"]
    rows += ["1,1.5,one.at2,two.at2,up.at2", "2,0.25,el-centro-meloland-270,,", "", "notes,no factor,x,y,z"]
    table = tmp_path / "selection.csv"
    table.write_text("\n".join(rows).replace(",", delimiter))
    names = expand_record_names([str(table)])
    assert names == [f"{tmp_path}/one.at2 x 1.5", f"{tmp_path}/two.at2 x 1.5", "el-centro-meloland-270 x 0.25"]
    plain = read(tmp_path / "one.at2").pga
    assert [load_motion(name).pga for name in names[:2]] == [1.5 * plain] * 2
    assert load_motion(names[2]).pga == pytest.approx(0.25 * records.load("el-centro-meloland-270").pga)
    main(["records", str(tmp_path / "one.at2"), f"{tmp_path}/two.at2 x 1.5"])
    assert "two.at2 x 1.5" in capsys.readouterr().out
    study = tmp_path / "study.toml"
    study.write_text('[blocks]\np = 2.0\nalpha = 0.2\n[motions]\nrecords = ["selection.csv", "one.at2 x -2"]\n')
    motions = studies.read_study(study).product.motions
    assert [motion.pga for motion in motions][::3] == [1.5 * plain, 2.0 * plain]
    table.write_text("file,scale\none.at2,large\n")
    message = refusal(lambda: expand_record_names([str(table)]))
    assert "line 2: the scale factor must be a number; got 'large'" in message


def test_a_table_of_accelerations_is_no_selection(tmp_path: Path) -> None:
    table = tmp_path / "record.csv"
    table.write_text("# file of a logger\ntime (s),a (g)\n0,0\n0.01,0.5\n")
    assert expand_record_names([str(table)]) == [str(table)]
    assert read(table).pga == 0.5 * GRAVITY


# Components of a station


def test_components_of_a_station_are_grouped_from_files_an_archive_or_one_file(station: Path) -> None:
    archive = station.parent / f"{station.name}.zip"
    archive.write_bytes(packed({path.name: path.read_bytes() for path in station.iterdir()}))
    for names in (station, archive, sorted(station.iterdir())):
        (group,) = group_components(names)
        assert [motion.name for motion in group.pair] == ["TST001 E-W", "TST001 N-S"]
        assert group.vertical is not None and group.vertical.name == "TST001 U-D"
        assert (group.station, group.event) == ("TST001", "1999/01/02 18:00:00, magnitude 5.7")
    (geonet,) = group_components(written.FOLDER / "geonet.v1a")
    assert [motion.description.origin.azimuth for motion in geonet.pair] == [10.0, 280.0]
    north = geonet.pair[0].rotated(geonet.pair[1], 0.0)
    assert north.pga > 0.0


def test_sensors_at_different_places_are_not_paired(tmp_path: Path) -> None:
    for sensor in range(1, 7):
        text = written.knet(written.counts(sensor, 200), direction=str(sensor))
        (tmp_path / f"TSTH01.{sensor}").write_text(text)
    below, surface = group_components(tmp_path)
    assert [motion.name for motion in below.pair] == ["TST001 N-S borehole", "TST001 E-W borehole"]
    assert [motion.name for motion in surface.pair] == ["TST001 N-S", "TST001 E-W"]
    (depth,) = [each for each in list_motion_notes(below.pair[0]) if "below the ground" in each]
    assert depth == "the channel 'N-S borehole' is below the ground surface, where motions are weaker"
    assert not any("below the ground" in each for each in list_motion_notes(surface.pair[0]))


def test_what_is_no_pair_or_unreadable_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("nga.at2", "nga.vt2"):
        (tmp_path / name).write_text(written.fixtures()[name])
    with notes_for("everybody"):
        (group,) = group_components(tmp_path)
    assert "contains 'velocity'" in capsys.readouterr().err
    assert "has 1 horizontal component, not two: Town Hall 090" in refusal(lambda: group.pair)
    assert "no record could be read; the first: " in refusal(lambda: group_components(tmp_path / "nga.vt2"))


# Offsets


def test_the_offset_of_an_instrument_is_removed_by_default_and_noted(
    station: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name = str(station / "TST001.EW")
    (channel,) = channels(name)
    kept, removed = read(name, baseline="none"), read(name)
    assert np.array_equal(kept.samples, channel.acceleration) and not kept.history
    np.testing.assert_allclose(removed.samples, channel.acceleration - channel.acceleration.mean(), atol=1e-14)
    line, filtered = read(name, baseline=1), read(name, highpass=2.0)
    assert abs(np.polyfit(line.times, line.samples, 1)).max() < 1e-12
    assert filtered.history == ("baseline of degree 0 removed", "band-passed 2-inf Hz, order 4 forwards and backwards")
    with notes_for("everybody"):
        load_motion(name, Request(baseline="none"))
        assert capsys.readouterr().err == ""
        load_motion(name)
    note = capsys.readouterr().err
    peaks = [f"{motion.pga:.4g} m/s^2" for motion in (kept, removed)]
    assert all(peak in note for peak in peaks) and "baseline of degree 0 removed, which changes the peak" in note
    for bad in ("mean", -1, 2.5):
        assert "baseline" in refusal(lambda bad=bad: read(name, baseline=bad), MotionError)


@pytest.mark.parametrize(
    ("options", "keys", "corrections"),
    [
        ([], "", {}), (["--baseline", "none"], 'baseline = "none"', {"baseline": "none"}),
        (["--baseline", "2", "--highpass", "0.5"], "baseline = 2\nhighpass = 0.5", {"baseline": 2, "highpass": 0.5}),
    ],
)  # fmt: skip
def test_commands_and_studies_correct_records_as_read_does(
    options, keys, corrections, station: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name = str(station / "TST001.EW")
    wanted = read(name, **corrections).pga
    main(["records", name, "--json", *options])
    assert f'"pga_g": {wanted / GRAVITY:.6f}'[:16] in capsys.readouterr().out
    main(["simulate", name, "--width", "0.24", "--height", "1.1", "--json", *options])
    assert f"{wanted:.6f}"[:7] in capsys.readouterr().out
    study = station / "study.toml"
    study.write_text(f'[blocks]\np = 2.0\nalpha = 0.2\n[motions]\nrecords = ["TST001.EW"]\n{keys}\n')
    assert studies.read_study(study).product.motions[0].pga == wanted
    tests = station / "tests.csv"
    tests.write_text("motion,overturned\nTST001.EW,0\n")
    assert rocking.read_tests(tests, **corrections)[0].motion.pga == wanted


def test_shipped_records_are_corrected_only_on_request() -> None:
    plain = records.load("el-centro-meloland-270")
    assert np.array_equal(load_motion("el-centro-meloland-270").samples, plain.samples)
    assert load_motion("el-centro-meloland-270", Request(highpass=0.05)).history


def test_uneven_samples_cannot_be_filtered() -> None:
    sentence = "highpass requires samples at even steps; resample the record in Python first"
    assert sentence in refusal(lambda: read(written.FOLDER / "film.smc", highpass=0.1), MotionError)


def test_corrections_apply_to_shipped_records_in_pairs(capsys: pytest.CaptureFixture[str]) -> None:
    """A pair of shipped records is filtered as single ones are, with a note on the peaks."""
    with notes_for("everybody"):
        first, _ = rocking.records.load_pairs("ridgecrest-clc-*", baseline=0, highpass=0.1)
    alone = rocking.records.load("ridgecrest-clc-090").processed(baseline=0, band_pass=(0.1, None))
    assert first.pga == alone.pga
    assert first.history == alone.history
    assert "ridgecrest-clc-090: baseline of degree 0 removed and band-passed" in capsys.readouterr().err


def test_rows_of_spectra_are_no_series(tmp_path: Path) -> None:
    """Wrapped numbers below a heading of spectra are refused even if the step is given."""
    rows = "\n".join(" ".join(f"{0.1 * k + j:.3f}" for j in range(15)) for k in range(20))
    (tmp_path / "a.V3").write_text(f"Response and Fourier amplitude spectra\n of 86 periods\n{rows}\n")
    message = refusal(lambda: read(tmp_path / "a.V3", dt=0.01, units="g"))
    assert "this seems to be a response spectrum: its heading names spectra" in message


def test_an_assessment_under_vertical_records_alone_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "inventory.csv").write_text("name,width,height\nvase,0.24,1.1\n")
    folder = tmp_path / "records"
    folder.mkdir()
    (folder / "TST001.UD").write_text(written.knet(written.counts(6, 200), direction="6"))
    with pytest.raises(SystemExit, match="2"):
        main(["assess", str(tmp_path / "inventory.csv"), str(folder)])
    error = capsys.readouterr().err.splitlines()[-1]
    assert error == "rocking: no motion can be used: TST001.UD: this record is vertical (channel 'U-D')"
