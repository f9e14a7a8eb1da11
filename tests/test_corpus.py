"""What the package computes is what it computed when the digests of the corpus were written."""

import platform

import corpus
import pytest

#: The functions of the C library round differently elsewhere.
SYSTEM = ("Linux", "x86_64")


@pytest.mark.skipif((platform.system(), platform.machine()) != SYSTEM, reason="the digests are of Linux on x86-64")
@pytest.mark.parametrize(
    "group",
    [pytest.param(name, marks=() if group.fast else pytest.mark.thorough) for name, group in corpus.GROUPS.items()],
)
def test_results_have_not_changed(group):
    assert [*corpus.digest(group)] == corpus.written()[group], (
        f"results of the group {group} differ from tests/data/corpus.json; find the items with "
        f"'python tests/corpus.py --items {group}' here and in a version without the change"
    )


def test_the_corpus_covers_over_a_thousand_responses_in_groups_of_their_own():
    digests = corpus.written()
    assert list(digests) == list(corpus.GROUPS)
    assert sum(responses for _, responses in digests.values()) >= 1000
    assert len({value for value, _ in digests.values()}) == len(digests)
