"""The documentation keeps its word: examples run, names exist, pages load nothing from the network."""

import importlib
import importlib.util
import inspect
import json
import re
import runpy
import shlex
import shutil
import sys
import sysconfig
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest
from cyclopts import CycloptsError

import rocking
from rocking.cli import app, main, reject_unknown_options
from rocking.studies.file import SCHEMA

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
EXAMPLES = runpy.run_path(str(ROOT / "scripts" / "page_examples.py"))
EXAMPLE = EXAMPLES["EXAMPLE"]
PAGES_WITH_EXAMPLES = [page for page in PAGES if EXAMPLE.search(page.read_text("utf-8"))]
# They take seconds; the other pages show that examples run.
THOROUGH = (
    "bifurcation.md", "chattering.md", "chattering-maps.md", "first-response.md", "fragility.md", "from-a-mesh.md",
    "hazard.md", "orbits.md", "overturning-map.md", "results.md", "risk.md", "rules.md", "spectrum.md", "validate.md",
    "vertical-friction-sensitivity.md", "walls-and-tendons.md",
)  # fmt: skip
SLOW = ("basins.md", "calibrate.md", "calibration.md", "gradients.md", "periodic-orbits.md", "study.md")
MARKS = {**dict.fromkeys(THOROUGH, pytest.mark.thorough), **dict.fromkeys(SLOW, pytest.mark.slow)}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


