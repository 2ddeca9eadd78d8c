"""The finite-state model behind the rotor's interface: momentum theory, the wind's direction, the ground."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.ground import plane
from rotorjax.inflow.finite_state import finite_state
from rotorjax.inflow.interface import DiskLoads
from rotorjax.potential.model import inflow, steady_state
from rotorjax.rotor.hub import rotor_inputs

NODES, WEIGHTS = np.polynomial.legendre.leggauss(10)
NU = (1 - NODES) / 2
R = jnp.asarray(np.sqrt(1 - NU**2))
WIDTHS = jnp.asarray(WEIGHTS / 2 * NU) / R  # dr = −ν dν/r: exact for a loading with r √(1 − r²) in it
PSI = jnp.pi / 2 * jnp.arange(4)
THRUST = 0.006


def elliptic_loads():
    """Four equal blades with the loading of the first pressure mode, 3 C_T r √(1 − r²) over the disk."""
    lift = jnp.broadcast_to(jnp.pi / 4 * 3 * THRUST * R * jnp.sqrt(1 - R**2), (4, R.size))
    points = jnp.stack([R * jnp.cos(PSI)[:, None], R * jnp.sin(PSI)[:, None], 0 * R * PSI[:, None]], axis=-1)
    return DiskLoads(lift, points, WIDTHS, PSI, R, jnp.asarray(THRUST))


@pytest.fixture(scope="module")
def model():
    return finite_state(plane(1.0), harmonics=1, radial_terms=1)


@pytest.fixture(scope="module")
def found(model):
    """Velocities and rates at the start of hover and of forward flight, and the slope of the inflow over height."""

    def run(model, u):
        loads = elliptic_loads()
        x = model.start(loads.thrust, u)

        def down(height):
            return -model.velocity(x, loads.points, eqx.tree_at(lambda u: u.height, u, height))[..., 2]

        return down(u.height), model.rate(x, loads, u), jax.jvp(down, (u.height,), (jnp.ones(()),))[1]

    program = eqx.filter_jit(run)
    flights = {"hover": {}, "ahead": {"u": 0.15}, "port": {"v": -0.15}, "tiny": {"u": 3e-7, "v": 4e-7}}
    return {name: program(model, rotor_inputs(height=1.0, **u)) for name, u in flights.items()}


def test_steady_in_hover_with_momentum_theorys_inflow(model, found):
    """One mode carries the thrust: a = τ/V, the potential model's own steady state, ground included."""
    down, rate, _ = found["hover"]
    np.testing.assert_allclose(rate, 0.0, atol=1e-9)
    tau = jnp.zeros(len(model.model.modes)).at[model.model.modes.index(0, 1)].set(np.sqrt(3) / 4 * THRUST)
    expected = inflow(steady_state(model.model, tau), R, PSI, model.model)
    np.testing.assert_allclose(down, expected, atol=1e-9)


def test_wind_from_ahead_builds_up_inflow_aft(model, found):
    _, rate, _ = found["ahead"]
    modes = model.model.modes
    cosine = modes.index(1, 2)
    assert float(rate[cosine]) > 1e-4
    sine = next(k for k, m in enumerate(modes.modes) if m.kind == "sin")
    assert float(rate[sine]) == pytest.approx(0.0, abs=1e-12)


def test_the_wind_may_come_from_anywhere(model, found):
    """To port: the wake goes to starboard, and what was aft is there."""
    modes = model.model.modes
    cosine, sine = modes.index(1, 2), next(k for k, m in enumerate(modes.modes) if m.kind == "sin")
    (_, ahead, _), (_, port, _) = found["ahead"], found["port"]
    np.testing.assert_allclose(port[sine], ahead[cosine], rtol=1e-12)
    np.testing.assert_allclose(port[0], ahead[0], rtol=1e-12)
    np.testing.assert_allclose(port[cosine], 0.0, atol=1e-15)


def test_derivatives_by_the_wind_at_rest(model, found):
    """In still air, where the wind has no direction, they are those of a faint wind: along u, and across along v."""
    modes = model.model.modes
    cosine, sine = modes.index(1, 2), next(k for k, m in enumerate(modes.modes) if m.kind == "sin")

    def rate(u, v):
        at = eqx.tree_at(lambda i: (i.u, i.v), rotor_inputs(height=1.0), (u, v))
        return model.rate(model.start(jnp.asarray(THRUST), at), elliptic_loads(), at)

    slopes = jax.jit(jax.jacfwd(rate, (0, 1)))(jnp.zeros(()), jnp.zeros(()))
    _, faint, _ = found["tiny"]
    np.testing.assert_allclose(slopes[0][cosine], faint[cosine] / 3e-7, rtol=1e-4)
    np.testing.assert_allclose(slopes[1][sine], faint[sine] / 4e-7, rtol=1e-4)
    assert float(slopes[0][cosine]) > 0


def test_the_ground_takes_inflow_away_and_less_of_it_higher_up(found):
    down, _, slope = found["hover"]
    assert float(jnp.mean(down)) < np.sqrt(THRUST / 2)
    assert float(jnp.mean(slope)) > 0


def test_a_disk_that_stands_askew_sees_a_slope(model):
    """Nose up over level ground is upright over ground that rises aft; rolled to starboard, the same a quarter on."""
    points, slope = elliptic_loads().points, 0.2
    x = model.start(jnp.asarray(THRUST), rotor_inputs(height=1.0))
    velocity = eqx.filter_jit(lambda model, x, points, u: model.velocity(x, points, u))
    sloping = eqx.tree_at(lambda m: m.model.ground.slope, model, jnp.asarray(slope))
    upright = velocity(sloping, x, points, rotor_inputs(height=1 / np.cos(slope), pitch=0.0))
    np.testing.assert_allclose(velocity(model, x, points, rotor_inputs(height=1.0, pitch=slope)), upright, atol=1e-14)
    quarter = jnp.stack([-points[..., 1], points[..., 0], points[..., 2]], axis=-1)
    rolled = velocity(model, x, quarter, rotor_inputs(height=1.0, roll=slope))
    np.testing.assert_allclose(rolled, upright, atol=1e-14)
    assert float(jnp.ptp(upright[..., 2])) > 1e-3
