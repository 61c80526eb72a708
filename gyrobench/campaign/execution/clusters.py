"""Clusters that a campaign runs on: a given dask client, the scheduler at an address, or local processes."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

from gyrobench.bench import UsageError
from gyrobench.campaign.execution.store import CampaignError
from gyrobench.files import cores, temporary_folder
from gyrobench.side_by_side import ONE_THREAD

if TYPE_CHECKING:
    from distributed import Client

TEMPORARY = "gyrobench"


@contextlib.contextmanager
def connect(
    client: Client | None, scheduler: str | None, workers: int | None, runs: int,
    notes: Callable[[Iterable[str]], None],
) -> Iterator[Client]:  # fmt: skip
    """Yield a client: the given one, that of a scheduler, that of the notebook, else one of local processes."""
    from distributed import Client, default_client

    if client is None and scheduler is None and workers is None:
        with contextlib.suppress(ValueError):
            client = default_client()
    if client is not None:
        if client.asynchronous:
            raise UsageError("the dask client is asynchronous; a campaign needs Client(..., asynchronous=False)")
        yield client
        return
    if scheduler is not None:
        try:
            connected = Client(scheduler, timeout="20s", set_as_default=False)
        except (OSError, ValueError) as error:
            raise CampaignError(f"no scheduler at {scheduler}: {error}") from None
        except TypeError:
            keys = "distributed.comm.tls in the configuration of dask"
            raise CampaignError(f"no scheduler at {scheduler}: TLS needs certificates, {keys}") from None
        with connected:
            notes([f"dashboard: {connected.dashboard_link}"])
            yield connected
        return
    with local_cluster(min(workers or cores(), runs)) as local:
        notes([f"dashboard: {local.dashboard_link}{_without_bokeh()}"])
        yield local


def _without_bokeh() -> str:
    import importlib.util

    return "" if importlib.util.find_spec("bokeh") else " (its pages need bokeh: pip install bokeh)"


@contextlib.contextmanager
def local_cluster(workers: int) -> Iterator[Client]:
    """Yield a client of that many local processes, which end with this one.

    They talk by TLS with a certificate that is made here and lies in the memory of these processes alone: another user
    of the machine, who reaches the port, cannot send code.

    On Linux a process that has imported what a worker needs stays, and the workers are its forks: the next cluster, and
    a worker in place of one that a run has ended, need not import it again for a second.
    """
    import logging

    import dask
    from distributed import Client, LocalCluster, Security
    from distributed.utils import get_mp_context

    settings = {
        "distributed.scheduler.allowed-failures": 0,  # the campaign decides what is repeated
        # without dask's MALLOC_TRIM_THRESHOLD_: memory given back after each array is asked for again, a tenth of a run
        "distributed.nanny.pre-spawn-environ": dict.fromkeys(ONE_THREAD, 1),
        "distributed.worker.profile.enabled": False,
        "distributed.admin.system-monitor.gil.enabled": False,
        "distributed.admin.system-monitor.interval": "5s",
        "distributed.admin.tick.interval": "500ms",  # of every loop of every process, 20 ms by default
        "distributed.comm.timeouts.connect": "30s",
    }
    if sys.platform == "linux":
        settings["distributed.worker.multiprocessing-method"] = "forkserver"
    with dask.config.set(settings), _without_main():
        if sys.platform == "linux":
            # in place of dask's
            loaded = ["distributed", "gyrobench.campaign.execution.worker", "scipy.stats", "scipy.signal"]
            get_mp_context().set_forkserver_preload(loaded)
        # what is on its way when the cluster has closed, and with it its silence, would be a traceback on the terminal
        logging.getLogger("distributed.batched").setLevel(logging.CRITICAL)
        with _stop_of_this_process():
            made = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address="127.0.0.1:0",
                local_directory=str(temporary_folder()),
                env=dict(os.environ),  # as it is now, not as it was when the first cluster began
                silence_logs=logging.CRITICAL,
                security=Security.temporary(),
            )
        with made as cluster, Client(cluster, set_as_default=False, name=TEMPORARY) as client:
            yield client


@contextlib.contextmanager
def _stop_of_this_process() -> Iterator[None]:
    """Keep Ctrl-C, which a terminal sends to all its processes, from those that are started here: this one ends them.

    They inherit that the signal is held back; here it comes as soon as they are there.
    """
    from multiprocessing import resource_tracker

    if sys.platform == "win32":
        yield
        return
    resource_tracker.ensure_running()  # started within, it would let the signal through
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _without_main() -> Iterator[None]:
    """Let processes start without the user's script, which has no need to be imported there, nor a guard."""
    main = sys.modules["__main__"]
    held = {n: getattr(main, n) for n in ("__file__", "__spec__") if hasattr(main, n)}
    main.__spec__ = None
    if "__file__" in held:
        del main.__file__
    try:
        yield
    finally:
        for name, value in held.items():
            setattr(main, name, value)


def has_own_processes(client: Client) -> bool:
    """Return whether the workers are processes of their own, which a run may end."""
    return os.getpid() not in client.run(os.getpid).values()


def is_temporary(client: Client) -> bool:
    """Return whether the client is one of :func:`local_cluster`, which ends with the command."""
    return f"-{TEMPORARY}-" in client.id


def is_local(client: Client) -> bool:
    """Return whether the workers are on this machine."""
    return all("127.0.0.1" in a or "inproc" in a or "localhost" in a for a in client.nthreads())
