"""Where a program will run: what suits the caches of a CPU does not suit the many lanes of an accelerator."""

import os
from contextlib import AbstractContextManager, nullcontext

import jax


def on_cpu() -> bool:
    """Whether what is traced now will run on a CPU: `jax.default_device` says so or, unset, jax's default backend."""
    device = jax.config.values["jax_default_device"]
    if device is None:
        return jax.default_backend() == "cpu"
    return (device if isinstance(device, str) else device.platform) == "cpu"


def cpu() -> AbstractContextManager:
    """In which to run a few small programs one after the other, each waited for: on the CPU."""
    return nullcontext() if on_cpu() else jax.default_device(jax.devices("cpu")[0])


def as_outside() -> AbstractContextManager[None]:
    """In a call to the host, programs as they are outside of it: jax names the CPU there, which is a setting that every
    program would be traced anew for. Beside an accelerator it has to stay: that waits for the host.
    """
    return jax.default_device(None) if jax.default_backend() == "cpu" else nullcontext()


def full_products() -> AbstractContextManager:
    """In which to trace what must keep its digits: an accelerator would round the factors of matrix products in single
    precision to ten bits, and so the slopes of a Runge-Kutta step. A CPU does not; asked for the same, it is slower.
    """
    return nullcontext() if on_cpu() else jax.default_matmul_precision("highest")


def host_threads() -> int:
    """Threads that XLA's programs on the CPU have, as it counts them itself: NPROC, else the cores of this process."""
    said = os.environ.get("NPROC", "")
    if said.isdigit():
        return int(said)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
