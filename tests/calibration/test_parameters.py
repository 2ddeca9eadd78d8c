import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.calibration.parameters import Parameter, ParameterSet
from rotorjax.errors import InputError

PAIR = ParameterSet("pair", (Parameter("a", 0.1, 2.0, 1.0, "first"), Parameter("b", -1.0, 1.0, 0.0, "second")))


def test_the_map_has_an_inverse_and_never_leaves_the_range():
    values = jnp.array([[0.2, -0.9], [1.9, 0.5]])
    np.testing.assert_allclose(PAIR.bounded(PAIR.unbounded(values)), values, rtol=1e-14)
    far = PAIR.bounded(jnp.array([-40.0, 40.0]))
    assert np.all((far >= PAIR.lower) & (far <= PAIR.upper))


def test_derivative_of_the_map():
    z, h = jnp.array([0.3, -0.7]), 1e-6
    difference = (PAIR.bounded(z + h) - PAIR.bounded(z - h)) / (2 * h)
    np.testing.assert_allclose(jnp.diag(jax.jacrev(PAIR.bounded)(z)), difference, rtol=1e-8)


def test_names_values_and_subsets():
    assert PAIR.subset(["b"]).names == ("b",)
    assert PAIR.table(PAIR.vector({"b": 0.25})) == {"a": 1.0, "b": 0.25}
    np.testing.assert_array_equal(PAIR.complete(jnp.array([0.5]), ("b",), jnp.array([1.5, 0.0])), [1.5, 0.5])
    assert PAIR.at_bound(np.array([0.1001, 0.0])) == ("a",)
    assert PAIR.at_bound(np.array([0.5, 0.9999])) == ("b",)
    assert PAIR.at_bound(np.array([0.5, 0.5])) == ()


BAD = {
    "is empty": lambda: ParameterSet("none", ()),
    "must not repeat": lambda: ParameterSet("twice", PAIR.parameters[:1] * 2),
    "lower < upper": lambda: ParameterSet("flat", (Parameter("a", 1.0, 1.0, 1.0, ""),)),
    "but holds 'c'": lambda: PAIR.subset(["c"]),
    "must hold 2 values": lambda: PAIR.check([0.5]),
    r"`a` must lie inside \(0.1, 2\), but is 3": lambda: PAIR.check([3.0, 0.0]),
    "but is nan": lambda: PAIR.check([1.0, np.nan]),
}


@pytest.mark.parametrize("message", BAD)
def test_bad_input_is_named(message):
    with pytest.raises(InputError, match=message):
        BAD[message]()
