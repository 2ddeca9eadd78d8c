"""Who works: this process, processes of this machine, or a Dask cluster. One that dies is replaced, its job done again.

Jobs go and come as bytes, made and read in double precision wherever they are: a worker may have been started without.
"""

import contextlib
import multiprocessing
import os
import pickle
import signal
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection, wait
from typing import Any, NamedTuple, Protocol

import jax

from rotorjax.errors import InputError

MOST_DEATHS = 3
"""Deaths of workers over one job, after which it is the job's fault."""

PATIENCE = 10.0
"""Seconds that a worker that waits has to end by itself."""


class Job(NamedTuple):
    """work(*arguments), with a progress callback where the work is done in this process."""

    work: Callable[..., Any]
    arguments: tuple


class Pool(Protocol):
    """Works on jobs, `size` at a time."""

    size: int

    def submit(self, key: Any, job: Job) -> None:
        """Begin a job."""
        ...

    def finished(self) -> list[tuple[Any, Any]]:
        """Wait until a job at least is done; (key, result) of those that are. Raises what a job raised."""
        ...

    def close(self) -> None:
        """End everything, unfinished jobs too."""
        ...


class Here:
    """This process."""

    size = 1

    def __init__(self, progress: Callable[[str, float], None] | None = None) -> None:
        """Show progress within a job."""
        self._progress, self._jobs = progress, []

    def submit(self, key: Any, job: Job) -> None:
        """Put a job down."""
        self._jobs.append((key, job))

    def finished(self) -> list[tuple[Any, Any]]:
        """Do the first job."""
        key, job = self._jobs.pop(0)
        return [(key, job.work(*job.arguments, self._progress))]

    def close(self) -> None:
        """Nothing is left behind."""


class Processes:
    """Processes of this machine, each with its own compiler, programs shared by the cache."""

    def __init__(self, size: int, say: Callable[[str], None] = lambda line: None) -> None:
        """Start them. say: hears of one that died."""
        self.size, self._say = size, say
        self._context = multiprocessing.get_context("spawn")
        self._idle = [self._started() for _ in range(size)]
        self._busy: dict[Connection, tuple[Any, Any, bytes, int]] = {}

    def _started(self) -> tuple[Any, Connection]:
        ours, theirs = self._context.Pipe()
        process = self._context.Process(target=_serve, args=(theirs,), daemon=True)
        process.start()
        theirs.close()  # so that the end of the process is the end of the pipe
        return process, ours

    def submit(self, key: Any, job: Job) -> None:
        """Hand a job to a worker that waits."""
        self._hand_over(key, packed(job), 0)

    def _hand_over(self, key: Any, content: bytes, deaths: int) -> None:
        process, pipe = self._idle.pop()
        self._busy[pipe] = (process, key, content, deaths)
        with contextlib.suppress(OSError):  # where it died waiting `finished` meets its end
            pipe.send_bytes(content)

    def finished(self) -> list[tuple[Any, Any]]:
        """Results of those that are done."""
        found = []
        while not found:
            for pipe in wait(list(self._busy)):
                assert isinstance(pipe, Connection)
                process, key, content, deaths = self._busy.pop(pipe)
                try:
                    answer = pipe.recv_bytes()
                except (EOFError, OSError):
                    self._replace(process, pipe, key, content, deaths)
                    continue
                self._idle.append((process, pipe))
                found.append((key, unpacked(answer)))
        return found

    def _replace(self, process: Any, pipe: Connection, key: Any, content: bytes, deaths: int) -> None:
        pipe.close()
        process.join()
        if deaths + 1 >= MOST_DEATHS:
            raise RuntimeError(f"{MOST_DEATHS} worker processes ended over one job, the last with {process.exitcode}")
        self._say(f"a worker process ended ({process.exitcode}): its job is done again by another")
        self._idle.append(self._started())
        self._hand_over(key, content, deaths + 1)

    def close(self) -> None:
        """Let those go that wait, so that they leave nothing behind; kill those that work."""
        for _, pipe in self._idle:
            pipe.close()
        for process, *_ in self._busy.values():
            process.kill()
        for process, *_ in [*self._idle, *self._busy.values()]:
            process.join(PATIENCE)
            process.kill()
            process.join()


class Cluster:
    """A Dask cluster at an address, or "local": one started on this machine."""

    def __init__(self, address: str, workers: int | None = None) -> None:
        """Connect or start. Raises InputError where dask.distributed is not installed or nobody answers."""
        distributed = require_distributed()
        self._cluster = None
        try:
            if address == "local":
                self._cluster = distributed.LocalCluster(
                    n_workers=workers, threads_per_worker=1, dashboard_address=None, silence_logs=40
                )
            self._client = distributed.Client(self._cluster or address, timeout=10, set_as_default=False)
        except (OSError, ValueError) as error:
            raise InputError(
                f"Argument `scheduler` must be the address of a running Dask scheduler or 'local', but {address!r} is "
                f"none: {' '.join(str(error).split())[:200]}"
            ) from None
        self._futures: dict[Any, Any] = {}

    @property
    def size(self) -> int:
        """Twice its threads, so that none waits for this process."""
        return 2 * max(1, sum(self._client.nthreads().values()))

    def submit(self, key: Any, job: Job) -> None:
        """Send a job; Dask gives it to another worker where one dies."""
        future = self._client.submit(_work_packed, packed(job), pure=False, retries=MOST_DEATHS)
        self._futures[future] = key

    def finished(self) -> list[tuple[Any, Any]]:
        """Results of those that are done."""
        with self._client.as_current():  # not by default: xarray would ask it for locks on every file
            done = require_distributed().wait(list(self._futures), return_when="FIRST_COMPLETED").done
        return [(self._futures.pop(future), unpacked(future.result())) for future in done]

    def close(self) -> None:
        """Leave the cluster, or end the one that was started."""
        self._client.cancel(list(self._futures))
        self._client.close()
        if self._cluster is not None:
            self._cluster.close()


def require_distributed() -> Any:
    """The library. Raises InputError where it is not installed."""
    try:
        import distributed
    except ImportError:
        raise InputError(
            "Argument `scheduler` must be left out where dask.distributed is not installed: pip install "
            "'rotorjax[cluster]', or take --jobs N on this machine"
        ) from None
    return distributed


def packed(content: Any) -> bytes:
    """As bytes."""
    return pickle.dumps(content)


def unpacked(content: bytes) -> Any:
    """What was packed, in the precision that it had; an exception is raised."""
    found = pickle.loads(content)
    if isinstance(found, BaseException):
        raise found
    return found


def _work_packed(content: bytes) -> bytes:
    """Do a packed job in double precision."""
    with jax.enable_x64(True):
        job = unpacked(content)
        return packed(job.work(*job.arguments, None))


def _serve(pipe: Connection) -> None:
    """Work on jobs until the other end of the pipe is gone; Ctrl-C is the other end's affair."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        try:
            content = pipe.recv_bytes()
        except (EOFError, OSError):
            return
        try:
            answer = _work_packed(content)
        except Exception as error:
            answer = _packed_error(error)
        try:
            pipe.send_bytes(answer)
        except OSError:
            return


def _packed_error(error: Exception) -> bytes:
    try:
        return packed(error)
    except Exception:  # an exception of a library may hold anything
        return packed(RuntimeError(f"{type(error).__name__}: {error}"))


def as_seen_by_workers() -> None:
    """Let processes that are started from here compile and keep programs as this one does."""
    folder = jax.config.values["jax_compilation_cache_dir"]
    if folder is not None:
        os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(folder))
        os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.1")
    sys.stderr.flush()
