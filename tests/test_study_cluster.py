"""Studies on dask.distributed: real schedulers and workers, on 127.0.0.1 only; killed, and nothing is lost."""

import contextlib
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from studies_seen import RUNS, after_each_unit, digest, store_of

import rocking
from rocking.studies.batches import compute_batch

distributed = pytest.importorskip("distributed")
pytestmark = pytest.mark.skipif(os.name == "nt", reason="processes are killed the POSIX way")

HERE = ["--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0"]
BLOCKS = rocking.Blocks(p=np.linspace(1.0, 6.0, 2048), alpha=0.2, restitution=0.9)
BATCHES = 20


def connected(address, timeout=5.0):
    return distributed.Client(address, timeout=timeout, set_as_default=False)


def made(folder):
    """Make a study of 20 batches of a few hundredths of a second."""
    motion = rocking.records.load("el-centro-meloland-270")
    return rocking.create_study(
        folder, BLOCKS, motion, levels=np.linspace(2.0, 8.0, BATCHES), measure="pga", blocks_per_batch=2048
    )


def wait_until(true, seconds=300.0):  # far beyond what a busy machine takes: what is waited for comes
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    folder = tmp_path_factory.mktemp("complete")
    with rocking.set_options(threads=1):
        made(folder).run()
    return digest(folder)


class Cluster:
    """A scheduler, and workers that come and go, as processes."""

    def __init__(self, stack, folder):
        self.stack, self.file, self.workers = stack, folder / "scheduler.json", []
        self.scheduler = self.started("scheduler", "--port", 0, "--scheduler-file", self.file)
        wait_until(self.file.exists)
        self.address = json.loads(self.file.read_text())["address"]

    def started(self, *arguments):
        command = [sys.executable, "-m", "dask", *map(str, arguments), *HERE]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.stack.callback(process.wait)
        self.stack.callback(process.kill)
        return process

    def start_worker(self):
        self.workers.append(self.started("worker", "--scheduler-file", self.file, "--nthreads", 1, "--no-nanny"))


@pytest.fixture
def cluster(tmp_path):
    with contextlib.ExitStack() as stack:
        found = Cluster(stack, tmp_path)
        found.start_worker()
        found.start_worker()
        yield found


def test_a_client_is_run_as_its_executor_is(tmp_path):
    """Without a worker's process: batches are pickled and computed as on a cluster."""
    here = {"protocol": "tcp", "host": "127.0.0.1", "dashboard_address": None, "processes": False}
    pulse = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, **here) as pool,
        distributed.Client(pool, set_as_default=False) as client,
    ):
        for name, executor in {
            "client": client,
            "its executor": client.get_executor(pure=False),
            "threads": None,
        }.items():
            study = rocking.create_study(tmp_path / name, BLOCKS, pulse, levels=[0.5, 1.0], blocks_per_batch=1024)
            report = study.run(executor=executor)
            assert (report.batch_count, report.failures) == (4, {})
    assert digest(tmp_path / "client") == digest(tmp_path / "its executor") == digest(tmp_path / "threads")


# What is lost with processes is slow: each takes seconds to start.


@pytest.mark.slow
def test_a_cluster_loses_a_worker_a_batch_and_its_scheduler_but_no_result(complete, tmp_path, cluster, monkeypatch):
    # One of two workers is killed in the middle: the other one takes over its batches.
    study = made(tmp_path / "worker")
    with connected(cluster.address) as client:
        client.wait_for_workers(2)
        with monkeypatch.context() as patched:
            after_each_unit(patched, cluster.workers[0].kill)
            report = study.run(executor=client)
        assert (report.batch_count, report.failures) == (BATCHES, {})
        assert len(client.nthreads()) == 1
    assert digest(tmp_path / "worker") == complete

    # A batch kills its worker, every time: it fails, alone, and can be computed later.
    study = made(tmp_path / "batch")
    poison = store_of(study).create_input((0, 7, 0, 0)).factors[0, 0, 0]

    def deadly(work):
        if work.factors[0, 0, 0] == poison:
            os._exit(1)
        return compute_batch(work)

    cluster.start_worker()
    with connected(cluster.address) as client:
        client.wait_for_workers(2)
        client.run_on_scheduler(lambda dask_scheduler: setattr(dask_scheduler, "allowed_failures", 0))
        monkeypatch.setattr(RUNS, "compute_batch", deadly)
        report = study.run(executor=client)
        monkeypatch.undo()
    assert "KilledWorker" in report.failures["batch.0.7.0.0"]
    assert len(report.failures) <= 2  # with the one that waited behind it
    with rocking.set_options(threads=1):
        study.run()
    assert digest(tmp_path / "batch") == complete

    # The scheduler is killed: one sentence, and no waiting for what will never come.
    study = made(tmp_path / "scheduler")
    gone = pytest.raises(rocking.errors.StudyError, match="the workers are gone: ")
    with (
        gone,
        connected(cluster.address) as client,
        monkeypatch.context() as patched,
    ):
        after_each_unit(patched, cluster.scheduler.kill)
        study.run(executor=client)
    assert 0 < study.status.done_count < BATCHES
    with rocking.set_options(threads=1):
        study.run()
    assert digest(tmp_path / "scheduler") == complete


