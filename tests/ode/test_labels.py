import equinox as eqx
import jax.numpy as jnp
import pytest
from jaxtyping import Array

from rotorjax.errors import InputError
from rotorjax.ode.labels import labels, select, units_of


class Controls(eqx.Module):
    collective: Array
    wind: Array
    ground: dict


TREE = Controls(jnp.array(0.1), jnp.zeros((2, 2)), {"height": jnp.array(1.0)})
NAMES = ("collective", "wind[0,0]", "wind[0,1]", "wind[1,0]", "wind[1,1]", "ground.height")


def test_names_follow_the_tree():
    assert labels(TREE, "u") == NAMES
    assert labels(jnp.zeros(2), "x") == ("x[0]", "x[1]")
    assert labels(jnp.array(0.0), "x") == ("x",)


def test_choosing():
    assert list(select(NAMES, ["ground", "wind[1,0]", "collective"], "inputs")) == [5, 3, 0]
    assert list(select(NAMES, "wind", "inputs")) == [1, 2, 3, 4]
    assert list(select(NAMES, None, "inputs")) == list(range(6))
    with pytest.raises(InputError, match=r"`inputs` must name .* 'colective': try collective"):
        select(NAMES, ["colective"], "inputs")
    with pytest.raises(InputError, match="win"):
        select(NAMES, ["win"], "inputs")  # a prefix is not a name


def test_units():
    assert units_of(NAMES, {"wind": "m/s", "wind[1,1]": "kt", "ground": "R"}) == ("-", "m/s", "m/s", "m/s", "kt", "R")
    assert units_of(("a",), None) == ("-",)
