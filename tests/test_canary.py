"""Watches for miscompiled code: the reason of the jax pin in pyproject.toml.

jax 0.10.2 on a CPU makes the jitted `vmap(sum((M @ row)**2))` 0.8 % wrong at 16 385 float64 rows and right below (jax
issue 39103); 0.11.2 computes wrong with 512-bit registers, which a march asked for (canary.py `wide`). The tests
compile with less care than users do (conftest.py), so this is asked in processes of its own.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rotorjax.cli import WITHOUT_FREE_WAKE


@pytest.mark.parametrize("flags", ["", WITHOUT_FREE_WAKE], ids=["default", "without free wake"])
def test_users_programs_are_right_at_the_size_that_broke(flags):
    env = os.environ | {"XLA_FLAGS": flags, "JAX_ENABLE_COMPILATION_CACHE": "false"}
    script = Path(__file__).with_name("canary.py")
    ran = subprocess.run([sys.executable, str(script)], env=env, capture_output=True, text=True, check=False)
    assert ran.stdout == "right\n", ran.stderr


def test_the_tests_own_programs_are_right():
    from canary import airfoil, products, wide

    products(3, 16_385)
    airfoil()
    wide(np.float32)
    wide(np.float64)
