"""`rotorjax doctor`: what this machine computes with, and whether it computes right."""

import argparse
import os
import platform
import sys

PACKAGES = ("jax", "jaxlib", "numpy", "scipy", "equinox", "optax", "optimistix", "xarray", "matplotlib")


def register(commands: argparse._SubParsersAction) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "doctor",
        help="versions, devices, caches and a check of the compiler",
        description="Print what a report of a fault should hold, and check a sum that one version of jax gets wrong. "
        "Exit code 1 where it is wrong.",
    )
    parser.set_defaults(run=run, free_wake=lambda _: False)


def run(chosen: argparse.Namespace) -> int:
    """Print; the exit code."""
    from importlib.metadata import version

    import jax

    from rotorjax import __version__
    from rotorjax.io import program_cache

    right = _products_are_right()
    programs = jax.config.values["jax_compilation_cache_dir"] or program_cache.caches()
    rows = {
        "rotorjax": __version__,
        "python": f"{platform.python_version()}, {platform.system()} {platform.machine()}",
        "packages": ", ".join(f"{name} {version(name)}" for name in PACKAGES),
        "devices": ", ".join(f"{d.platform} ({d.device_kind})" for d in jax.devices()),
        "cores": str(os.cpu_count()),
        "precision": "float64" if jax.config.values["jax_enable_x64"] else "float32",
        "programs": str(programs),
        "XLA_FLAGS": os.environ.get("XLA_FLAGS", "").strip() or "none",
        "terminal": f"{sys.stdout.encoding}",
        "compiler": "right" if right else "WRONG: jitted matrix products differ from numpy's; take another jax",
    }
    width = max(map(len, rows))
    print("\n".join(f"{name:{width}s}  {value}" for name, value in rows.items()))
    return 0 if right else 1


def _products_are_right() -> bool:
    """Whether jitted matrix products are right at the size that jax 0.10.2 gets wrong (tests/test_canary.py)."""
    import jax
    import jax.numpy as jnp
    import numpy as np

    rng = np.random.default_rng(0)
    matrix, vectors = rng.normal(size=(3, 3)), rng.normal(size=(16_385, 3))
    found = jax.jit(jax.vmap(lambda row: jnp.sum((jnp.asarray(matrix) @ row) ** 2)))(vectors)
    return bool(np.allclose(found, np.sum((vectors @ matrix.T) ** 2, axis=1), rtol=1e-4))
