"""Studies in an object store: the same objects, the same bytes; locks by condition, and what becomes of the dead."""

import importlib
import json
import logging
import os
import signal
import subprocess
import sys
import threading
import time
import urllib.request

import numpy as np
import pytest

import rocking
from rocking.studies import place as places

obstore = pytest.importorskip("obstore")

BLOCKS = rocking.Blocks(p=np.linspace(1.0, 6.0, 1300), alpha=0.2, restitution=0.7)
MOTIONS = [rocking.pulses.one_sine(4.0, frequency) for frequency in (0.5, 1.0)]
OPTIONS = {"levels": [2.0, 4.0], "measure": "pga", "model": "linear", "unit_blocks": 512}
UNITS = 12


@pytest.fixture(scope="module")
def bucket():
    server = pytest.importorskip("moto.server")
    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    one = server.ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    one.start()
    address = "http://{}:{}".format(*one.get_host_and_port())
    responses = importlib.import_module("moto.s3.responses").S3Response
    put, one_at_a_time = responses.put_object, threading.Lock()

    def put_object(self):
        # An object store writes where nothing is in one step; moto looks, and then writes.
        with one_at_a_time:
            return put(self)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(responses, "put_object", put_object)
        patched.setenv("AWS_ACCESS_KEY_ID", "anybody")
        patched.setenv("AWS_SECRET_ACCESS_KEY", "anything")
        patched.setenv("AWS_REGION", "us-east-1")
        patched.setenv("AWS_ENDPOINT_URL", address)
        patched.setenv("AWS_ALLOW_HTTP", "true")
        urllib.request.urlopen(urllib.request.Request(f"{address}/studies", method="PUT")).close()
        yield "s3://studies"
    one.stop()


@pytest.fixture
def url(bucket, request):
    return f"{bucket}/{request.node.name[:60].strip('[]')}"


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    folder = tmp_path_factory.mktemp("complete")
    rocking.study(folder, BLOCKS, MOTIONS, **OPTIONS).run()
    return folder


def made(url):
    return rocking.study(url, BLOCKS, MOTIONS, **OPTIONS)


