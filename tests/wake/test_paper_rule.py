"""The paper's own wake."""

import jax.numpy as jnp
import numpy as np

from rotorjax.wake.model import free_wake
from rotorjax.wake.paper_rule import paper_settings
from rotorjax.wake.roll_up import release


def test_one_filament_from_the_last_node_with_the_papers_core(uh60):
    model = free_wake(*uh60, None, paper_settings(sharpness=400.0))
    assert model.settings.filaments == 1
    gamma = 0.01 * jnp.sin(jnp.pi * model.stations)
    found = release(model, model.leading, gamma)
    np.testing.assert_array_equal(found.points[0], model.leading[-1])
    np.testing.assert_allclose(found.strength, jnp.max(gamma), rtol=5e-3)
    cores = [float(getattr(model.settings, f"{name}_core")) for name in ("tip", "near", "control")]
    assert cores == [0.05] * 3


def test_overrides_win():
    assert paper_settings(panels=8).panels == 8
    assert float(paper_settings(tip_core=0.02).tip_core) == 0.02
