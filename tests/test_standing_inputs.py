"""What nobody can mean of meshes, walls, restraints and laws of restitution: one sentence says what, where and how."""

import pytest
import trimesh

import rocking
from rocking import (
    Block,
    Damper,
    Load,
    Restitution,
    RestrainedBlock,
    RockingError,
    Solid,
    Spring,
    Tendon,
    Thrust,
)
from rocking.inputs.notes import list_density_notes, list_restraint_notes

WALL = Block(width=0.5, height=4.0, mass=5e3)
PULSE = rocking.pulses.one_sine(2.0, 1.0)


def box(size=1.0):
    made = trimesh.creation.box((0.6 * size, 0.4 * size, 1.8 * size))
    made.apply_translation([0.0, 0.0, 0.9 * size])
    return made


def held(*restraints, **options):
    return RestrainedBlock(WALL, *restraints, **options)


def drawn(least=0.5, largest=0.9, seed=1):
    return held(restitution=Restitution(largest, least, seed=seed))


#: What is done, what it is about (an argument or nothing), and words that say what is wrong and how to correct it.
WRONG = {
    # Meshes
    "support aside": (
        lambda: Solid.from_mesh(box(), support=[(0.3, 0.2), (0.2, 0.2), (0.25, 0.1)]),
        "support",
        "its centre of mass lies 0.268 m outside its support, towards 243 deg; correct",
    ),
    "tolerance of all": (lambda: Solid.from_mesh(box(), tolerance=5.0), "tolerance", "below the height of the mesh"),
    # Restraints
    "restraints in a list": (lambda: held([Spring(1e3), Damper(1.0)]), "", "is not a restraint; give Tendon, Spring"),
    "restraints twice": (lambda: RestrainedBlock(held(Spring(1e3)), Damper(1.0)), "", "and all restraints together"),
    "no mass": (lambda: Block.one_sided(Thrust(9.0, 2.0), width=0.4, height=4.0), "mass", "requires its mass, kg"),
    "sizes of a wall without names": (
        lambda: Block.one_sided(0.4, 4.0), "width", "a block requires either half_width and half_height, or"
    ),
    "a tendon beyond": (
        lambda: held(Tendon(1e5, offset=2.0)), "offset", "beyond the pivot, which is 0.25 m from the centre of mass"
    ),
    "a thrust below the ground": (lambda: Thrust(9.0, -1.0), "height", "positive number, in m, not -1"),
    "a thrust in kN for N": (
        lambda: held(Thrust(2e6, 3.0)), "", "reduce the thrust, load or lean; forces are in N, masses in kg"
    ),
    "a load outside": (
        lambda: held(Load(1e5, 4.0, offset=1.0)), "offset", "0.702 m beyond its pivot; reduce"
    ),
    "a pair for one side": (
        lambda: held(one_sided=True, restitution=(0.4, 0.5)), "restitution", "must be a number, not a pair"
    ),
    "a lean in degrees": (
        lambda: held(lean=2.0), "lean", "for the block to stand, not 2; if it is in degrees, give math.radians(2)"
    ),
    "a start behind a wall": (
        lambda: rocking.simulate(held(one_sided=True), None, initial_rotation=-0.1),
        "initial_rotation",
        "at least 0 rad, in front of the body's stop",
    ),
    # Restitution
    "a law of percents": (lambda: drawn(80.0, 90.0), "maximum", "if it is in per cent, give 0.9"),
    "three restitutions": (lambda: held(restitution=[0.9] * 3), "restitution", "a pair (side +, side -), not 3 values"),
    "a law by its name": (lambda: held(restitution="housner"), "restitution", "an array of numbers, not 'housner'"),
    "a law of a free block": (
        lambda: Block(width=0.4, height=2.0, restitution=Restitution(0.9, 0.5, seed=1)),
        "restitution",
        "for a law, use RestrainedBlock(block, restitution=...)",
    ),
    # Several bodies
    "two gravities": (
        lambda: rocking.simulate_many([held(), RestrainedBlock(Block(width=0.5, height=4.0, gravity=1.6))], PULSE),
        "gravity",
        "the same gravity for all of them",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_what_cannot_be_meant_is_refused_in_one_sentence(case):
    make, about, words = WRONG[case]
    with pytest.raises(RockingError) as refused:
        make()
    said = str(refused.value)
    assert words in said
    assert "\n" not in said and not said.endswith(".")
    assert not about or about in said


def test_units_that_may_be_mistaken_are_noted():
    (note,) = Solid.from_mesh(box(1000.0)).notes
    assert note == "the body is 1800 m high: are its coordinates in metres?"
    (note,) = Solid.from_mesh(box(), density=2.7).notes
    assert "2.7 kg/m^3" in note and note.endswith("is it in kg/m^3?")
    assert list_density_notes([2700.0, 500.0, None]) == ()
    usual = held(Tendon(2e8, prestress=1e5), Thrust(9.0, 4.0), Load(9.0, 4.0), Spring(1e6))
    assert list_restraint_notes(usual) == ()
    words = "times the weight or more: are forces in N, and masses in kg?"
    for restraint in (Tendon(2e11), Tendon(2e11, strength=2e9), Spring(1e12)):
        (note,) = list_restraint_notes(held(restraint))
        assert words in note
