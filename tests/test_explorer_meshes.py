"""Bodies of meshes in the explorer: the block of an azimuth, its picture, its code; and files of any content."""

import json
import math
import runpy
import shlex
import struct
import sys

import numpy as np
import pytest
import trimesh
from explorer_answers import page_answer
from explorer_client import Client, clients, let_in

import rocking
from rocking.errors import BlockError, OptionError, RecordError, RockingError
from rocking.explorer.code import case_as_command, case_as_python
from rocking.explorer.core import Explorer
from rocking.explorer.inputs import read_case
from rocking.explorer.server import App
from rocking.explorer.uploads import MAX_FILE_SIZE, MAX_FILES, UploadStore

STATUE = {"mesh": "statue", "azimuth": "30", "motion": "ridgecrest-clc-090", "pga": "0.6g"}
DENSITY = "plinth=2700,figure=2650,head=2650"
DENSITIES = {"plinth": 2700.0, "figure": 2650.0, "head": 2650.0}


def box(sizes=(0.3, 0.2, 1.0)):
    made = trimesh.creation.box(sizes)
    made.apply_translation([0.0, 0.0, 0.5 * sizes[2]])
    return made


def content(mesh, kind="stl"):
    found = mesh.export(file_type=kind)
    return found if isinstance(found, bytes) else found.encode()


def test_a_case_of_a_mesh_is_the_packages_block_of_that_azimuth():
    for texts, given in (
        ({}, {}),
        ({"density": DENSITY, "tolerance": "2mm"}, {"density": DENSITIES, "tolerance": 0.002}),
        ({"unit": "ft", "gravity": "3.7", "restitution": "0.7,0.8"}, {"unit": "ft", "gravity": 3.7}),
    ):  # fmt: skip
        case = read_case({**STATUE, **texts}, UploadStore())
        solid = rocking.Solid.from_mesh("statue", **given)
        assert case.block.sides == solid.block(30.0, restitution=[0.7, 0.8] if "restitution" in texts else None).sides
        assert case.block.gravity == given.get("gravity", 9.80665)
        assert case.body.solid.to_dict() == solid.to_dict()


