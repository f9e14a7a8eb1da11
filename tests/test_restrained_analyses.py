"""Analyses and studies of walls and of blocks with restraints, against simulations one by one."""

import math
import subprocess
import sys

import numpy as np
import pytest

import rocking
from rocking import Block, Damper, RestrainedBlock, Tendon, Thrust, dynamics
from rocking.errors import BlockError, OptionError
from rocking.simulation.ensemble import body_coordinates

FACADE = RestrainedBlock(Block(width=0.5, height=5.0, mass=6e3), Thrust(8e2, height=4.0), one_sided=True)
LEANING = RestrainedBlock(Block(width=0.5, height=3.0, mass=4e3), Tendon(1e5, prestress=2e3), lean=0.02)
VERTICAL = rocking.pulses.sine(4.0, 2.0, cycles=3)
PULSES = [
    rocking.pulses.one_sine(1.0, 0.8),
    rocking.pulses.one_cosine(1.0, 0.5).with_vertical(VERTICAL),
    rocking.pulses.ricker(1.0, 0.6),
    rocking.pulses.sine(1.0, 0.7, cycles=2, phase=1.0).with_vertical(VERTICAL),
]


@pytest.mark.parametrize("body", [FACADE, LEANING], ids=["facade", "leaning"])
def test_fragility_in_both_polarities_is_that_of_simulations_one_by_one(body):
    levels = [1.7, 2.2, 2.8]
    found = rocking.fragility(
        body, PULSES, levels=levels, polarity="both", limit_states={"part": 0.3, "overturning": math.inf}
    )
    slenderness = min(side.alpha for side in body.sides)
    rows = found.outcomes.set_index(["pga_m_s2", "motion", "polarity"])
    judged = unlike = 0
    for level in levels:
        for name, pulse in zip(rocking.simulate_many(body, PULSES).motion.values, PULSES, strict=True):
            peaks = []
            for polarity, sign in (("+", 1.0), ("-", -1.0)):
                # A negative factor turns the horizontal component alone.
                shaking = pulse.scaled(sign * level / pulse.pga)
                alone, row = rocking.simulate(body, shaking), rows.loc[(level, name, polarity)]
                assert row["overturned"] == alone.overturned
                assert row["peak_rotation_rad"] == pytest.approx(alone.peak_rotation, rel=1e-12)
                assert row["exceeded_part"] == (alone.overturned or alone.peak_rotation > 0.3 * slenderness)
                peaks.append(alone.peak_rotation)
                judged += 1
            unlike += abs(peaks[0] - peaks[1]) > 1e-6
    assert judged == 24
    assert unlike > 4
    assert found.curve("overturning").trial_counts.sum() == 24  # no polarity is left out
    assert found.block is body


@pytest.mark.parametrize("sign", [1.0, pytest.param(-1.0, marks=pytest.mark.thorough)])
def test_bands_of_levels_end_where_simulations_change_their_verdict(sign):
    bodies, motions = [FACADE, RestrainedBlock(FACADE.block, one_sided=True, restitution=0.4)], PULSES[1:3]
    shaken = [motion.scaled(sign) for motion in motions]
    found = rocking.incremental_dynamic_analysis(bodies, shaken, levels=np.geomspace(0.8, 6.0, 12))
    judged = 0
    for m, motion in enumerate(shaken):
        for b, body in enumerate(bodies):
            for start, end in found.bands(block=b, motion=m):
                for edge, inside in ((start, 1.0), (end, -1.0)):
                    if not math.isnan(edge):
                        for off in (-1e-5, 1e-5):
                            factor = edge * (1.0 + off) / motion.pga
                            assert rocking.simulate(body, motion.scaled(factor)).overturned == (off * inside > 0.0)
                            judged += 1
    assert judged >= 8
    assert found.data.sides_differ
    lowest = found.data.lowest_uplift
    lifted = [len(rocking.simulate(bodies[0], s.scaled(lowest * (1.0 + off) / s.pga)).events) > 0
              for off in (-1e-9, 1e-9) for s in shaken]  # fmt: skip
    others = [len(rocking.simulate(bodies[1], s.scaled(lowest * (1.0 + off) / s.pga)).events) > 0
              for off in (-1e-9, 1e-9) for s in shaken]  # fmt: skip
    assert not any(lifted[:2] + others[:2])
    assert any(lifted[2:] + others[2:])


def test_a_vertical_motion_changes_the_weight_that_lifts_a_tied_block_and_not_its_prestress():
    motion = PULSES[1]
    thresholds = []
    for prestress in (0.0, 3e4):
        body = RestrainedBlock(Block(width=0.5, height=3.0, mass=4e3), Tendon(1e5, prestress=prestress))
        level = rocking.incremental_dynamic_analysis(body, motion, levels=[20.0, 40.0]).data.lowest_uplift
        for off, lifts in ((-1e-9, False), (1e-9, True)):
            alone = rocking.simulate(body, motion.scaled(level * (1.0 + off) / motion.pga), duration=motion.end)
            assert (len(alone.events) > 0) == lifts
        thresholds.append(level / min(body.uplift_thresholds()))
    assert thresholds[0] == pytest.approx(thresholds[1], rel=1e-12)  # less by the weight of the block alone
    assert thresholds[0] < 0.9


