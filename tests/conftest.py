"""The tests' own settings: float64, one compilation cache for all processes, and programs let go file by file.

The package itself never touches jax.config.

Most of the tests' time is compilation. The cache is shared by the workers, by the kernels that run the notebooks and by
the commands that the tests start, which get it through the environment.
"""

import gc
import importlib
import os
import subprocess
import sys
from pathlib import Path

from rotorjax.cli import HAS_OLDER_WAY, WITHOUT_FREE_WAKE

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the workers share the cores; read when numpy is imported
if "PYTEST_XDIST_WORKER" in os.environ:
    # two threads of XLA look for work with their eyes open, a quarter of the time that a wake takes; read when jax
    # starts. Where a program calls the host, which has programs of its own, there must be a second one (calls_host)
    os.environ.setdefault("NPROC", "1")
# XLA's older way to write fused loops and LLVM's first level: the same sums, and half to compile; read when jax starts.
# Level 0 halves that again, but its programs run three times as long: for all but the study and what runs long. A
# program is one module for LLVM and not 32: a third less, where the workers keep all cores busy
os.environ["XLA_FLAGS"] = " ".join(
    [
        os.environ.get("XLA_FLAGS", ""),
        WITHOUT_FREE_WAKE,
        "--xla_cpu_parallel_codegen_split_count=1" if HAS_OLDER_WAY else "",
        "--xla_backend_optimization_level=1",
    ]
)
os.environ.setdefault("JAX_DISABLE_MOST_OPTIMIZATIONS", "1")
os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")  # as the command line: XLA's own hints are no errors

import compiling
import jax
import pytest

from rotorjax.device import host_threads

CACHE = str(Path(__file__).parents[1] / ".pytest_cache" / "jax")
MOST_MAPPINGS = 32_000  # about 5 GB of programs and what they hold
SHORTEST = 0.1  # seconds of compilation that are worth a file
MET_ONCE = {"potential", "calibration", "panels", "study", "deck", "inflow", "sweep"}
"""Folders whose programs hardly another test asks for: writing them took three hundredths of these folders' time."""

gc.set_threshold(200_000, 20, 50)  # tracing makes objects by the million and few that hold each other

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_disable_most_optimizations", True)
jax.config.update("jax_compilation_cache_dir", CACHE)
jax.config.update("jax_persistent_cache_min_compile_time_secs", SHORTEST)
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", CACHE)
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", str(SHORTEST))
compiling.lower_together()


def pytest_collection_modifyitems(items):
    """README and notebooks first, then other files with slow tests: one that starts last is waited for alone."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}

    def order(item):
        return 0 if item.path.name == "test_documents.py" else 1 if item.path in slow else 2

    items.sort(key=order)


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem):
    """Run a test in a process of its own where it needs a second thread of XLA's and this one has one."""
    if not pyfuncitem.get_closest_marker("calls_host") or host_threads() > 1:
        return None
    env = {key: value for key, value in os.environ.items() if not key.startswith("PYTEST_")} | {"NPROC": "2"}
    command = [sys.executable, "-m", "pytest", "-q", pyfuncitem.nodeid]
    ran = subprocess.run(command, cwd=pyfuncitem.config.rootpath, env=env, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout
    return True


@pytest.fixture(autouse=True, scope="session")
def what_runs_long_runs_fast():
    """Compiled to be run, not to be compiled fast."""
    for name, _, _ in compiling.RUN_LONG:
        importlib.import_module(name)
    compiling.to_be_run()


@pytest.fixture(autouse=True, scope="module")
def keep_programs_that_are_met_again(request):
    """Write to the cache on disk what another file or process will read: of all programs seven in a hundred are."""
    worth = 1e9 if request.path.parent.name in MET_ONCE else SHORTEST
    jax.config.update("jax_persistent_cache_min_compile_time_secs", worth)


@pytest.fixture(autouse=True, scope="module")
def let_programs_go():
    """Forget compiled programs between files once they are many.

    Every program keeps a few memory mappings; a process that runs all files comes to the 65 530 that Linux allows, and
    XLA aborts in the middle of a compilation.
    """
    yield
    maps = Path("/proc/self/maps")
    if not maps.exists() or maps.read_bytes().count(b"\n") > MOST_MAPPINGS:
        jax.clear_caches()