@pytest.mark.thorough
def test_code_of_a_mesh_has_the_same_bits(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    data = content(box((300.0, 200.0, 1000.0)))
    (tmp_path / "-my block.STL").write_bytes(data)
    store = UploadStore()
    key = store.add_file("C:\\scans\\-my block.STL", data)
    judged = 0
    for texts in (
        STATUE,
        {**STATUE, "azimuth": "200.5", "density": DENSITY, "restitution": "0.8"},
        {**STATUE, "mesh": f"file:{key}", "unit": "mm"},
    ):
        case = read_case(texts, store)
        (tmp_path / "case.py").write_text(case_as_python(case), "utf-8")
        response = case.simulate()
        again = runpy.run_path("case.py")["response"]
        assert np.array_equal(again.impacts, response.impacts)
        assert len(response.impacts) > 10
        code, out, err = run(*shlex.split(case_as_command(case))[1:], "--json")
        assert (code, err) == (0, "")
        peak = float(out.split('"peak_rotation_rad": ')[1].split(",")[0])
        assert peak == response.peak_rotation == again.peak_rotation
        judged += 1
    assert judged == 3
    assert "Solid.from_mesh('-my block.STL', unit='mm').block(30.0)" in case_as_python(case)


def test_the_picture_of_a_body_is_of_its_plane():
    explorer = Explorer()
    solid = rocking.Solid.from_mesh("statue")
    for azimuth in (0.0, 30.0, 90.0, 271.0):
        texts = {**STATUE, "azimuth": repr(azimuth)}
        payload = page_answer(explorer, "case", texts)
        plus, minus = solid.block(azimuth).sides
        block, profile = payload.header["block"], payload.arrays["outline"].reshape(-1, 6)
        assert block["body"]["azimuth"] == azimuth
        edges = np.array(block["body"]["edges"])
        assert np.allclose(edges[:, 0], [side.radius * math.sin(side.alpha) for side in (plus, minus)], rtol=1e-14)
        # The plinth stands on the support, so that the outline ends at the pivots on the ground.
        assert np.allclose(profile[0, :4], [0.0, 0.2, -edges[1, 0], edges[0, 0]], atol=1e-6)
        assert profile[:, 1].max() == pytest.approx(solid.height, rel=1e-9) == block["outline"]["top"]
        assert block["outline"]["widest"] >= edges[:, 0].max() - 1e-6
    plain = page_answer(explorer, "case", {"width": "0.3", "height": "1", "motion": "none", "initial_rotation": "1deg"})
    assert "outline" not in plain.arrays
    assert plain.header["block"]["body"] is None


def test_what_is_said_of_a_body_are_its_own_numbers():
    explorer = Explorer()
    found = page_answer(explorer, "details", {**STATUE, "density": DENSITY})
    header, arrays = found.header["body"], found.arrays
    solid = rocking.Solid.from_mesh("statue", density=DENSITIES)
    rose = solid.rose(arrays["azimuth"])
    assert np.array_equal(arrays["acceleration"], rose.data.acceleration.values)
    assert len(arrays["azimuth"]) == 180
    assert (header["weakest_azimuth"], header["weakest"]) == (90.0, rose.data.weakest_acceleration)
    assert header["summary"] == solid.summary().splitlines()
    assert np.allclose(arrays["support"].reshape(-1, 2), solid.support - solid.centre[:2])
    assert arrays["piece"][-1] == len(arrays["plan"]) / 2 > 100
    assert page_answer(explorer, "details", {"width": "0.3", "height": "1"}).header["body"] is None


def test_what_was_mended_is_said_and_what_looks_wrong_is_noted():
    explorer = Explorer()
    scan = box((300.0, 200.0, 1000.0))
    scan.update_faces(scan.triangles_center[:, 2] > 0.0)
    scan.invert()
    taken = explorer.add_file("scan.obj", content(scan, "obj"))
    texts = {**STATUE, "mesh": f"file:{taken['key']}", "azimuth": str(taken["azimuth"])}
    summary = page_answer(explorer, "details", texts).header["body"]["summary"]
    assert any(line.startswith("repaired") and "1 hole filled" in line for line in summary)
    assert "the body is 1000 m high" in page_answer(explorer, "case", texts).header["block"]["notes"][-1]
    assert page_answer(explorer, "case", {**texts, "unit": "mm"}).header["block"]["notes"] == []


def test_meshes_are_known_by_their_content_and_so_many_at_most():
    store = UploadStore()
    data = content(box())
    key = store.add_file("box.stl", data)
    first = read_case({**STATUE, "mesh": f"file:{key}"}, store).block
    store.remove(key)
    others = [store.add_file(f"{k}.txt", str(k).encode()) for k in range(MAX_FILES)]
    with pytest.raises(RecordError, match=f"{MAX_FILES} files and 256 MiB are kept at most"):
        store.add_file("box.stl", data)
    with pytest.raises(RecordError, match="the file of mesh is not here any more: open it again"):
        read_case({**STATUE, "mesh": f"file:{key}"}, store)
    assert len({*others, key}) == MAX_FILES + 1
    store.remove(others[0])
    assert store.add_file("box.stl", data) == key
    assert read_case({**STATUE, "mesh": f"file:{key}"}, store).block.sides == first.sides


def test_a_mesh_that_is_refused_is_not_kept():
    explorer = Explorer()
    with pytest.raises(BlockError):
        explorer.add_file("flat.stl", content(trimesh.creation.box((1.0, 1.0, 1e-9))))
    assert explorer.uploads.count_usage()["files"] == 0


def gltf(**changed):
    """A glTF file in which all is inside, or that names, claims or nests something else."""
    whole = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [],
        "bufferViews": [],
        "accessors": [
            {"componentType": 5126, "count": 10**10, "type": "VEC3"},
            {"componentType": 5125, "count": 3 * 10**10, "type": "SCALAR"},
        ],
    }
    return json.dumps({**whole, **changed}).encode()


