import jax.numpy as jnp
import numpy as np
import pytest
from systems import van_der_pol

from rotorjax.errors import InputError
from rotorjax.ode.collocation import collocate
from rotorjax.ode.linearise import linearise
from rotorjax.ode.trajectory import integrate

U = {"force": jnp.array([1.5, 1.1]), "bias": jnp.array(0.0)}
PERIOD = 2 * np.pi / 1.1


def rhs(t, x, u, p):
    slope = van_der_pol(t, x, u["force"], p)
    return {**slope, "rate": slope["rate"] + u["bias"]}


def output(t, x, u, p):
    return {
        "energy": 0.5 * (x["position"] ** 2 + x["rate"] ** 2) + u["bias"],
        "pair": jnp.stack([x["rate"], jnp.cos(t)]),
    }


def circle(nodes):
    psi = 2 * np.pi * np.arange(nodes) / nodes
    return {"position": jnp.array(2 * np.cos(psi)), "rate": jnp.array(-2 * np.sin(psi))}


@pytest.fixture(scope="module")
def orbit():
    return collocate(rhs, circle(61), PERIOD, U, 0.5, tol=1e-11)


def test_matrices_and_names(orbit):
    model = linearise(rhs, output, orbit, U, 0.5, units={"force": "N", "bias": "m", "pair": "m/s"}, chunk=2)
    assert model.states == ("position", "rate")
    assert model.inputs == ("bias", "force[0]", "force[1]")
    assert model.outputs == ("energy", "pair[0]", "pair[1]")
    assert model.input_units == ("m", "N", "N")
    assert model.output_units == ("-", "m/s", "m/s")
    x, v = np.array(orbit.x["position"]), np.array(orbit.x["rate"])
    zero, one, angle = 0 * x, 1 + 0 * x, 1.1 * np.array(orbit.t)
    a = np.array([[zero, one], [-x * v - 1, 0.5 * (1 - x**2)]])
    np.testing.assert_allclose(model.a, np.moveaxis(a, -1, 0), atol=1e-13)
    b = np.array([[zero, zero, zero], [one, np.cos(angle), -1.5 * np.array(orbit.t) * np.sin(angle)]])
    np.testing.assert_allclose(model.b, np.moveaxis(b, -1, 0), atol=1e-12)
    np.testing.assert_allclose(model.c[:, 0], np.stack([x, v], axis=1), atol=1e-13)
    np.testing.assert_allclose(model.d[:, 0, 0], 1)
    np.testing.assert_allclose(model.y[:, 0], 0.5 * (x**2 + v**2), rtol=1e-13)


def test_chosen_inputs_and_outputs(orbit):
    whole = linearise(rhs, output, orbit, U, 0.5)
    part = linearise(rhs, output, orbit, U, 0.5, inputs=["force[0]", "bias"], outputs=["pair"], chunk=1)
    np.testing.assert_allclose(part.b, whole.b[:, :, [1, 0]], atol=1e-14)
    np.testing.assert_allclose(part.c, whole.c[:, 1:], atol=1e-14)
    assert part.inputs == ("force[0]", "bias")
    assert part.u[0] == 1.5


def test_fewer_times(orbit):
    whole = linearise(rhs, output, orbit, U, 0.5)
    few = linearise(rhs, output, orbit, U, 0.5, nodes=5)
    assert few.t.shape == (5,)
    np.testing.assert_allclose(few.a[0], whole.a[0], atol=1e-10)


def test_linear_march_follows_the_nonlinear_one(orbit):
    """A small step of the bias: the periodic linear model's march against the nonlinear one."""
    small, steps = 1e-4, 120
    model = linearise(rhs, output, orbit, U, 0.5, inputs=["bias"], nodes=2 * steps)
    stepped = {**U, "bias": jnp.array(small)}
    runs = [integrate(rhs, orbit.start, 0.0, PERIOD / steps, 2 * steps, u, 0.5).x for u in (stepped, U)]
    energies = [0.5 * (x["position"] ** 2 + x["rate"] ** 2) for x in runs]
    times, linear = model.step(np.array([small]), periods=2)
    assert times[-1] == pytest.approx(2 * PERIOD)
    response = np.array(energies[0] - energies[1]) + small
    assert np.abs(linear[:, 0] - response).max() < 1e-3 * np.abs(response).max()


def test_linear_march_is_of_fourth_order(orbit):
    sizes = np.array([120, 170, 240, 340])
    ends = [
        linearise(rhs, output, orbit, U, 0.5, inputs=["bias"], nodes=int(n)).step(np.ones(1))[1][-1, 0]
        for n in [*sizes, 1600]
    ]
    errors = np.abs(np.array(ends[:-1]) - ends[-1])
    assert abs(-np.polyfit(np.log(sizes), np.log(errors), 1)[0] - 4) < 0.2


def test_bad_input(orbit):
    with pytest.raises(InputError, match=r"`inputs` must name what the model has, but has 'bais': try bias"):
        linearise(rhs, output, orbit, U, 0.5, inputs=["bais"])
    with pytest.raises(InputError, match="`outputs` must name"):
        linearise(rhs, output, orbit, U, 0.5, outputs=["thrust"])
    with pytest.raises(InputError, match="structure"):
        linearise(lambda t, x, u, p: x["rate"], output, orbit, U, 0.5)
    lost = collocate(rhs, circle(21), PERIOD, U, 0.5, max_iterations=1)
    with pytest.raises(InputError, match="must have converged"):
        linearise(rhs, output, lost, U, 0.5)
    with pytest.raises(InputError, match="even number"):
        linearise(rhs, output, orbit, U, 0.5).step(np.zeros(3))
