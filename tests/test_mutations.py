"""Mistakes that are made on purpose: each is one change that can be read, and everybody draws the same."""

import ast
import json
import math
from pathlib import Path

import branches
import mutants
import mutations
import pytest

CODE = '''"""A module."""

from __future__ import annotations


def middle(values: list[float], least: int = 2) -> float | None:
    """Say nothing of mutants: {1 + 1}."""
    if len(values) < least and not values:
        raise ValueError(f"{len(values) + 1} values")
    values.sort(reverse=True)
    low = values[0] * 0.5
    return low + values[-1]
'''


def test_each_mutant_is_one_mistake_in_what_is_run(tmp_path):
    path = tmp_path / "module.py"
    path.write_text(CODE, "utf-8")
    found = mutations.mutants(path)
    changes = {each.change for each in found}
    assert {
        "len(values) < least -> len(values) <= least",
        "len(values) < least and (not values) -> len(values) < least or not values",
        "len(values) < least and (not values) -> not (len(values) < least and (not values))",
        "not values -> values",
        "values.sort(reverse=True) -> pass",
        "values.sort(reverse=True) -> values.sort()",
        "True -> False",
        "2 -> 3",
        "2 -> 1",
        "0 -> 1",
        "0.5 -> 1.5",
        "values[0] * 0.5 -> values[0] / 0.5",
        "low + values[-1] -> low - values[-1]",
        "-1 -> 1",
    } <= changes
    assert all("list[float]" in each.text and "{1 + 1}" in each.text for each in found)
    assert "len(values) + 1 -> len(values) - 1" not in changes
    for each in found:
        ast.parse(each.text)
        assert ast.dump(ast.parse(each.text)) != ast.dump(ast.parse(CODE)), each.change
    assert len({each.key for each in found}) == len(found) >= 16


@pytest.mark.thorough
def test_a_draw_is_the_same_again():
    assert all((mutants.ROOT / "src/rocking" / each).is_dir() for part in mutants.PARTS.values() for each in part)
    for part in ("response", "chattering"):
        drawn = mutants.drawn(part, 30, 1)
        assert len({each.key for each in drawn}) == 30, part
        assert [each.key for each in mutants.drawn(part, 30, 1)] == [each.key for each in drawn]
        assert [each.key for each in mutants.drawn(part, 30, 2)] != [each.key for each in drawn]


def test_a_draw_changes_with_the_lines_that_change_alone(tmp_path, monkeypatch):
    folder = tmp_path / "src/rocking/part"
    folder.mkdir(parents=True)
    monkeypatch.setattr(mutants, "ROOT", tmp_path)
    monkeypatch.setattr(mutants, "PARTS", {"part": ["part"]})
    lines = [f"x{k} = {k} + y{k}" for k in range(40)] + ["same = 1 + 2"] * 3
    (folder / "one.py").write_text("\n".join(lines))
    before = mutants.drawn("part", 60, 1)
    assert len({each.key for each in before}) == 60
    # Half of the lines become others, behind one that is new.
    lines[20:40] = [f"x{k} = {k} - z{k}" for k in range(20, 40)]
    (folder / "one.py").write_text("\n".join(["# new", *lines]))
    mutations.mutants.cache_clear()
    after = {(each.code, each.change) for each in mutants.drawn("part", 60, 1)}
    kept = {(each.code, each.change) for each in before if each.code in lines}
    assert len(kept) >= 20 and len(kept & after) >= 0.8 * len(kept)


@pytest.mark.thorough
def test_what_changes_nothing_is_in_a_line_that_is_there():
    for each in json.loads(mutants.EQUIVALENT.read_text("utf-8")):
        found = mutations.mutants(mutants.ROOT / "src" / each["file"])
        there = [one for one in found if one.code == each["line"] and each["change"] in (one.change, one.becomes)]
        assert there and mutants.equivalent()(there[0]) == each["reason"], each
        assert each["reason"], each


@pytest.mark.thorough
def test_survivors_are_named_and_those_that_change_nothing_do_not_count(monkeypatch):
    drawn = mutants.drawn("block and solid", 4, 1)
    found = ["tests/test_block.py::test_something", "", "", "signal 24"]
    monkeypatch.setattr(mutants, "equivalent", lambda: lambda each: "it is only faster" if each is drawn[1] else "")
    shown = mutants.Shown.of(drawn, found, 1)
    head, *rest = shown.report("block and solid")
    assert head == "block and solid: 4 mutants, 1 equivalent, 2 of 3 killed (67 %)"
    assert "it is only faster" in rest[0] and drawn[1].before in rest[0]
    assert "not seen" in rest[1] and drawn[2].after in rest[1]
    assert rest[2] == "  fewer than 85 %"
    *_, title, _, survivor, end = rows = mutants.table({"block and solid": shown}).split("\n")
    assert f"| block and solid | 4 | 1 | 2 | 67 | {shown.date} |" in rows
    assert sum("not judged yet" in row for row in rows) == len(mutants.PARTS) - 1
    assert (title, end) == ("Not seen by the tests that were run:", "")
    assert survivor.startswith(f"- {drawn[2].path.relative_to(mutants.ROOT / 'src/rocking')}:{drawn[2].line}: `")
    complete = mutants.Shown(3, 0, 3, [])
    assert mutants.table(dict.fromkeys(mutants.PARTS, complete)).endswith(
        "\nTests have seen each that changes something.\n"
    )
    assert "Tests have seen" not in mutants.table({"kernels": complete})


