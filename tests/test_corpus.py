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


def test_a_digest_sees_the_last_bit_of_a_number_and_a_word_of_a_text():
    def encoded(value, digits=None):
        return b"".join(corpus.encoded(value, digits))

    assert encoded([0.1, 0.2]) != encoded([0.1, 0.20000000000000004])
    assert encoded("peak 0.1 rad") != encoded("peak 0.1 deg")
    assert encoded({"a": None}) != encoded({"a": False}) != encoded({"a": 0})
    assert encoded([0.1, 2.0], 6) == encoded([0.1 + 1e-12, 2.0 - 1e-12], 6) != encoded([0.10001, 2.0], 6)
    assert encoded("p = 0.12345678, 3 rows", 6) == encoded("p = 0.12345681, 3 rows", 6)
    assert encoded("12345678 rows", 6) != encoded("12345679 rows", 6)


def test_the_command_names_the_groups_that_differ(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(corpus, "FILE", tmp_path / "corpus.json")
    assert corpus.main(["--write", "risks", "descriptions"]) == 0
    assert corpus.main(["--compare", "risks", "descriptions"]) == 0
    capsys.readouterr()
    monkeypatch.setattr(corpus, "SLENDER", corpus.STATUE)
    assert corpus.main(["--compare", "risks", "descriptions"]) == 1
    assert capsys.readouterr().out == "differs: descriptions\n1 of 2 groups differ\n"
