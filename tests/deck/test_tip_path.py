"""Flapping of the tip-path plane against closed forms, a single blade and differences."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rotorjax.deck.blades import linear_blades, stations
from rotorjax.deck.march import simulate
from rotorjax.deck.over_ground import controls, output, over_ground, trim
from rotorjax.deck.state_space import state_space
from rotorjax.deck.tip_path import TipPath, blades_at, tip_path
from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.ground_table import ground_table
from rotorjax.potential.model import finite_state_model, wake_over
from rotorjax.potential.moving_ground import GroundMotion, still
from rotorjax.potential.wake_edge import left_of_tilt
from rotorjax.potential.wake_transport import wake_transport
from rotorjax.rotor.catalogue import load
from rotorjax.rotor.flap_lag import flap_frequency

SOLIDITY, SLOPE = 0.0822, 5.73
BLADES = linear_blades(SOLIDITY, SLOPE)


@pytest.fixture(scope="module")
def uh60():
    return tip_path(*load("uh60"))


def changed(flapping: TipPath, **values: float) -> TipPath:
    return eqx.tree_at(
        lambda f: [getattr(f.blade, name) for name in values], flapping, [jnp.asarray(v) for v in values.values()]
    )


def lock_number(flapping: TipPath) -> float:
    """γ = ρacR⁴/I."""
    return float(flapping.blade.air * flapping.share * SOLIDITY * SLOPE)


@jax.jit
def acceleration(flapping, flap, flap_rate, pitch, inflow, mu, climb_rate):
    """In an inflow λ₀ + r(λ₁c cos ψ + λ₁s sin ψ), blades from the hinge to the tip."""
    at = stations_of(flapping)
    angle, rate = blades_at(flap, flap_rate, at.psi)
    cyclic = inflow[1] * jnp.cos(at.psi) + inflow[2] * jnp.sin(at.psi)
    down = inflow[0] + cyclic[:, None] * at.r + flapping.downwash(angle, rate, mu, at)
    loading = BLADES.loading(down, pitch + flapping.pitch(angle)[:, None], mu, at)
    return flapping.acceleration(flap, flap_rate, loading, climb_rate, at)


def stations_of(flapping):
    at, e = stations(0.0, 12, 6), flapping.blade.offset
    return eqx.tree_at(lambda s: (s.r, s.widths), at, (e + (1 - e) * at.r, (1 - e) * at.widths))


slopes = jax.jit(jax.jacfwd(acceleration, (1, 2, 3, 4)))


def settled(flapping, pitch=0.15, inflow=(0.04, 0.0, 0.0), mu=0.0, climb_rate=0.0):
    flap, rest = jnp.zeros(3), jnp.zeros(3)
    given = tuple(jnp.asarray(v, float) for v in (pitch, inflow, mu, climb_rate))
    for _ in range(6):
        by_flap = slopes(flapping, flap, rest, *given)[0]
        flap = flap - jnp.linalg.solve(by_flap, acceleration(flapping, flap, rest, *given))
    return np.array(flap)


def test_modes_are_those_of_a_hinged_blade_seen_from_the_hub(uh60):
    """p² + Cp + ν² = 0 turned by 0 and ±1 per rev, C = γ/2 ∫ r(r − e)² dr = γ/8 (1 − e)³(1 + e/3): damping −γ/16."""
    blade = changed(uh60, gravity=0.0, flap_spring=0.05, coupling=0.0)
    zero, e = jnp.zeros(()), float(uh60.blade.offset)
    by_flap, by_rate = slopes(blade, jnp.zeros(3), jnp.zeros(3), zero, jnp.zeros(3), zero, zero)[:2]
    found = np.linalg.eigvals(np.block([[np.zeros((3, 3)), np.eye(3)], [by_flap, by_rate]]))
    damping = lock_number(blade) / 8 * (1 - e) ** 3 * (1 + e / 3)
    own = -damping / 2 + 1j * np.sqrt(float(flap_frequency(blade.blade)) ** 2 - damping**2 / 4)
    expected = np.array([p + 1j * n for p in (own, np.conj(own)) for n in (-1, 0, 1)])
    np.testing.assert_allclose(np.sort_complex(found.round(9)), np.sort_complex(expected.round(9)), atol=1e-8)
    assert 0.9 < lock_number(blade) / 16 / -own.real < 1.2


def test_coning_is_the_balance_of_moments(uh60):
    """ν²β₀ = γ/2 ∫ (r − e)(θr² − λr) dr − S(g + ḧ) + kβ_p, to first order in β₀."""
    blade = changed(uh60, flap_spring=0.05, precone=0.02)
    r, widths = (np.array(v) for v in (stations_of(blade).r, stations_of(blade).widths))
    lift = widths @ ((r - float(blade.blade.offset)) * (0.15 * r**2 - 0.04 * r))
    weight = float(blade.blade.first_moment * blade.blade.gravity)
    expected = lock_number(blade) / 2 * lift - 3 * weight + 0.05 * 0.02
    found = settled(blade, climb_rate=2 * blade.blade.gravity)
    np.testing.assert_allclose(found[0], expected / float(flap_frequency(blade.blade)) ** 2, rtol=0.01)
    np.testing.assert_allclose(found[1:], 0, atol=1e-14)
    central = changed(uh60, offset=0.0, gravity=0.0)
    np.testing.assert_allclose(settled(central)[0], lock_number(central) / 8 * (0.15 - 4 / 3 * 0.04), rtol=0.01)


def test_a_centrally_hinged_disk_follows_cyclic_inflow_a_quarter_turn_later(uh60):
    """β₁s = −λ₁c and β₁c = λ₁s: the flapping velocity takes the place of the inflow."""
    weightless = changed(uh60, offset=0.0, gravity=0.0)
    flap = settled(weightless, 4 / 3 * 0.04, inflow=(0.04, 0.008, 0.003))  # no coning, which shifts the phase
    np.testing.assert_allclose(flap[1:], [0.003, -0.008], rtol=0.01)


def test_tilt_is_that_of_one_blade_in_the_turning_frame(uh60):
    """One blade's own equation, nonlinear in β, marched for 25 turns in cyclic inflow with pitch-flap coupling."""
    blade = changed(uh60, coupling=0.3, flap_spring=0.03, precone=0.02)
    at, b = stations_of(blade), blade.blade
    e, s, air, gravity = (float(v) for v in (b.offset, b.first_moment, b.air * blade.share, b.gravity))
    r, arm = np.array(at.r), np.array(at.r) - e
    inflow = np.array([0.04, 0.008, 0.003])

    def rate(psi, x):
        down = inflow[0] + r * (inflow[1] * np.cos(psi) + inflow[2] * np.sin(psi)) + arm * x[1]
        lift = SOLIDITY * SLOPE / 2 * r * ((0.15 - 0.3 * (x[0] - 0.02)) * r - down)
        held = np.sin(x[0]) * (np.cos(x[0]) + e * s) + s * gravity * np.cos(x[0]) + 0.03 * (x[0] - 0.02)
        return x[1], air * (np.array(at.widths) @ (arm * lift)) - held

    psi = 2 * np.pi * (24 + np.arange(24) / 24)
    beta = solve_ivp(rate, (0, psi[-1]), [0.0, 0.0], t_eval=psi, rtol=1e-8, atol=1e-10).y[0]
    expected = [beta.mean(), 2 * np.mean(beta * np.cos(psi)), 2 * np.mean(beta * np.sin(psi))]
    np.testing.assert_allclose(settled(blade, inflow=inflow), expected, rtol=1e-3, atol=1e-7)


