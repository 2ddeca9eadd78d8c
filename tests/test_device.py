"""Where a program will run."""

import jax
import jax.numpy as jnp
import pytest

from rotorjax import device


def test_a_cpu_is_a_cpu():
    assert device.on_cpu()
    with jax.default_device(jax.devices("cpu")[0]):
        assert device.on_cpu()
    with jax.default_device("cpu"):
        assert device.on_cpu()


@pytest.mark.parametrize(("cpu", "precision"), [(True, "DEFAULT"), (False, "HIGHEST")])
def test_products_keep_their_digits_on_an_accelerator(cpu, precision, monkeypatch):
    monkeypatch.setattr(device, "on_cpu", lambda: cpu)
    with device.full_products():
        text = jax.jit(jnp.matmul).lower(jnp.ones((2, 2)), jnp.ones((2, 2))).as_text()
    assert f"precision = [{precision}, {precision}]" in text
