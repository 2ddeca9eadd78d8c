"""How the tests' processes and the notebooks' kernels have jax lower and compile; conftest.py says with which flags."""

import itertools
import sys
import threading

import equinox as eqx
import jax
from jax._src.interpreters import mlir

from rotorjax.cli import HAS_OLDER_WAY

LOWERED_TOGETHER = 200  # programs; a context keeps what it has seen, constants too
MUCH_RUN = {
    "xla_backend_optimization_level": 1,
    "xla_llvm_disable_expensive_passes": False,
} | ({"xla_cpu_use_fusion_emitters": True} if HAS_OLDER_WAY else {})
# a residual's linear map, which GMRES applies some hundred times in a solve, and marches
RUN_LONG = [
    ("rotorjax.ode.linear", "_product", jax.jit),
    ("rotorjax.ode.trajectory", "_stretch", eqx.filter_jit),
]
KERNEL = """
import sys
sys.path.insert(0, {tests!r})
import compiling
compiling.lower_together()
get_ipython().events.register("pre_run_cell", compiling.to_be_run)
sys.path.pop(0)
del sys, compiling
"""


def lower_together():
    """Many programs are lowered in one MLIR context: jax makes one for each, which takes longer than a small program.

    One for each is still made within another's lowering and in other threads. Of jax's own parts, and so only where it
    has them.
    """
    make = getattr(mlir, "make_ir_context", None)
    if make is None:
        return
    uses, shared = itertools.count(), [None]

    def context():
        if mlir.ir.Context.current is not None or threading.current_thread() is not threading.main_thread():
            return make()
        if next(uses) % LOWERED_TOGETHER == 0:
            shared[0] = make()
        return shared[0]

    mlir.make_ir_context = context


def to_be_run(*_):
    """Programs that run longer than they take to compile are compiled to be run, in the modules that are there."""
    for of, name, jit in [row for row in RUN_LONG if row[0] in sys.modules]:
        module = sys.modules[of]
        setattr(module, name, jit(getattr(module, name).__wrapped__, compiler_options=MUCH_RUN))
        RUN_LONG.remove((of, name, jit))
