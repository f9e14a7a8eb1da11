"""Sliders of the explorer's page end where the block would be refused, whatever else is chosen."""

import random

import pytest

from rocking.errors import RockingError
from rocking.explorer.core import Explorer
from rocking.explorer.inputs import STEPS, text_at, tracks
from rocking.explorer.parameters import PARAMETERS


def bodies(count, seed):
    """Blocks that can be made, of every shape, some with a restitution of their own, in both models."""
    draw, explorer, made = random.Random(seed), Explorer(), []

    def some(name):
        return text_at(PARAMETERS[name], draw.randint(0, STEPS))

    shapes = (
        lambda: {"width": some("width"), "height": some("height")},
        lambda: {"width": some("width"), "height": some("height"), "offset": some("offset")},
        lambda: {"p": some("p"), "alpha": some("alpha")},
        lambda: {"p": f"{some('p')},{some('p')}", "alpha": f"{some('alpha')},{some('alpha')}"},
        lambda: (
            {name: some(name) for name in ("height_of_mass", "gyration")}
            | {"pivots": f"{some('pivots')},{some('pivots')}"}
        ),
    )
    while len(made) < count:
        texts = draw.choice(shapes)() | draw.choice(({}, {"model": "linear"})) | {"motion": "none"}
        texts |= draw.choice(({}, {"restitution": some("restitution")}))
        try:
            explorer.show(texts)
        except RockingError:
            continue
        made.append(texts)
    return made


def test_a_slider_of_a_lively_block_moves_where_a_duration_ends_the_simulation():
    texts = {"p": "2", "alpha": "0.2", "restitution": "1", "motion": "none", "duration": "10"}
    ((first, last),) = tracks(texts)["p"]
    assert (first, last) == (0, STEPS)
    for step in (first, last):
        Explorer().show({**texts, "p": text_at(PARAMETERS["p"], step), "initial_rotation": "0.01"})


@pytest.mark.parametrize("count", [12, pytest.param(200, marks=pytest.mark.slow)])
def test_no_drag_along_a_track_is_refused_and_the_next_step_is(count):
    draw, explorer, dragged, ended = random.Random(2), Explorer(), 0, 0
    for texts in bodies(count, 1):
        for name, ends in tracks(texts).items():
            for side, (first, last) in enumerate(ends):
                written = texts.get(name, "0").split(",")

                def at(step, name=name, side=side, written=written, texts=texts):
                    sides = [*written[:side], text_at(PARAMETERS[name], step), *written[side + 1 :]]
                    return {**texts, name: ",".join(sides)}

                for step in {first, last, draw.randint(first, last), draw.randint(first, last)}:
                    explorer.show(at(step))
                    dragged += 1
                for beyond in {first - 1, last + 1} - {-1, STEPS + 1}:
                    with pytest.raises(RockingError):
                        explorer.show(at(beyond))
                    ended += 1
    assert dragged > 8 * count and ended >= count // 2
