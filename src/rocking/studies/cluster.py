"""Workers of dask.distributed as an executor: of a scheduler that runs somewhere, or processes of this machine."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import signal
from collections.abc import Iterator
from concurrent.futures import Executor
from typing import Any, Final

from rocking.errors import InvalidOption, StudyError
from rocking.progress import note

_HERE: Final = "127.0.0.1"

#: How long a scheduler may take to answer, s.
_ANSWER: Final = 5.0


@contextlib.contextmanager
def scheduler_executor(address: str) -> Iterator[Executor]:
    """Give the workers of a scheduler as an executor.

    Parameters
    ----------
    address : str
        As ``tcp://127.0.0.1:8786``; certificates for ``tls://`` are taken from Dask's configuration.

    Raises
    ------
    StudyError
        If nobody answers there, or not as expected.
    InvalidOption
        If dask.distributed is not installed.
    """
    distributed = _distributed()
    try:
        # A client that cannot connect would leave threads behind, and wait for them at the end.
        asyncio.run(_knock(distributed, address))
    except Exception as error:  # whatever the address, the certificates and the sockets raise
        raise StudyError(f"there is no scheduler at {address}: {' '.join(str(error).split())}") from error
    with distributed.Client(address, timeout=_ANSWER, set_as_default=False) as client:
        if not client.nthreads():
            note(f"no worker has come to {address} yet; the run goes on as they come")
        yield client.get_executor(pure=False)


@contextlib.contextmanager
def local_executor(workers: int) -> Iterator[Executor]:
    """Give so many processes of this machine, of one thread each, as an executor; nobody else can reach them.

    Raises
    ------
    InvalidOption
        If dask.distributed is not installed.
    """
    distributed = _distributed()
    here: dict[str, Any] = {
        "host": _HERE,
        "dashboard_address": f"{_HERE}:0",
        "worker_dashboard_address": f"{_HERE}:0",
    }
    with (
        distributed.LocalCluster(
            n_workers=workers, threads_per_worker=1, preload=[__name__], silence_logs=logging.CRITICAL, **here
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        yield client.get_executor(pure=False)


def dask_setup(worker: object) -> None:
    """Leave signals to the process that runs the study: what a terminal sends reaches the workers, too.

    dask.distributed calls this in every worker of `local_executor` when it starts.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)


async def _knock(distributed: Any, address: str) -> None:
    """Connect, as a client does, and go."""
    credentials = distributed.Security().get_connection_args("client")
    connection = await distributed.comm.connect(address, timeout=_ANSWER, **credentials)
    await connection.close()


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise InvalidOption("a cluster needs dask.distributed: install rocking[cluster]") from None
    # What is worth saying of workers that come and go is said in sentences of our own.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    return distributed