def test_a_spectrum_makes_restraints_larger_with_their_block():
    def body(size, *, mass=2e3):
        """The same body at another size, with forces that keep their ratio to the weight."""
        restraints = Tendon(2e5 / size, prestress=1e3, strength=6e3), Damper(300.0 * size**1.5)
        return RestrainedBlock(Block(width=0.4 * size, height=2.0 * size, mass=mass), *restraints, restitution=0.9)

    motions, sizes = [rocking.pulses.one_sine(4.0, f) for f in (1.5, 3.0)], np.array([0.5, 1.0, 3.0])
    own = body(1.0)
    found = rocking.rocking_spectrum(own, motions, p=own.block.p / np.sqrt(sizes))
    judged = 0
    for k, size in enumerate(sizes.tolist()):
        for m, motion in enumerate(motions):
            alone = rocking.simulate(body(size), motion)
            assert found.data.overturned.values[m, 0, k] == alone.overturned
            assert found.data.peak_rotation.values[m, 0, k] == pytest.approx(alone.peak_rotation, rel=1e-9)
            judged += not alone.overturned and alone.peak_rotation > 0.0
    assert judged >= 3


def test_a_survey_is_of_walls_too():
    found = rocking.survey(FACADE, {"one": PULSES[0] * 2.0, "two": PULSES[2] * 6.0})
    for row, pulse in zip(found.rows(), (PULSES[0] * 2.0, PULSES[2] * 6.0), strict=True):
        alone = rocking.simulate(FACADE, pulse)
        assert row["overturned"] == alone.overturned
        assert row["peak_over_balance"] == alone.peak_over_slenderness
        assert row["one_sided"] == 1.0
    assert "peak/balance" in found.summary()
    assert "thrust" in str(found.to_dict()["block"]["description"]).lower()


def test_columns_are_one_where_sides_are_equal_and_two_where_they_differ():
    assert {"p", "one_sided", "yield_elongation"} <= body_coordinates(FACADE.as_bodies()).keys()
    assert not FACADE.as_bodies().is_symmetric
    assert {"alpha_plus", "alpha_minus"} <= body_coordinates(LEANING.as_bodies()).keys()
    oscillator = dynamics.ImpactOscillator(1.0, 0.8).as_bodies()
    assert {"frequency", "second_stop"} <= body_coordinates(oscillator).keys()
    assert not oscillator.is_symmetric
    assert dynamics.InvertedPendulum(3.0, 0.1, 0.5).as_bodies().is_symmetric
    assert dynamics.ImpactOscillator(1.0, 0.8, stop=0.1, second_stop=0.1).as_bodies().is_symmetric


@pytest.mark.parametrize("another", [False, pytest.param(True, marks=pytest.mark.thorough)])
def test_what_a_study_of_walls_computes_another_process_resumes_and_reads(tmp_path, capsys, another):
    bodies, levels = [FACADE, LEANING, RestrainedBlock(FACADE.block, one_sided=True, restitution=0.4)], [1.0, 2.0, 4.0]
    study = rocking.create_study(tmp_path / "walls", bodies, PULSES[:3], levels=levels, measure="pga", polarity="both",
                          blocks_per_batch=512)  # fmt: skip
    study.run()
    whole = rocking.simulate_many(bodies, PULSES[:3], levels=levels, measure="pga", polarity="both")
    script = f"import rocking; s = rocking.Study({str(tmp_path / 'walls')!r}); s.run(); print(s.status)"
    if another:
        print(subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout)
    else:
        exec(script)
    assert "complete" in (again := capsys.readouterr().out) or "done" in again
    read = rocking.Study(tmp_path / "walls")
    results = read.results()
    for name in ("overturned", "peak_rotation", "impacts"):
        np.testing.assert_array_equal(results[name].values, whole[name].values)
    assert {"one_sided_plus", "slack_elongation_minus"} <= set(results.coords)
    shares = read.spectrum().data.overturned_share.values
    np.testing.assert_array_equal(shares, whole.overturned.mean(["motion", "polarity"]).values)


def test_what_needs_a_free_block_or_any_block_says_so_in_one_sentence():
    ball, pulse = dynamics.BouncingBall(0.8), PULSES[0]
    for analysis in (
        lambda: rocking.fragility(ball, PULSES, model="linear"),
        lambda: rocking.incremental_dynamic_analysis(ball, pulse, model="linear"),
        lambda: rocking.compare_measures(ball, PULSES, model="linear"),
        lambda: rocking.rocking_spectrum(ball, pulse, model="linear"),
        lambda: rocking.survey(ball, pulse, model="linear"),
    ):
        with pytest.raises(OptionError, match=r"[bB]all") as refused:
            analysis()
        assert "\n" not in str(refused.value)
    for analysis in (
        lambda: rocking.overturning_map(FACADE, "one-sine", amplitudes=[2.0, 3.0], frequencies=[1.0, 2.0]),
        lambda: rocking.rules.compare_rules(FACADE, pulse),
        lambda: rocking.rules.west(FACADE, pulse),
    ):
        with pytest.raises(BlockError, match="a free Block is required, not a RestrainedBlock"):
            analysis()
    with pytest.raises(OptionError, match="block"):
        rocking.simulate(FACADE, rocking.pulses.sine(2.0, 1.0, cycles=2), chattering="time", model="linear")
