"""Pulses by name, in a text and on the command line: the same motions as from Python, one line for every mistake."""

import json
import math

import numpy as np
import pytest

import rocking
from rocking import pulses
from rocking.chattering import chattering_time
from rocking.inputs.pulses import FAMILIES, PARAMETERS, find_family, named_pulse

G = 9.80665

#: One of each family, as a text and from Python.
EACH = {
    "sine:amplitude=0.2g,frequency=2Hz,cycles=5,phase=90deg": pulses.sine(0.2 * G, 2.0, cycles=5, phase=math.pi / 2),
    "half-sine:amplitude=2,frequency=0.5": pulses.half_sine(2.0, 0.5),
    "one sine:amplitude=2 m/s2,frequency=0.5": pulses.one_sine(2.0, 0.5),
    "one_cosine:amplitude=200gal,frequency=0.5Hz": pulses.one_cosine(2.0, 0.5),
    "n-lobe:amplitude=1,-0.2g,3,frequency=2": pulses.n_lobe([1.0, -0.2 * G, 3.0], 2.0),
    "n-lobe:amplitude=1,frequency=2,lobes=4": pulses.n_lobe(1.0, 2.0, lobes=4),
    "rectangular:amplitude=0.3g,duration=0.5s": pulses.rectangular(0.3 * G, 0.5),
    "triangular:duration=0.5,amplitude=3": pulses.triangular(3.0, 0.5),
    "Ricker:amplitude=3,frequency=1,kind=antisymmetric": pulses.ricker(3.0, 1.0, kind="antisymmetric"),
    "mavroeidis-papageorgiou:amplitude=80cm/s,frequency=0.5,phase=90deg,gamma=2": pulses.mavroeidis_papageorgiou(
        0.8, 0.5, phase=math.pi / 2, gamma=2.0
    ),
}


@pytest.mark.parametrize("text", EACH)
def test_a_text_makes_the_pulse_that_python_makes(text):
    found, wanted = named_pulse(text), EACH[text]
    assert found.description.family == wanted.description.family
    np.testing.assert_allclose(found.breakpoints, wanted.breakpoints, rtol=1e-15)
    np.testing.assert_allclose(found.coefficients, wanted.coefficients, rtol=1e-14, atol=1e-300)


def test_every_pulse_has_a_name_and_every_parameter_a_reader():
    assert {family.make.__name__ for family in FAMILIES.values()} == set(pulses.__all__)
    parameters = {parameter for family in FAMILIES.values() for parameter in (*family.needed, *family.optional)}
    assert parameters == PARAMETERS.keys()  # what is no key of it can be neither read nor listed
    assert {find_family(text.partition(":")[0]).name for text in EACH} == set(FAMILIES)


def test_a_frequency_may_be_in_rad_per_second():
    found = named_pulse("sine:amplitude=1,frequency=2rad/s,cycles=1").description.parameters
    assert found["frequency"] == pytest.approx(2.0 / (2.0 * math.pi), rel=1e-15)


MISTAKES = [
    ("sinus:amplitude=1", "there is no pulse 'sinus'; did you mean sine?"),
    ("zzz:amplitude=1", "there is no pulse 'zzz'; there are half-sine, .* and triangular"),
    ("sine", "the pulse sine also requires amplitude, frequency and cycles"),
    ("sine:amplitude=1,frequency=1", "the pulse sine also requires cycles"),
    ("sine:amplitude=1,frequncy=1", "has no frequncy; did you mean frequency?"),
    ("sine:amplitude=1,zzz=1", "has no zzz; it accepts amplitude, frequency, cycles and phase"),
    ("sine:amplitude=1,amplitude=2", "amplitude is given twice"),
    ("sine:1", "'1' has no name"),
    ("sine:amplitude=1h,frequency=1", "the amplitude of a sine pulse must be an acceleration"),
    ("sine:amplitude=1,frequency=1s", "the frequency of a sine pulse must be a frequency"),
    ("sine:amplitude=1,2,frequency=1", "the amplitude of a sine pulse must be one value, not 1, 2"),
    ("mavroeidis-papageorgiou:amplitude=1g", "must be a velocity"),
    ("rectangular:amplitude=1,duration=1Hz", "must be a time"),
]


