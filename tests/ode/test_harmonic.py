import jax.numpy as jnp
import numpy as np
import pytest
from systems import F, turning

from rotorjax.errors import InputError
from rotorjax.ode.collocation import collocate
from rotorjax.ode.harmonic import average, harmonic_model
from rotorjax.ode.linearise import linearise

TURN = 2 * np.pi


def model_of(rhs, output, n, nodes, u, p=None, period=TURN):
    orbit = collocate(rhs, jnp.zeros((5, n)), period, u, p, tol=1e-12)
    return linearise(rhs, output, orbit, u, p, nodes=nodes)


def modulated(t, x, u, p):
    """x₁ is driven directly, x₂ by cos t · x₁: harmonics 0 and 1 are all there are."""
    return jnp.stack([-0.7 * x[0] + u["push"], -0.4 * x[1] + jnp.cos(t) * x[0]])


def demodulated(t, x, u, p):
    return {"signal": 2 * jnp.cos(t) * x[1], "direct": x[0]}


PUSH = {"push": jnp.array(0.0)}


def test_transfer_function_is_exact():
    """u → y₀: (s + b)/[((s + b)² + 1)(s + a)], by hand."""
    model = harmonic_model(model_of(modulated, demodulated, 2, 9, PUSH), (0, 1))
    assert model.order == 6
    assert model.states == ("x[0]", "x[1]", "x[0]|1c", "x[1]|1c", "x[0]|1s", "x[1]|1s")
    omega = np.array([0.0, 0.3, 1.0, 1.7, 5.0])
    s = 1j * omega
    exact = (s + 0.4) / (((s + 0.4) ** 2 + 1) * (s + 0.7))
    np.testing.assert_allclose(model.response(omega)[:, model.outputs.index("signal"), 0], exact, rtol=1e-11)


def test_averaging_misses_what_is_modulated():
    model = average(model_of(modulated, demodulated, 2, 9, PUSH))
    omega = np.array([0.5])
    assert abs(model.response(omega)[0, model.outputs.index("signal"), 0]) < 1e-13
    np.testing.assert_allclose(model.response(omega)[0, model.outputs.index("direct"), 0], 1 / (0.5j + 0.7), rtol=1e-12)


def test_poles_are_the_floquet_exponents():
    """A system constant in turning axes: exponents of 0.7 F, shifted by i at most, are exact with one harmonic."""

    def rhs(t, x, u, p):
        return turning(t, x, p)

    def output(t, x, u, p):
        return x[0]

    poles = harmonic_model(model_of(rhs, output, 2, 9, jnp.zeros(1), 0.7), (0, 1)).poles()
    for exponent in np.linalg.eigvals(0.7 * np.array(F)):
        assert np.abs(poles - exponent).min() < 1e-12


def test_input_and_output_harmonics():
    """A pure gain y = cos 2t · u·cos 2t... : u|2c reaches y|0 with ½."""

    def rhs(t, x, u, p):
        return -x + jnp.cos(2 * t) * u

    def output(t, x, u, p):
        return {"y": x[0]}

    model = harmonic_model(model_of(rhs, output, 1, 17, jnp.zeros(1)), (0, 2, 4), (0, 2), (0, 2))
    at = model.response(np.array([0.0]))[0]
    row, column = model.outputs.index("y"), model.inputs.index("u[0]|2c")
    np.testing.assert_allclose(at[row, column], 0.5, rtol=1e-12)
    assert model.inputs == ("u[0]", "u[0]|2c", "u[0]|2s")
    c = at[model.outputs.index("y|2c"), model.inputs.index("u[0]")]
    np.testing.assert_allclose(c, 0.2, rtol=1e-12)  # x' + x = cos 2t


def test_other_periods():
    """Time stretched three times: the same responses at a third of the frequency."""

    def slow(t, x, u, p):
        return modulated(t / 3, x, u, p) / 3

    def output(t, x, u, p):
        return demodulated(t / 3, x, u, p)

    one = harmonic_model(model_of(modulated, demodulated, 2, 9, PUSH), (0, 1))
    two = harmonic_model(model_of(slow, output, 2, 9, PUSH, period=3 * TURN), (0, 1))
    omega = np.array([0.2, 1.5])
    np.testing.assert_allclose(two.response(omega / 3), one.response(omega), rtol=1e-10)


def test_bad_input():
    model = model_of(modulated, demodulated, 2, 9, PUSH)
    with pytest.raises(InputError, match=r"\[0, 2\] for 9 times a period, but reach 3: linearise at 13 times"):
        harmonic_model(model, (0, 3))
    with pytest.raises(InputError, match="harmonics"):
        harmonic_model(model, (-1,))
