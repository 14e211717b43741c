# SPDX-License-Identifier: Apache-2.0
"""Who runs the cases: a process on each core, or the workers of an existing Dask cluster."""

import ctypes
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from typing import Any

from tqdm import tqdm

from fluxtrue_tools import interrupts
from fluxtrue_tools.campaign.store import Store
from fluxtrue_tools.errors import FluxtrueError

Task = Callable[[int], Any]
PR_SET_PDEATHSIG = 1  # linux/prctl.h
SCHEDULER_S = 60  # long enough for a busy scheduler
SUBMITTED_PER_WORKER = 4  # enough that no worker waits while results are stored


_tasks: list[Task] = []  # of a worker process: the one that it runs


def _worker(task: Task) -> None:
    """The parent alone handles the signals of a process group; a worker ends with it.

    A pool whose workers have ended by themselves cannot always be shut down. The task is handed over here, once: a
    task may contain a whole campaign, and if each case carried it, the pipe to the workers would be full. The thread
    that writes to it would then wait without end for workers that have been killed.
    """
    _tasks[:] = [task]
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def _run(case: int) -> Any:
    return _tasks[0](case)


def local(task: Task, cases: Iterable[int], workers: int | None) -> Iterator[tuple[int, Any]]:
    """(case, result) in the order they finish; those that have finished together, by their number.

    Only a few cases are submitted at a time. Each submission writes to a pipe of the pool while it holds a lock that
    the pool's thread needs to empty the pipe: with some 16,000 at once, on a busy computer, both wait without end.
    """
    others = set(multiprocessing.active_children())
    count = workers or len(os.sched_getaffinity(0))
    pool = ProcessPoolExecutor(max_workers=count, initializer=_worker, initargs=(task,))
    left = iter(cases)

    def submitted(number: int) -> dict[Future[Any], int]:
        return {pool.submit(_run, case): case for case in islice(left, number)}

    try:
        waiting = submitted(SUBMITTED_PER_WORKER * count)
        while waiting:
            for future in sorted(wait(waiting, return_when=FIRST_COMPLETED).done, key=waiting.__getitem__):
                interrupts.raise_if_received()
                yield waiting.pop(future), future.result()
                waiting |= submitted(1)
    except BaseException as error:
        # The results of the cases that run would be lost. A pool that has lost a worker would wait without end for the
        # others, which ignore its SIGTERM; one that a signal has interrupted may, too.
        for worker in set(multiprocessing.active_children()) - others:
            worker.kill()
        if isinstance(error, BrokenProcessPool):
            raise FluxtrueError("a process with a case has ended (killed, or out of memory); what is finished is "
                                "stored, and the same command continues") from error  # fmt: skip
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def dask(task: Task, cases: list[int], address: str) -> Iterator[tuple[int, Any]]:
    """The same on a cluster whose workers see this checkout under the same path."""
    from distributed import Client
    from distributed import as_completed as dask_completed

    try:
        client = Client(address, timeout=SCHEDULER_S)
    except (OSError, ValueError, TimeoutError) as error:
        raise FluxtrueError(f"--scheduler {address}: no scheduler answers ({error})") from error
    with client:
        futures = client.map(task, cases, pure=False)
        case_of = {future.key: case for future, case in zip(futures, cases, strict=True)}
        for future, result in dask_completed(futures, with_results=True):
            interrupts.raise_if_received()
            yield case_of[future.key], result


def missing(task: Task, store: Store, cases: range, scheduler: str | None, workers: int | None) -> None:
    """Run the cases that a folder does not have yet. Each result is stored at once, so that a later call continues."""
    todo = store.missing(cases)
    results = dask(task, todo, scheduler) if scheduler else local(task, todo, workers)
    with tqdm(total=len(cases), initial=len(cases) - len(todo), unit="case",
              disable=not sys.stderr.isatty()) as bar:  # fmt: skip
        for case, rows in results:
            store.save(case, rows)
            bar.update()