@pytest.mark.cases(fast=6)
@pytest.mark.parametrize(("text", "sentence"), MISTAKES)
def test_a_mistake_in_a_text_is_one_sentence(run, text, sentence):
    with pytest.raises(rocking.RockingError, match=sentence):
        named_pulse(text)
    code, out, err = run("simulate", "--pulse", text, "--p", 1, "--alpha", 0.2)
    assert (code, out, err.count("\n")) == (2, "", 1)


# The command line


SINE = "sine:amplitude=0.206g,frequency=2rad/s,cycles=2.5"
BLOCK = ("--p", 1, "--alpha", 0.2, "--restitution", 0.92)


def test_the_papers_scheme_is_used_from_the_command_line(run):
    code, out, err = run("simulate", "--pulse", SINE, *BLOCK, "--model", "linear", "--chattering", "time", "--json")
    assert (code, err) == (0, "")
    events = json.loads(out)["events"]
    uplift, rest = (event["time_s"] for event in events[:2])
    # At the first impact after the time of Eq. 65.
    asymptotic = float(chattering_time(1.03, 2.0, 0.92, method="asymptotic"))
    assert asymptotic <= rest - uplift < asymptotic + 1e-3
    assert [event["kind"] for event in events] == ["uplift", "rest"] * 5


def test_the_papers_scheme_is_refused_under_another_pulse(run):
    code, _, err = run("simulate", "--pulse", "triangular:amplitude=3,duration=1", *BLOCK, "--chattering", "time")
    assert code == 2
    assert "sinusoidal motions" in err


@pytest.mark.thorough
def test_pulses_are_scaled_and_go_with_records(run, tmp_path):
    code, out, err = run(
        "simulate", "el-centro-meloland-270", "--pulse", SINE, "--pulse", "half-sine:amplitude=1,frequency=2",
        *BLOCK, "--pga", "0.1g", "--json", "--out", tmp_path, "--each",
    )  # fmt: skip
    assert (code, err) == (0, "")
    found = json.loads(out)["records"]
    assert [entry["record"] for entry in found] == [
        "el-centro-meloland-270", SINE, "half-sine:amplitude=1,frequency=2",
    ]  # fmt: skip
    assert [entry["pga_g"] for entry in found] == pytest.approx([0.1] * 3)
    folders = {path.name for path in tmp_path.iterdir() if path.is_dir()}
    assert len(folders) == 3
    assert not any(":" in name for name in folders)


def test_the_pulses_are_listed_with_their_parameters(run):
    code, out, err = run("pulses")
    assert (code, err) == (0, "")
    for family in FAMILIES.values():
        (line,) = [line for line in out.splitlines() if line.startswith(f"{family.name} ")]
        assert all(parameter in line for parameter in (*family.needed, *family.optional))
    listed = json.loads(run("pulses", "--json")[1])["pulses"]
    assert [entry["name"] for entry in listed] == list(FAMILIES)
    (sine,) = [entry for entry in listed if entry["name"] == "sine"]
    assert sine["needs"] == ["amplitude", "frequency", "cycles"]
    assert sine["units"]["frequency"] == "Hz"


def test_other_commands_take_pulses_too(run):
    code, out, err = run("spectrum", "--pulse", SINE, "--alpha", 0.2, "--p", "1,2", "--restitution", 0.92, "--json")
    assert (code, err) == (0, "")
    assert "sine" in out
    code, _, err = run("ida", "--pulse", "one-sine:amplitude=1,frequency=2", *BLOCK, "--levels", "0.3g,0.5g")
    assert (code, err) == (0, "")
