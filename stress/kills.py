"""Kill whoever runs a study, again and again, at random moments; compare every byte with an undisturbed run's.

    python stress/kills.py --kills 500

By turns threads (1, 2) and dask.distributed (1, 2 workers) compute, in two orders of batches. Of threads the run is
killed; of a cluster now the run, now a worker, which is then replaced. After every kill each batch that was there is
there still, and every batch that is there holds the bytes of the undisturbed run.
"""

import argparse
import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import distributed
import numpy as np
from common import batches, digest, made

import rocking
from rocking.studies.batches import BatchGrid

HERE = ("--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0")
ORDERS = ("as it is", "reversed")
SETTINGS = [(kind, count, order) for order in ORDERS for kind in ("threads", "dask") for count in (1, 2)]

#: A kill comes within so many seconds after a run was begun; a new worker takes some to come.
WITHIN = {"threads": 0.6, "dask": 4.0}


class Cluster:
    """A scheduler with workers that can be killed and replaced."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "scheduler.json"
        self.scheduler = self._started("scheduler", "--port", "0", "--scheduler-file", str(self.file))
        self.workers: list[subprocess.Popen[bytes]] = []
        while not self.file.exists():
            time.sleep(0.05)

    def set_workers(self, count: int) -> None:
        """Have so many workers, new ones for those that died."""
        self.workers = [one for one in self.workers if one.poll() is None]
        for one in self.workers[count:]:
            one.kill()
            one.wait()
        del self.workers[count:]
        while len(self.workers) < count:
            self.workers.append(
                self._started("worker", "--scheduler-file", str(self.file), "--nthreads", "1", "--no-nanny")
            )

    def stop(self) -> None:
        """End them all."""
        for one in (*self.workers, self.scheduler):
            one.kill()
            one.wait()

    @staticmethod
    def _started(*arguments: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", *arguments, *HERE]
        return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def run(folder: Path, cluster: Cluster, kind: str, count: int, order: str) -> None:
    """Run the study as the setting says."""
    study = made(folder)
    keys = list(study._store.grid)
    ordered = keys[::-1] if order == "reversed" else keys
    address = json.loads(cluster.file.read_text())["address"]
    client = contextlib.nullcontext() if kind == "threads" else distributed.Client(address, set_as_default=False)
    in_order = patch.object(BatchGrid, "__iter__", lambda grid: iter(ordered))
    with client as executor, in_order, rocking.set_options(threads=count):
        study.run(executor=executor)


def forked(action: Callable[[], None]) -> int:
    """Do something in a process of its own, which need not compile or import anything; its number."""
    process = os.fork()
    if process:
        return process
    code = 1
    with contextlib.suppress(BaseException):
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        action()
        code = 0
    os._exit(code)


def check(folder: Path, seen: dict[str, bytes], reference: dict[str, bytes]) -> dict[str, bytes]:
    """Check that nothing was lost and nothing is wrong."""
    now = batches(folder)
    assert seen.items() <= now.items(), "a batch that was stored is gone or has changed"
    assert now.items() <= reference.items(), "a batch differs from the undisturbed run's"
    return now


def killed_once(run_number: int, cluster: Cluster, kind: str, within: float, rng: np.random.Generator) -> str | None:
    """Wait for a moment, and kill the run or, of a cluster, sometimes a worker; what was killed, if the run went on."""
    time.sleep(float(rng.uniform(0.0, within)))
    if os.waitpid(run_number, os.WNOHANG)[0]:
        return None
    victim = f"run of {kind}"
    if kind == "dask" and rng.random() < 0.5:
        cluster.workers[0].kill()
        cluster.workers[0].wait()
        victim = "worker"
        time.sleep(float(rng.uniform(0.0, 0.3)))
    os.kill(run_number, signal.SIGKILL)
    os.waitpid(run_number, 0)
    return victim


def main() -> None:
    """Kill as often as asked for, and count."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--kills", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    killed: Counter[str] = Counter()
    digests: Counter[str] = Counter()
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as where:
        top = Path(where)
        cluster = Cluster(top)
        try:
            with rocking.set_options(threads=1):
                made(top / "undisturbed").run()
            reference, expected = batches(top / "undisturbed"), digest(top / "undisturbed")
            turn = 0
            while sum(killed.values()) < given.kills or turn < len(SETTINGS):
                kind, count, order = SETTINGS[turn % len(SETTINGS)]
                folder, within = top / str(turn), WITHIN[kind]
                seen: dict[str, bytes] = {}
                made(folder)
                while len(seen) < len(reference):
                    cluster.set_workers(count if kind == "dask" else 0)
                    process = forked(lambda: run(folder, cluster, kind, count, order))  # noqa: B023 - it is called at once
                    victim = killed_once(process, cluster, kind, within, rng)
                    killed.update([victim] if victim else [])
                    before, seen = len(seen), check(folder, seen, reference)
                    # A busy machine may need longer for a batch than any run is let live.
                    within *= 1.3 if len(seen) == before else 1.0
                with rocking.set_options(threads=1):
                    made(folder).run()  # removes what is half-written
                assert digest(folder) == expected
                digests[f"{kind} {count}, batches {order}"] += 1
                turn += 1
                print(f"{sum(killed.values())} kills, {turn} studies, {time.monotonic() - start:.0f} s", flush=True)
        finally:
            cluster.stop()
    print(f"kills: {dict(killed)}\nstudies with the one digest {expected[:16]}: {dict(digests)}")


if __name__ == "__main__":
    main()