def test_a_wind_tilts_the_disk_back(uh60):
    """β₁c = −μ(8θ/3 − 2λ)/(1 − μ²/2) + …: a centrally hinged blade, flapping up before and down behind (ψ = 0 aft)."""
    theta, lam, mu = 0.15, 0.1, 0.05  # little coning, which shifts the phase
    flap = settled(changed(uh60, offset=0.0, gravity=0.0), theta, (lam, 0.0, 0.0), mu)
    np.testing.assert_allclose(flap[1], -mu * (8 / 3 * theta - 2 * lam) / (1 - mu**2 / 2), rtol=0.01)
    np.testing.assert_allclose(flap[2], -4 / 3 * mu * flap[0] / (1 + mu**2 / 2), rtol=0.01)


@pytest.fixture(scope="module")
def model(uh60):
    rotor = finite_state_model(harmonics=1, radial_terms=1, ground_harmonics=1, quadrature=DiskQuadrature(10, 8))
    transport = wake_transport(1.7, 4)
    table = ground_table(rotor, (0.7, 1.5), (-6.0, 6.0), transport=transport, nodes=(8, 3, 1))
    return over_ground(rotor, table, BLADES, "dynamic", transport, stations(0.1, 6, 6), uh60)


def test_trim_settles_flapping_and_the_linear_model_has_it(model, uh60):
    now = controls(still(plane(1.0, 5.0)), model.rotor, 0.15)
    linear = state_space(model, state := trim(model, now), now, outputs=["beta_0", "beta_1s"])
    assert linear.states[-6:] == tuple(f"{name}[{i}]" for name in ("flap", "flap_rate") for i in range(3))
    assert linear.order == 5 * len(model.rotor.modes) + 6
    assert linear.output_units == ("rad", "rad")
    assert linear.poles().real.max() < -0.05
    found = output(jnp.zeros(()), state, now, model)
    assert 0.03 < found.beta_0 < 0.1
    np.testing.assert_allclose(found.beta_1s, -found.cosine, rtol=0.2)  # less inflow where the ground is near
    left = left_of_tilt(wake_over(model.rotor, plane(1.0)), jnp.zeros(()), jnp.ones(()))
    assert -0.0005 < found.cosine < -0.0005 * left  # a rigid edge: below -0.0005


def test_derivatives_of_a_march(model):
    psi = jnp.linspace(0, 3, 11)
    start = trim(model, controls(still(plane(1.0)), model.rotor, 0.15))

    def f(v):
        ground = GroundMotion(v[0] + v[1] * jnp.sin(psi), v[1] * psi / 3, v[1] * jnp.cos(psi), 0 * psi)
        found = simulate(model, start, psi, controls(ground, model.rotor, v[2], climb_rate=v[3] * jnp.cos(psi))).outputs
        return jnp.stack([found.thrust[-1], found.beta_0[-1], found.beta_1s[-1]])

    v, step = jnp.array([1.0, 0.05, 0.15, 0.002]), 1e-5
    everything = jax.jit(lambda v: (f(v), jax.jacfwd(f)(v), jax.jacrev(f)(v)))
    _, forward, reverse = everything(v)
    ends = [[everything(v + sign * step * e)[0] for e in np.eye(4)] for sign in (1, -1)]
    differences = np.subtract(*ends).T / (2 * step)
    np.testing.assert_allclose(forward, differences, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(reverse, differences, rtol=1e-6, atol=1e-9)


def test_bad_input(model, uh60):
    with pytest.raises(InputError, match="but there are no blades"):
        over_ground(model.rotor, model.table, None, "dynamic", model.transport, tip_path=uh60)
    with pytest.raises(InputError, match="4 azimuths at least, but there are 3"):
        over_ground(model.rotor, model.table, BLADES, "dynamic", model.transport, stations(0.1, 6, 3), uh60)
    with pytest.raises(InputError, match="must have hinge data"):
        tip_path(*load("caradonna_tung"))