def test_times_are_measured_of_the_nearest_tests_until_half_of_the_time_is_filled(monkeypatch):
    """One that fails without a mutant, or does not fit, is left out; the nearest is taken however long it is."""
    tree, asked = object.__new__(mutants.Tree), []
    near = {"a.py": ["slow", "quick"], "b.py": ["fails", "quick", "slow", "other", "last"], "c.py": ["fails"]}
    times = {"slow": 30.0, "quick": 4.0, "fails": math.inf, "other": 9.0}
    monkeypatch.setattr(tree, "near", lambda path, without: near[path.name])

    def measured(names, uncompiled):
        asked.append(sorted(names))
        return {name: times[name] for name in names}

    monkeypatch.setattr(tree, "measured", measured)
    chosen = tree.chosen({Path(name): () for name in near}, 20.0, uncompiled=False)
    assert {path.name: [*names] for path, names in chosen.items()} == {
        "a.py": ["slow"],
        "b.py": ["quick", "other"],
        "c.py": [],
    }
    assert asked == [["fails", "slow"], ["quick"], ["other"]]


def test_branches_are_measured_of_files_that_are_there_by_tests_that_are_there():
    for name, part in branches.PARTS.items():
        assert part.files and part.tests, name
        assert not {path.name for path in part.files} & set(mutants.NOT_JUDGED)
    assert sum(path.parent.name == "sine" for path in branches.PARTS["kernels"].files) >= 5


def test_a_part_without_enough_branches_fails_the_run(monkeypatch, tmp_path, capsys):
    found = {"num_branches": 40, "covered_branches": 38, "num_statements": 50, "covered_lines": 50, "seconds": 3.2}
    runs = []

    def run(part):
        runs.append(part)
        return found | {"missing": {"place.py": [[3, 5], [7, -1]]}}

    monkeypatch.setattr(branches, "_run", run)
    monkeypatch.setattr(branches, "TABLE", tmp_path / "table.txt")
    monkeypatch.setattr("sys.argv", ["branches.py", "readers", "--kept", str(tmp_path)])
    assert branches.main() == 0
    said, title, _, *rows = capsys.readouterr().out.strip().splitlines()
    assert said == "place.py: 3 to 5, 7 to its end"
    assert title.startswith("| part | branches | taken, % |") and len(rows) == len(branches.PARTS)
    assert any(row.startswith("| readers | 40 | 95.0 | 50 | 100.0 | 3 |") for row in rows)
    assert (tmp_path / "table.txt").read_text() == "\n".join([title, "|---" + "|--:" * 6 + "|", *rows, ""])
    assert branches.main() == 0 and len(runs) == 1  # nothing has changed
    found["covered_branches"] = 37
    (tmp_path / "readers.json").unlink()
    assert branches.main() == 1


def test_what_the_nearest_tests_spare_is_judged_by_others_and_by_laws_of_all(monkeypatch, tmp_path):
    tree = object.__new__(mutants.Tree)
    tree.folder, tree.seconds, tree.copies = tmp_path, 20.0, []
    (tmp_path / "mutants").mkdir()
    drawn, asked = mutants.drawn("response", 3, 1), []

    def chosen(without, seconds, uncompiled):
        assert seconds == (60.0 if any(without.values()) else 20.0)
        return {path: {"far": 40.0} if names else {"near": 9.0} for path, names in without.items()}

    def done(tasks, copies):
        asked.append([(drawn.index(mutant), names) for _, mutant, names, *_ in tasks])
        for place, mutant, names, *_ in tasks:
            by = {0: "near::first", 1: "far::second" if "far" in names else ""}.get(drawn.index(mutant), "")
            place.write_text(json.dumps({"by": by, "files": {name: name for name in names}}))

    monkeypatch.setattr(tree, "chosen", chosen)
    monkeypatch.setattr(tree, "hash", lambda name: name)
    monkeypatch.setattr(mutants, "done", done)
    monkeypatch.setattr(mutants, "ROOT", tmp_path)
    monkeypatch.setattr(mutants, "OF_ALL", ("all",))
    for name in ("near", "far", "all"):
        (tmp_path / name).touch()
    for _ in range(2):
        assert tree.judged(drawn, kernels=False) == ["near::first", "far::second", ""]
    others = ["far", "all"]
    assert asked[:2] == [[(0, ["near"]), (1, ["near"]), (2, ["near"])], [(1, others), (2, others)]]
    assert asked[2:] == [[], []]


@pytest.mark.thorough
def test_the_nearest_tests_are_followed_by_those_that_are_not_among_them():
    tree = object.__new__(mutants.Tree)
    tree.tests = mutants.FilesOfTests(mutants.ROOT)
    path = mutants.ROOT / "src/rocking/kernels/restrained.py"
    near = tree.near(path)
    others = tree.near(path, near)
    assert len(near) == mutants.MOST and len(others) == 3 * mutants.MOST and not {*near} & {*others}
    assert "tests/test_restrained_response.py" in others