def test_a_worker_with_another_program_is_told_so(tmp_path):
    work = store_of(made(tmp_path)).create_input((0, 0, 0, 0))
    with pytest.raises(rocking.errors.StudyError, match=r"has rocking .*, the study requires rocking 9\.9\.9"):
        compute_batch(replace(work, program="rocking 9.9.9 (kernels 0)"))


# The page

PAGE = (Path(__file__).parents[1] / "docs" / "howto" / "study-cluster.md").read_text("utf-8")


def commands(*beginnings):
    """Commands of the page that begin so, in order."""
    lines = re.findall(r"^\$ (.*)$", PAGE, re.MULTILINE)
    return [next(line for line in lines if line.startswith(beginning)) for beginning in beginnings]


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("openssl") is None, reason="the page makes a certificate with openssl")
def test_the_commands_of_the_page_run_a_study_over_tls(complete, tmp_path, monkeypatch):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=os.pathsep)
    certificate, settings, scheduler, worker = (
        line.replace("8786", port)
        for line in commands("openssl", "export DASK_CONFIG", "dask scheduler", "dask worker")
    )
    driver, jobs = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert "SLURM" in jobs
    (tmp_path / "run.py").write_text(driver.replace("8786", port))
    (tmp_path / "dask.yaml").write_text(re.search(r"```yaml\n(.*?)```", PAGE, re.DOTALL)[1])
    subprocess.run(certificate, shell=True, check=True, stderr=subprocess.DEVNULL)
    made(tmp_path / "museum")
    with contextlib.ExitStack() as stack:
        for command in (scheduler, worker):
            shell = f"{settings}; exec {command}"
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            process = subprocess.Popen(shell, shell=True, executable="/bin/bash", start_new_session=True, **quiet)
            stack.callback(process.wait)
            stack.callback(os.killpg, process.pid, signal.SIGKILL)
        wait_until(lambda: answers(port))
        command = f"{settings}; exec {sys.executable} run.py"
        done = subprocess.run(command, shell=True, executable="/bin/bash", capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert "20 batches" in done.stdout
        # Who has no certificate is not let in.
        with pytest.raises(OSError), connected(f"tcp://127.0.0.1:{port}", timeout=0.5):
            pass
    assert digest(tmp_path / "museum") == complete


def answers(port):
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", int(port)), timeout=1.0):
        return True
    return False


@pytest.mark.thorough
def test_the_script_of_the_page_submits_what_it_says(tmp_path, monkeypatch):
    pytest.importorskip("dask_jobqueue")
    _, script = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    scope = {}
    exec(script[: script.index("cluster.scale")], scope)
    with scope["cluster"] as cluster:
        job = cluster.job_script()
        assert cluster.scheduler_address.startswith("tls://127.0.0.1:")
    lines = ["#SBATCH -p normal", "#SBATCH -t 04:00:00", "#SBATCH --cpus-per-task=16", "source ~/venv/bin/activate"]
    assert set(lines) <= set(job.splitlines())
    words = ["--nthreads 1", "--nworkers 16", "--dashboard-address 127.0.0.1:0", "--lifetime 230m", "--tls-cert"]
    assert all(word in job for word in words)