def same(study, folder):
    """Whether a study holds the objects of one in a folder, to the byte."""
    files = {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    kept = {name: data for name, data in files.items() if name not in ("lock", "runs.jsonl")}
    return len(kept) == UNITS + 4 and all(study._store.place.get(name) == data for name, data in kept.items())


@pytest.mark.thorough
def test_a_study_in_an_object_store_holds_the_same_bytes(complete, url, tmp_path):
    study = made(url)
    half = sorted(study._store.missing())[::2]
    for key in half:
        study._store.put(key, (complete / "result" / f"c.0.{key[0]}.{key[1]}.{key[2]}.{key[3]}").read_bytes())
    assert study.run(threads=2).units == UNITS - len(half)
    assert same(study, complete)
    assert study.verify(recompute=2) == []
    again = rocking.study(url)
    np.testing.assert_array_equal(again.results().impacts.values, rocking.study(complete).results().impacts.values)
    assert [entry["event"] for entry in again.status.runs] == ["start", "end"]
    assert again._store.place.get("lock") is None


@pytest.mark.thorough
def test_any_zarr_reader_opens_it_there(complete, url):
    zarr = pytest.importorskip("zarr")
    made(url).run()
    store = zarr.storage.ObjectStore(obstore.store.from_url(url), read_only=True)
    array = zarr.open_group(store, mode="r")["result"]
    reference = rocking.study(complete).results()
    np.testing.assert_array_equal(array[1, :, :, 0], reference[array.attrs["outcomes"][1]].values)


@pytest.mark.thorough
def test_the_commands_take_a_url(url, run, tmp_path):
    file = tmp_path / "museum.toml"
    file.write_text(
        '[blocks]\np = "1:6:1300"\nalpha = 0.2\nrestitution = 0.7\n[[motions.pulses]]\nfamily = "one_sine"\n'
        'amplitude = 4.0\nfrequency = [0.5, 1.0]\n[scales]\npga = [2.0, 4.0]\n[simulation]\nmodel = "linear"\n'
        "[report.spectrum]\n"
    )
    assert run("study", "create", file, url, "--unit-blocks", 512)[0] == 0
    assert run("study", "run", file, url)[0] == 0
    assert run("study", "report", url, tmp_path / "report")[0] == 0
    assert (tmp_path / "report" / "spectrum.png").is_file()
    assert "12 of 12 units done" in run("study", "status", url)[1]
    assert run("study", "export", url, tmp_path / "all.csv")[0] == 0
    assert "name one as well" in run("study", "report", url)[2]


@pytest.mark.thorough
@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
def test_a_killed_run_loses_nothing_and_its_lock_is_taken_over(complete, url):
    study = made(url)
    script = (
        "import sys, rocking\nstudy = rocking.study(sys.argv[1])\nput = study._store.put\n"
        "def slow(key, data):\n    put(key, data)\n    print('stored', flush=True)\n    sys.stdin.read()\n"
        "study._store.put = slow\nstudy.run()\n"
    )
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", script, url], **pipes, text=True) as process:
        assert process.stdout.readline() == "stored\n"  # it goes no further until it is killed
        holder = study.status.running.holder
        assert holder.startswith(f"process {process.pid} on ")
        with pytest.raises(rocking.StudyError, match=f"is being run by {holder}, heard of"):
            study.run()
        process.send_signal(signal.SIGKILL)
    assert study.status.done >= 1
    assert study.status.running is None
    study.run()
    assert "whose process is gone" in study.status.runs[-2]["note"]
    assert same(study, complete)


def wait_until(true, seconds=300.0):  # far beyond what a busy machine takes: what is waited for comes
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end
        time.sleep(0.01)


def put_lock(study, holder):
    text = json.dumps({"holder": holder, "renewal": "0"}).encode()
    obstore.put(study._store.place._store, "lock", text)


@pytest.mark.thorough
def test_a_lock_of_a_host_that_is_not_heard_of_is_taken_over(complete, url, monkeypatch):
    study = made(url)
    put_lock(study, "process 17 on elsewhere")
    with pytest.raises(rocking.StudyError, match=r"process 17 on elsewhere, heard of \d s ago; if that is dead"):
        study.run()
    monkeypatch.setattr(places, "_LEASE", -1.0)
    study.run()
    assert "took over from process 17 on elsewhere, which was not heard of for" in study.status.runs[0]["note"]
    assert same(study, complete)


@pytest.mark.thorough
def test_a_lock_is_renewed_and_a_run_that_lost_it_stops(url, monkeypatch):
    monkeypatch.setattr(places, "_RENEWAL", 0.05)
    study = made(url)
    with study._store.place.locked():
        first = study._store.place.get("lock")
        wait_until(lambda: study._store.place.get("lock") != first)
        put_lock(study, "process 17 on elsewhere")
        wait_until(lambda: study._store.place._taken_over)
        with pytest.raises(rocking.StudyError, match="taken over by another run"):
            study._store.place.put("anything", b"")
    assert b"elsewhere" in study._store.place.get("lock")  # and leaves the other's lock alone


def test_of_many_who_come_at_once_one_runs_it(url):
    study, ran, refused = made(url), [], []
    start = threading.Barrier(6)

    def try_it():
        start.wait()
        try:
            with places.ObjectStore(url).locked():
                ran.append(1)
                wait_until(lambda: len(refused) == 5)
        except rocking.StudyError:
            refused.append(1)

    threads = [threading.Thread(target=try_it) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (len(ran), len(refused)) == (1, 5)
    assert study._store.place.get("lock") is None


def test_a_store_that_is_not_there_is_one_sentence(run, bucket, monkeypatch):
    code, out, err = run("study", "run", "s3://nobody/has/this")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "s3://nobody/has/this/study.json: the object cannot be read" in err or "there is no study here" in err
    code, out, err = run("study", "run", "nonsense://x/y")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "nonsense://x/y: this is no URL of an object store" in err
    monkeypatch.setitem(sys.modules, "obstore", None)
    assert "pip install '.[objects]' in the source folder" in run("study", "run", "s3://nobody/has/this")[2]


def test_a_renewal_whose_answer_is_lost_is_none_of_another_run(url, monkeypatch):
    monkeypatch.setattr(places, "_RENEWAL", 0.05)
    place = places.place_of(url)
    put, lost = place._put_lock, []

    def losing(condition):
        tag = put(condition)
        if condition != "create" and not lost:
            lost.append(tag)
            raise OSError("the connection broke")
        return tag

    monkeypatch.setattr(place, "_put_lock", losing)
    late = time.monotonic() + 60.0
    with place.locked():
        before = len(place._renewals)
        while len(place._renewals) < before + 5 and time.monotonic() < late:
            time.sleep(0.01)
        place.put("something", b"written")
    assert lost and place.get("lock") is None and place.get("something") == b"written"


def test_who_has_lost_the_lock_leaves_that_of_the_next_one(url, monkeypatch):
    monkeypatch.setattr(places, "_RENEWAL", 600.0)
    one, other = places.place_of(url), places.place_of(url)
    with one.locked():
        monkeypatch.setattr(places, "_LEASE", -1.0)
        entered = other.locked()
        entered.__enter__()
    assert b"holder" in other.get("lock")
    entered.__exit__(None, None, None)
    assert other.get("lock") is None


def test_who_may_only_read_is_told_the_holder(url, monkeypatch):
    place, reader = places.place_of(url), places.place_of(url)
    put = obstore.put

    def refused(store, name, *rest, **named):
        if name == "clock":
            raise PermissionError("may only read")
        return put(store, name, *rest, **named)

    with place.locked():
        monkeypatch.setattr(obstore, "put", refused)
        assert reader.holder() == places.this_process()
        monkeypatch.setattr(obstore, "get", lambda *given: (_ for _ in ()).throw(OSError("no connection")))
        with pytest.raises(rocking.StudyError, match="cannot be read: no connection"):
            reader.holder()
        monkeypatch.undo()
