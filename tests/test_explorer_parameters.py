"""The one specification of the explorer's parameters: it agrees with itself and with the command line."""

import math

import pytest

from rocking.engine.schemes import chattering_scheme
from rocking.errors import OptionError
from rocking.explorer.parameters import PARAMETERS, PULSES, describe_inputs, find_field_label
from rocking.explorer.payload import load_english_texts
from rocking.inputs import quantities
from rocking.inputs.pulses import FAMILIES, named_pulse

#: What the command line takes as an argument, and what it does not do.
NO_OPTIONS = {"motion", "mesh", "gravity", "initial_rotation", "initial_velocity"}

#: What `rocking mesh` takes; of its block `rocking simulate` is given the pivots.
OF_MESHES = {"azimuth", "up", "unit", "density", "tolerance"}


def in_shown_unit(parameter, value):
    value = value[0] if isinstance(value, tuple) else value
    factor = {"°": math.pi / 180.0, "g": 9.80665}.get(parameter.unit, 1.0) if parameter.kind != "number" else 1.0
    return value / factor


def test_every_slider_starts_within_its_ends():
    judged = 0
    for name, parameter in PARAMETERS.items():
        if parameter.low == parameter.high:
            continue
        value = PARAMETERS["pga" if name == "sa" else name].read(parameter.default)
        assert parameter.low < in_shown_unit(parameter, value) < parameter.high, name
        assert parameter.low > 0.0 or not parameter.is_logarithmic, name
        judged += 1
    assert judged >= 14


def test_every_text_of_a_case_is_an_option_of_the_command_line(run):
    for command, options, floor in (
        ("simulate", PARAMETERS.keys() - NO_OPTIONS - OF_MESHES, 20),
        ("mesh", OF_MESHES & PARAMETERS.keys(), 5),
    ):
        _, shown, _ = run(command, "--help")
        assert len(options) >= floor
        assert [name for name in options if f"--{name.replace('_', '-')}" not in shown] == []


@pytest.mark.parametrize("name", PULSES)
def test_a_pulse_of_the_defaults_of_its_fields_can_be_made(name):
    parameters = PULSES[name]["parameters"]
    assert FAMILIES[name].create_motion  # the page has no pulse that the package lacks
    choices = {each: values[0] for each, values in PULSES[name].get("choices", {}).items()}
    given = {**{each.name: each.default for each in parameters}, **choices}
    motion = named_pulse(f"{name}:" + ",".join(f"{each}={text}" for each, text in given.items()))
    assert motion.pga > 0.0


def test_two_sides_are_read_where_a_parameter_may_have_them_and_refused_elsewhere():
    assert PARAMETERS["restitution"].read("0.9,0.8") == (0.9, 0.8)
    assert PARAMETERS["pivots"].read("20cm,0.1") == (0.2, 0.1)
    with pytest.raises(OptionError, match="must be a length"):
        PARAMETERS["width"].read("0.2,0.3")


def test_the_page_reads_every_unit_as_the_program_does():
    judged = 0
    for parameter in (*PARAMETERS.values(), *(each for pulse in PULSES.values() for each in pulse["parameters"])):
        described = parameter.describe()
        kind = "acceleration" if parameter.name == "sa" else parameter.kind
        if kind in ("text", "densities", "length unit"):
            assert described["units"] == {}
            continue
        read = getattr(quantities, f"read_{kind}")
        suffix = described["suffix"] or ("" if parameter.unit != "Hz" else "Hz")
        for spelling, factor in described["units"].items():
            expected = read(f"0.7{spelling}", "x") / read(f"1{suffix}", "x")
            assert 0.7 * factor == pytest.approx(expected, rel=1e-15), (parameter.name, spelling)
            judged += 1
    assert judged >= 150


def test_a_field_is_called_by_its_label_and_another_argument_by_its_name():
    assert find_field_label("gyration") == "“Radius of gyration”"
    assert find_field_label("cycles") == "“Cycles”"
    assert find_field_label("tolerances") == "tolerances"


def test_a_parameter_of_a_pulse_is_called_as_that_pulse_has_it():
    judged = 0
    for name, pulse in PULSES.items():
        for parameter in pulse["parameters"]:
            assert (
                find_field_label(parameter.name, f"{name}:frequency=1")
                == f"“{load_english_texts()[f'field.{parameter.text}']}”"
            )
            judged += 1
    assert judged >= 20
    assert find_field_label("amplitude") == "amplitude"  # of the acceleration, or of the velocity


def test_what_the_page_shows_where_a_text_names_nothing_is_what_the_package_takes():
    judged = 0
    for name, pulse in PULSES.items():
        optional = FAMILIES[name].optional
        for each in pulse["parameters"]:
            if each.name in optional:
                assert each.read(each.default) == optional[each.name]
                judged += 1
        for choice, values in pulse.get("choices", {}).items():
            assert values[0] == optional[choice]
            judged += 1
    limited = [each for each in describe_inputs()["treatments"] if "limit" in each]
    assert [float(each["unnamed"]) for each in limited] == [
        chattering_scheme(each["name"]).threshold for each in limited
    ]
    assert judged >= 2 and len(limited) == 3