FLAT = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], process=False)
HUGE = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
HUGE += b"element face 700000\nproperty list uchar uchar vertex_indices\nend_header\n"
HUGE += struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) + bytes([3, 0, 1, 2]) * 700_000
NARROW = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nelement face 1\n"
NARROW += b"property list uchar int vertex_indices\nend_header\n0\n1\n2\n3 0 1 2\n"

HOSTILE = {
    "other.gltf": (
        gltf(buffers=[{"uri": "../secret.bin", "byteLength": 9}]),
        "cannot be read: '../secret.bin' is missing",
    ),
    "web.gltf": (gltf(buffers=[{"uri": "http://127.0.0.1:9/a", "byteLength": 9}]), "cannot be read: 'http:"),
    "bomb.gltf": (gltf(), "cannot be read"),
    "deep.gltf": (b'{"a":' + b"[" * 200_000, "cannot be read"),
    "cut.glb": (b"glTF\x02\x00\x00\x00" + b"\xff" * 40, "cannot be read"),
    "zip.glb": (b"PK\x03\x04" + bytes(100), "cannot be read"),
    "nan.stl": (content(box())[:96] + struct.pack("<f", math.nan) + content(box())[100:], "are not finite"),
    "inf.obj": (content(box(), "obj").replace(b"0.15000000", b"1e999", 1), "(cannot be read|are not finite)"),
    "wide.obj": (content(box(), "obj").replace(b"0.15000000", b"1e20", 1), "m large, outside the range of bodies"),
    "text.obj": (b"hello\n" * 9, "(cannot be read|contains no faces)"),
    "empty.stl": (b"", "(cannot be read|contains no faces)"),
    "flat.obj": (content(FLAT, "obj"), "^flat.obj: encloses no volume"),
    "point.obj": (b"v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n", "all corners of the mesh coincide"),
    "far.obj": (content(FLAT, "obj") + b"f 1 2 99\n", "(cannot be read|no volume)"),
    "huge.ply": (HUGE, "contains 700000 triangles; use a coarser mesh of at most 500000"),
    "narrow.ply": (NARROW, "cannot be read: 'y' is missing"),
    "count.ply": (HUGE.replace(b"700000", b"9" * 15), "cannot be read"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_mesh_is_answered_in_one_sentence(name, tmp_path, monkeypatch):
    (tmp_path / "secret.bin").write_bytes(bytes(9))
    (tmp_path / "folder").mkdir()
    monkeypatch.chdir(tmp_path / "folder")
    data, words = HOSTILE[name]
    explorer = Explorer()
    with pytest.raises(BlockError, match=words) as caught:
        taken = explorer.add_file(name, data)
        # What a choice on the page may correct is taken.
        page_answer(explorer, "case", {**STATUE, "mesh": f"file:{taken['key']}"})
    said = str(caught.value)
    assert said.startswith(f"{name}: ") or name == "point.obj"
    assert "\n" not in said and str(tmp_path) not in said
    assert len(said) < 300


def test_files_that_are_no_meshes_or_too_large_are_refused():
    store = UploadStore()
    for name in ("a.zip", "a.3mf", "a.tar.gz", "a.obj.zip", "a", "obj", "a.dae", "a.json"):
        with pytest.raises(RockingError):
            store.describe_file(store.add_file(name, b"PK"))
    with pytest.raises(RecordError, match="may have 16 MiB: cut a record"):
        store.add_file("a.stl", bytes(MAX_FILE_SIZE + 1))
    for name in ("statu", "../statue", "/etc/passwd", "statue.obj"):
        with pytest.raises(BlockError, match=r"must be (one of )?.?statue|did you mean"):
            read_case({**STATUE, "mesh": name}, store)


def test_a_mesh_that_does_not_stand_as_its_format_has_it_may_be_turned():
    explorer = Explorer()
    lying = box((0.2, 1.0, 3.0))
    lying.vertices[lying.vertices[:, 2] < 0.1] *= [0.1, 0.1, 1.0]
    lying.vertices[:, 1] += np.where(lying.vertices[:, 2] > 0.1, 0.6, 0.0)
    taken = explorer.add_file("lying.stl", content(lying))
    assert taken["azimuth"] == 0.0
    texts = {**STATUE, "mesh": f"file:{taken['key']}"}
    with pytest.raises(BlockError, match="does not stand"):
        page_answer(explorer, "case", texts)
    turned = page_answer(explorer, "case", {**texts, "up": "-z", "azimuth": "0"})
    assert turned.header["block"]["body"]["name"] == "lying.stl"


def test_what_reads_meshes_may_be_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(OptionError, match=r"trimesh, which is not installed: run pip install '\.\[mesh\]'"):
        Explorer().add_file("box.stl", content(box()))


@pytest.fixture(scope="module")
def page():
    with clients() as portal:
        app = App(Explorer())
        yield let_in(Client(portal, app.asgi, "http://127.0.0.1:8123"), app.create_token())


def test_the_server_takes_a_mesh_and_shows_it(page):
    taken = page.post("/api/files", params={"name": "../box.stl"}, content=content(box((0.2, 0.4, 1.0)))).json()
    assert (taken["name"], taken["azimuth"] % 180.0) == ("box.stl", 90.0)
    texts = {**STATUE, "mesh": f"file:{taken['key']}", "azimuth": "90"}
    answer = page.get("/api/case", params=texts).content
    header = json.loads(answer[4 : 4 + struct.unpack("<I", answer[:4])[0]])
    expected = rocking.Block(width=0.2, height=1.0)
    assert [side["alpha"] for side in header["block"]["sides"]] == pytest.approx([expected.alpha] * 2, rel=1e-6)
    assert [side["p"] for side in header["block"]["sides"]] == pytest.approx([expected.p] * 2, rel=1e-6)
    assert header["block"]["body"]["name"] == "box.stl"
    assert page.get("/api/details", params=texts).headers["content-type"] == "application/octet-stream"
    for path, params, words in (
        ("/api/case", {**texts, "mesh": "file:0123"}, "the file of “Mesh” is not here any more"),
        ("/api/case", {**texts, "unit": "yard"}, "“Unit of the coordinates” must be one of"),
        ("/api/case", {**texts, "up": "north"}, "“Axis that points up” must be one of"),
        ("/api/case", {**texts, "density": "stone"}, "“Density (kg/m³)”"),
        ("/api/case", {**texts, "azimuth": "nan"}, "azimuth"),
    ):
        refused = page.get(path, params=params)
        assert refused.status_code == 422
        assert words.lower() in refused.json()["problem"].lower()
    assert page.post("/api/files", params={"name": "a.zip"}, content=b"PK").status_code == 422
    large = {"content-length": str(MAX_FILE_SIZE + 1)}
    assert page.post("/api/files", params={"name": "a.stl"}, content=b"", headers=large).status_code == 413


# The texts of seed 3 have the statue turned, which takes most of the time.
@pytest.mark.thorough
@pytest.mark.parametrize("seed", [4, pytest.param(3, marks=pytest.mark.thorough)])
def test_no_text_of_a_mesh_fails_otherwise_than_by_a_sentence(seed):
    random = np.random.default_rng(seed)
    store, answered = UploadStore(), 0
    wild = ["", "nan", "inf", "-1", "0", "1e308", "x", "{}", "a=b=c", "plinth=", "=1", "0,0,1", "'", "file:", "9" * 40]
    for _ in range(60):
        texts = {
            **STATUE,
            random.choice(["mesh", "azimuth", "up", "unit", "density", "tolerance"]): random.choice(wild),
        }
        try:
            read_case(texts, store)
        except RockingError as error:
            assert "\n" not in str(error)
            answered += 1
    assert answered >= 25