def normalised(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=str(page.relative_to(ROOT)), marks=[MARKS[page.name]] if page.name in MARKS else [])
        for page in PAGES_WITH_EXAMPLES
    ],
)
def test_the_examples_of_a_page_run_and_print_what_it_says(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert EXAMPLES["run"](page) == ""


def known(chain: str) -> bool:
    """Whether a dotted name of the package leads to something."""
    found = rocking
    for name in chain.split(".")[1:]:
        if not hasattr(found, name):
            return False
        found = getattr(found, name)
    return True


def test_code_that_needs_a_readers_own_files_compiles_and_calls_names_that_exist():
    # The cells of command-line.md, and the script of study-cluster.md, are run by tests of their own.
    blocks = [
        (page, code)
        for page in PAGES
        for code in re.findall(r"^```python\n(.*?)^```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    ]
    assert len(blocks) > 20
    for page, code in blocks:
        compile(code, str(page), "exec")
        assert all(known(name) for name in re.findall(r"\brocking(?:\.\w+)+", code)), page


def console_lines() -> list[tuple[str, str]]:
    """Commands in the consoles of all pages: the page, and what is typed after "rocking"."""
    found = []
    for page in [*PAGES, ROOT / "SECURITY.md"]:
        for console in re.findall(r"^```console\n(.*?)^```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE):
            for line in re.findall(r"^\$ (.*)$", console, re.MULTILINE):
                parts = re.split(r"\s(?:\||&&|&)\s", line.partition("  #")[0])
                typed = (part.removeprefix("rocking ") for part in parts if part.startswith("rocking "))
                found += [(str(page.relative_to(ROOT)), each) for each in typed]
    return found


@pytest.mark.thorough
def test_every_command_of_the_pages_is_taken_with_its_options():
    lines = console_lines()
    assert len(lines) > 80
    for page, line in lines:
        given = shlex.split(line)
        try:
            _, bound, _ = app.parse_args(given, exit_on_error=False, print_error=False)
            reject_unknown_options(bound.args, given)
        except (CycloptsError, rocking.RockingError) as error:
            pytest.fail(f"{page}: rocking {line}: {error}")


@pytest.mark.thorough
def test_the_reference_of_commands_has_every_option_that_their_help_shows(tmp_path, capsys, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs" / "_extensions")
    importlib.import_module("commands").write_pages(tmp_path)
    pages = {path.stem: path.read_text("utf-8") for path in (tmp_path / "reference" / "commands").iterdir()}
    commands = {name for name in app if not name.startswith("-")}
    assert pages.keys() == commands | {"index"}
    assert all(f"({name}.md)" in pages["index"] for name in commands)
    studies = [name for name in app["study"] if not name.startswith("-")]
    for words in [*([name] for name in commands - {"study"}), *(["study", name] for name in studies)]:
        main([*words, "--help"])
        shown = set(re.findall(r"--[a-z][a-z-]*", capsys.readouterr().out)) - {"--help"}
        assert shown <= set(re.findall(r"--[a-z][a-z-]*", pages[words[0]])), words


def test_the_reference_of_files_names_every_key_of_a_study():
    study = (ROOT / "docs" / "reference" / "study-file.md").read_text("utf-8")
    for table, keys in SCHEMA.items():
        if table != "report":
            assert f"`[{table}]`" in study, table
        assert [key for key in keys if f"`{key}`" not in study and f"[{table}.{key}]" not in study] == [], table


def test_every_public_name_is_in_the_reference():
    reference = (ROOT / "docs" / "api" / "index.md").read_text("utf-8")
    listed = set(re.findall(r"^   ([\w.]+)$", reference, re.MULTILINE))
    parts = (
        rocking.analysis,
        rocking.calibration,
        rocking.chattering,
        rocking.dynamics,
        rocking.solid,
        rocking.studies,
    )
    # The page of a module says all that is in it.
    whole = {name for name in listed if inspect.ismodule(getattr(rocking, name, None))}
    modules = {part.__name__.partition(".")[2] for part in parts}
    names = [
        *(name for name in rocking.__all__ if not inspect.ismodule(getattr(rocking, name))),
        *(f"{part.__name__.partition('.')[2]}.{name}" for part in parts for name in part.__all__),
    ]
    missing = [
        name
        for name in names
        if not {name, name.rpartition(".")[2]} & (listed | modules) and name.partition(".")[0] not in whole
    ]
    assert len(names) > 100
    assert missing == []


def test_every_command_that_the_pages_name_exists():
    makefile = (ROOT / "Makefile").read_text("utf-8")
    targets = set(re.findall(r"^([a-z-]+):", makefile, re.MULTILINE))
    for page in [*PAGES, ROOT / "CONTRIBUTING.md", ROOT / "ARCHITECTURE.md", ROOT / ".ci" / "run"]:
        named = set(re.findall(r"(?:`|\$ )make ([a-z-]+)", page.read_text("utf-8")))
        assert named <= targets, page


def test_every_dependency_is_pinned_by_its_version_alone():
    lines = (ROOT / "constraints.txt").read_text("utf-8").splitlines()
    pins = [line for line in lines if not line.startswith("#")]
    assert all(re.fullmatch(r"[\w.-]+==[\w.]+", pin) for pin in pins)
    wanted = list(PROJECT["dependencies"])
    for extra in PROJECT["optional-dependencies"].values():
        wanted += extra
    names = {normalised(re.match(r"[\w.-]+", requirement)[0]) for requirement in wanted}
    assert names <= {normalised(pin.partition("==")[0]) for pin in pins}


def test_all_places_state_the_same_version():
    citation = (ROOT / "CITATION.cff").read_text("utf-8")
    assert f"version: {rocking.__version__}\n" in citation
    assert PROJECT["version"] == rocking.__version__


@pytest.mark.thorough
@pytest.mark.filterwarnings("default")
def test_pages_load_nothing_from_the_network(tmp_path):
    build = pytest.importorskip("sphinx.cmd.build")
    source = tmp_path / "docs"
    source.mkdir()
    shutil.copy(ROOT / "docs" / "conf.py", source)
    shutil.copy(ROOT / "docs" / "references.bib", source)
    shutil.copytree(ROOT / "docs" / "_extensions", source / "_extensions")
    (source / "_static").mkdir()
    shutil.copy(ROOT / "docs" / "_static" / "pages.css", source / "_static")
    (source / "howto").mkdir()
    (source / "howto" / "command-line.md").write_text("# Commands\n", "utf-8")
    listed = "```{toctree}\nreference/commands/index\ngallery/index\nhowto/command-line\n```\n"
    (source / "index.md").write_text(f"# A page\n\nwith $x^2$ and\n\n$$\ny = x\n$$ (label)\n\n{listed}", "utf-8")
    examples = tmp_path / "examples"
    examples.mkdir()
    shutil.copy(ROOT / "examples" / "GALLERY_HEADER.rst", examples)
    (examples / "paper.py").write_text('"""\nAn example\n==========\n\nwith :math:`x`.\n"""\nprint(1)\n', "utf-8")
    assert build.main(["-q", "-W", "-b", "html", str(source), str(tmp_path / "html")]) == 0
    for path in ("index.html", "gallery/index.html", "gallery/paper.html"):
        page = tmp_path / "html" / path
        text = page.read_text("utf-8")
        loaded = re.findall(r"<(?:script|img|iframe)[^>]*\ssrc=\"([^\"]*)\"|<link[^>]*\shref=\"([^\"]*)\"", text)
        addresses = ["".join(pair) for pair in loaded]
        assert any("mathjax" in address for address in addresses) or path == "gallery/index.html"
        for address in addresses:
            assert "//" not in address
            # Where a page asks for a file, the build must have put it there.
            assert address.startswith("#") or (page.parent / re.split("[?#]", address)[0]).is_file(), address
    for style in (tmp_path / "html" / "_static").rglob("*.css"):
        # One style may import another that lies beside it.
        assert not re.search(r"(?:@import|url\()\s*(?:url\(\s*)?['\"]?(?:https?:)?//", style.read_text("utf-8")), style


@pytest.fixture
def hooks(monkeypatch):
    """The names of `hatch_build.py`; what builds the package is not installed beside it."""
    for interface, named in (
        ("metadata", {"MetadataHookInterface": object}),
        ("builders.hooks", {"BuildHookInterface": list}),
    ):
        monkeypatch.setitem(sys.modules, f"hatchling.{interface}.plugin.interface", SimpleNamespace(**named))
    return runpy.run_path(str(ROOT / "hatch_build.py"))


def test_the_build_uses_the_compiler_of_the_tests_and_installs_none_where_kernels_are_current(hooks):
    libraries = runpy.run_path(str(ROOT / "compiling" / "libraries.py"))
    pinned = (ROOT / "constraints.txt").read_text("utf-8").splitlines()
    assert {each.partition("==")[0] for each in libraries["REQUIREMENTS"]} > {"numba", "llvmlite", "numpy"}
    assert {*libraries["REQUIREMENTS"]} <= {*pinned}
    hook = hooks["KernelsHook"]()
    hook.root, hook.target_name = str(ROOT), "wheel"
    assert hook.dependencies() == []


def test_a_wheel_holds_the_kernels_and_an_editable_installation_finds_them_in_the_source_tree(hooks):
    hook = hooks["KernelsHook"]()
    hook.root, hook.target_name = str(ROOT), "wheel"
    manifest = json.loads((ROOT / "src/rocking/kernels/built/manifest.json").read_text("utf-8"))
    made = [*manifest["libraries"], *filter(None, [manifest["page"]])]
    names = ["manifest.json", *(each["file"] for each in made)]
    for version, expected in (("editable", []), ("standard", [f"rocking/kernels/built/{name}" for name in names])):
        hook.initialize(version, build := {"force_include": {}})
        assert [*build["force_include"].values()] == expected
        assert build["pure_python"] is False
        assert build["tag"] == f"py3-none-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


def test_a_build_that_fails_ends_in_a_sentence(hooks, monkeypatch):
    class Ended(Exception):
        pass

    def abort(text):
        raise Ended(text)

    libraries = runpy.run_path(str(ROOT / "compiling" / "libraries.py"))

    def build():
        monkeypatch.setitem(libraries["_linker"].__globals__, "_c_compiler", list)
        monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
        libraries["_linker"]()

    hook = hooks["KernelsHook"]()
    hook.root, hook.app = str(ROOT), SimpleNamespace(abort=abort)
    hook._libraries = lambda: libraries | {"build": build}
    with pytest.raises(Ended, match="neither a C compiler nor ziglang was found to link them; install a C compiler"):
        hook.initialize("standard", {})


def test_on_a_package_index_the_readme_leads_to_nothing_that_is_not_there(hooks):
    shown = hooks["for_index"]((ROOT / "README.md").read_text("utf-8"))
    assert not re.search(r"\]\((?!https?:)", shown)
    assert "an interactive explorer, `docs/howto/explorer.md` in the source" in " ".join(shown.split())
    assert "`ARCHITECTURE.md` in the source" in shown
    assert "```pycon\n>>> import rocking" in shown
    metadata: dict = {}
    hook = hooks["ReadmeHook"]()
    hook.root = str(ROOT)
    hook.update(metadata)
    assert metadata == {"readme": {"content-type": "text/markdown", "text": shown}}
    assert PROJECT["dynamic"] == ["readme"]
