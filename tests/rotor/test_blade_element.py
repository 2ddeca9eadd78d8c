"""Blade elements: closed forms with a linear section, Kutta-Joukowski, sweep, symmetry, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.operating import operating_point
from rotorjax.rotor import blade_element, catalogue, geometry
from rotorjax.rotor.airfoil import lift_drag, linear_airfoil

SLOPE, DRAG, PHI, PITCH = 5.73, 0.011, 0.06, 0.15
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
R, WIDTHS = jnp.asarray(0.5 * (1 + NODES)), jnp.asarray(0.5 * WEIGHTS)
section_loads = jax.jit(blade_element.section_loads, static_argnames="simple_sweep")


@pytest.fixture(scope="module")
def rotor():
    airfoil = linear_airfoil(SLOPE, DRAG)
    return geometry.rotor("flat", 3, 2.0, 0.0, 0.12, airfoil, sweep=([0.0, 1.0], [0.0, 0.3]))


@pytest.fixture(scope="module")
def point():
    return operating_point(30.0, collective=PITCH)


@pytest.fixture(scope="module")
def helix(rotor, point):
    """Loads where the inflow angle is the same everywhere: u_T = r, u_P = r tan φ."""
    return section_loads(rotor, point, R, R, R * np.tan(PHI))


def test_angles_and_mach_number(rotor, point, helix):
    np.testing.assert_allclose(helix.inflow_angle, PHI, rtol=1e-14)
    np.testing.assert_allclose(helix.alpha, PITCH - PHI, rtol=1e-14)
    np.testing.assert_allclose(helix.mach, R / np.cos(PHI) * 60 / 340.294, rtol=1e-14)
    np.testing.assert_allclose(helix.cl, SLOPE * (PITCH - PHI), rtol=1e-13)


def test_lift_is_kutta_joukowskis(helix):
    np.testing.assert_allclose(helix.dlift, R / np.cos(PHI) * helix.circulation, rtol=1e-14)


def test_loads_in_si_are_the_textbook_ones(rotor, point, helix):
    """L' = ½ρV²c cl in N/m, brought to SI with ρΩ²R³; Γ with ΩR²."""
    v = R / np.cos(PHI) * 60.0
    np.testing.assert_allclose(helix.dlift * 1.225 * 30**2 * 2.0**3, 0.5 * 1.225 * v**2 * 0.12 * helix.cl, rtol=1e-13)
    np.testing.assert_allclose(helix.ddrag * 1.225 * 30**2 * 2.0**3, 0.5 * 1.225 * v**2 * 0.12 * helix.cd, rtol=1e-13)
    np.testing.assert_allclose(helix.circulation * 30 * 2.0**2, 0.5 * v * 0.12 * helix.cl, rtol=1e-13)


def test_coefficients_are_the_integrals_in_closed_form(rotor, helix):
    """C_T = σ(cl cos φ − cd sin φ)/(6 cos²φ), C_Pi = σ cl sin φ/(8 cos²φ), C_Pp = σ cd cos φ/(8 cos²φ)."""
    sigma, cl = float(geometry.solidity(rotor)), SLOPE * (PITCH - PHI)
    result = blade_element.rotor_coefficients(rotor, helix, R, WIDTHS)
    c, s = np.cos(PHI), np.sin(PHI)
    np.testing.assert_allclose(result.thrust, sigma * (cl * c - DRAG * s) / (6 * c**2), rtol=1e-13)
    np.testing.assert_allclose(result.induced, sigma * cl * s / (8 * c**2), rtol=1e-13)
    np.testing.assert_allclose(result.profile, sigma * DRAG * c / (8 * c**2), rtol=1e-13)
    assert result.power == result.induced + result.profile


def test_power_is_force_times_velocity(rotor, helix):
    """Power P = ∫ r·(in-plane force); thrust times the climb it overcomes leaves the drag's own: P = T u_P + D|u|."""
    result = blade_element.rotor_coefficients(rotor, helix, R, WIDTHS)
    axial = helix.dlift * np.cos(PHI) - helix.ddrag * np.sin(PHI)
    work = axial * R * np.tan(PHI) + helix.ddrag * R / np.cos(PHI)
    np.testing.assert_allclose(result.power, rotor.blades / np.pi * jnp.sum(work * WIDTHS), rtol=1e-13)


def test_disk_loading_integrates_to_the_lift(rotor, helix):
    mean = blade_element.mean_disk_loading(rotor, helix)
    cl = SLOPE * (PITCH - PHI)
    np.testing.assert_allclose(
        jnp.sum(mean * WIDTHS), float(geometry.solidity(rotor)) * cl / (6 * np.cos(PHI) ** 2), rtol=1e-13
    )


def test_mean_over_azimuth_equals_the_sum_over_the_blades(rotor, point):
    """Eq. 17 at one instant, averaged over instants, is the azimuth mean of the distribution."""
    psi = jnp.arange(12) * 2 * jnp.pi / 12
    u_t = R + 0.2 * jnp.sin(psi)[:, None]
    loads = section_loads(rotor, point, R, u_t, jnp.full_like(u_t, 0.05))
    instants = [sum(loads.dlift[(k + 4 * q) % 12] for q in range(3)) / jnp.pi for k in range(12)]
    np.testing.assert_allclose(blade_element.mean_disk_loading(rotor, loads), sum(instants) / 12, rtol=1e-13)
    assert blade_element.disk_loading(rotor, loads).shape == (12, R.size)


def test_collective_can_carry_cyclic_pitch(rotor, point):
    pitch = jnp.array([[0.1], [0.2]])
    loads = section_loads(rotor, point, R, jnp.stack([R, R]), jnp.zeros((2, R.size)), pitch)
    np.testing.assert_allclose(loads.alpha, jnp.broadcast_to(pitch, (2, R.size)), rtol=1e-14)


def test_more_inflow_less_lift(rotor, point):
    """Inflow is positive down: it reduces the angle of attack by its own angle."""
    down = section_loads(rotor, point, R, R, jnp.full_like(R, 0.02))
    up = section_loads(rotor, point, R, R, jnp.full_like(R, -0.02))
    assert jnp.all(down.dlift < up.dlift)


def test_reversed_flow_is_read_at_the_trailing_edge_first():
    rotor, point = catalogue.load("uh60")
    loads = section_loads(rotor, point, jnp.array([0.3]), jnp.array([-0.2]), jnp.array([0.0]))
    pitch = point.collective + geometry.twist(rotor, jnp.array([0.3]))
    expected = lift_drag(rotor.airfoil, pitch - jnp.pi, 0.2 * point.tip_mach(rotor.radius))
    np.testing.assert_allclose([loads.cl, loads.cd], expected, atol=1e-13)


def test_simple_sweep_rule(rotor, point):
    """Cos²Λ · a · atan(tan α/cos Λ) for a linear section; to first order the lift falls by cos Λ."""
    plain = section_loads(rotor, point, R, R, R * np.tan(PHI))
    swept = section_loads(rotor, point, R, R, R * np.tan(PHI), simple_sweep=True)
    cosine, alpha = np.cos(0.3 * R), PITCH - PHI
    np.testing.assert_allclose(swept.cl, cosine**2 * SLOPE * np.arctan(np.tan(alpha) / cosine), rtol=1e-12)
    np.testing.assert_allclose(swept.cl / plain.cl, cosine, rtol=1e-3)
    np.testing.assert_allclose(swept.cd, plain.cd, rtol=1e-12)


def test_caradonna_tung_sections_carry_the_measured_lift_at_the_measured_angle():
    """Prandtl-Glauert slope at M = 0.351 (r = 0.8): cl = 0.2886 was measured; that is 2.46° of incidence, below 8°."""
    rotor, point = catalogue.load("caradonna_tung")
    r = jnp.array([0.8])
    inflow = r * jnp.tan(jnp.deg2rad(8.0) - 0.2886 / (np.rad2deg(0.11) / jnp.sqrt(1 - (0.8 * 0.439) ** 2)))
    loads = section_loads(rotor, point, r, r, inflow)
    np.testing.assert_allclose(loads.cl, 0.2886, rtol=1e-3)
    assert 0.005 < float(loads.cd[0]) < 0.008


def test_still_air_carries_nothing_and_has_finite_derivatives(rotor, point):
    def lift(u):
        return section_loads(rotor, point, jnp.array([0.0]), u[:1], u[1:]).dlift[0]

    assert lift(jnp.zeros(2)) == 0
    np.testing.assert_array_equal(jax.grad(lift)(jnp.zeros(2)), 0)
    np.testing.assert_array_equal(jax.jacfwd(lift)(jnp.zeros(2)), 0)


def test_derivative_ladder():
    """In velocities, pitch, rotor speed and speed of sound: central differences, forward, reverse."""
    rotor, _ = catalogue.load("uh60")
    r = jnp.linspace(0.3, 0.97, 6)

    def outputs(x):
        moved = operating_point(x[0] * 27.0, sound_speed=340.294 * x[1])
        loads = blade_element.section_loads(rotor, moved, r, x[2] * r, 0.06 * x[3] * jnp.ones_like(r), 0.3 * x[4])
        result = blade_element.rotor_coefficients(rotor, loads, r, jnp.full_like(r, 0.13))
        return jnp.concatenate([loads.circulation, loads.dlift, loads.ddrag, jnp.stack(result)])

    x, values = jnp.ones(5), jax.jit(outputs)
    forward, reverse = jax.jit(jax.jacfwd(outputs))(x), jax.jit(jax.jacrev(outputs))(x)
    numeric = jnp.stack([(values(x + 1e-6 * e) - values(x - 1e-6 * e)) / 2e-6 for e in jnp.eye(5)], -1)
    np.testing.assert_allclose(forward, numeric, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(forward, reverse, rtol=1e-11, atol=1e-14)


def test_vmap_over_pitch_equals_broadcasting(rotor, point):
    pitch = jnp.array([0.1, 0.15, 0.2])
    mapped = jax.jit(jax.vmap(lambda p: blade_element.section_loads(rotor, point, R, R, 0.05 * R, p)))(pitch)
    ones = jnp.ones((3, 1))
    at_once = section_loads(rotor, point, R, ones * R, 0.05 * ones * R, pitch[:, None])
    np.testing.assert_allclose(mapped.dlift, at_once.dlift, rtol=1e-13)


def test_span_averages_keep_straight_lines():
    """Inside the span and at its ends, with uneven panels and a chord that varies."""
    average = blade_element.span_averages(R, WIDTHS, 0.05 + 0.1 * R)
    np.testing.assert_allclose(average @ (2.0 - 3.0 * R), 2.0 - 3.0 * R, rtol=1e-12)


def test_span_average_leaves_a_linear_section_alone(rotor, point):
    u_p = 0.05 * jnp.sin(7 * R)
    average = blade_element.span_averages(R, WIDTHS, jnp.full_like(R, 0.1))
    plain = section_loads(rotor, point, R, R, u_p)
    averaged = section_loads(rotor, point, R, R, u_p, span_mean=average)
    np.testing.assert_allclose(averaged.cl, plain.cl, rtol=1e-10)


def _wing_solutions(span_mean, starts):
    """Distinct circulations of an elliptic-root wing in stall, by Newton from random starts: 24 narrow panels."""
    panels, chord = 24, 0.12
    edges = jnp.linspace(-1, 1, panels + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    rise = (jnp.eye(panels, panels + 1) - jnp.eye(panels, panels + 1, 1)).T
    wash = (1 / (4 * jnp.pi * (middle[:, None] - edges[None, :]))) @ rise
    average = blade_element.span_averages(middle, jnp.diff(edges), jnp.full_like(middle, 0.5 * chord))
    average = average if span_mean else jnp.eye(panels)

    def lift(alpha):
        """Attached to 12°, then falling at 4 per rad, smoothly."""
        return 6.0 * alpha - 10.0 * 0.02 * jax.nn.softplus((alpha - np.deg2rad(12)) / 0.02)

    def residual(gamma):
        alpha = np.deg2rad(15) - wash @ gamma
        entry = average @ alpha
        return gamma - 0.5 * chord * (lift(entry) + 6.0 * (alpha - entry))

    def newton(_, gamma):
        step = jnp.linalg.solve(jax.jacfwd(residual)(gamma), -residual(gamma))
        return gamma + step * jnp.minimum(1.0, 0.02 / jnp.max(jnp.abs(step)))

    ends = jax.jit(jax.vmap(lambda start: jax.lax.fori_loop(0, 60, newton, start)))(starts)
    found = []
    for gamma in ends:
        if float(jnp.max(jnp.abs(residual(gamma)))) < 1e-10 and not any(
            jnp.allclose(gamma, g, atol=1e-6) for g in found
        ):
            found.append(gamma)
    return found


def test_stalled_wing_has_one_solution_with_span_averages_and_many_without():
    """The reason for span_averages: a falling lift curve on panels narrower than a chord."""
    starts = 0.07 + 0.03 * jax.random.normal(jax.random.PRNGKey(1), (12, 24))
    assert len(_wing_solutions(True, starts)) == 1
    assert len(_wing_solutions(False, starts)) > 1


def _growth(chords, fall):
    """Largest eigenvalue of ∂W/∂Γ − 1 of a wing stalled from tip to tip; at 0 its circulation folds."""
    panels, chord = 24, 0.12
    edges = np.linspace(-1, 1, panels + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    rise = (np.eye(panels, panels + 1) - np.eye(panels, panels + 1, 1)).T
    wash = (1 / (4 * np.pi * (middle[:, None] - edges))) @ rise
    average = np.asarray(
        blade_element.span_averages(*map(jnp.asarray, (middle, np.diff(edges), 0 * middle + chords * chord)))
    )
    slope = 0.5 * chord * (6.2 * (np.eye(panels) - average) - fall * average)
    return float(np.linalg.eigvals(-slope @ wash - np.eye(panels)).real.max())


def test_a_steep_stall_needs_a_longer_average():
    """The SC1095's lift falls at 5.7 per rad: half a chord leaves local folds, a chord (flight_settings) does not."""
    assert _growth(0.5, 5.7) > 0.1
    assert _growth(1.0, 5.7) < -0.2


def test_mean_angles_take_no_notice_of_the_turn():
    """Small differences: the plain mean. Across ±π: that of the same angles without the jump. Opposed: none."""
    average = blade_element.span_averages(R, WIDTHS, jnp.full_like(R, 0.1))
    small = 0.2 * jnp.sin(9 * R)
    np.testing.assert_allclose(blade_element.mean_angle(small, average), average @ small, atol=1e-15)
    turned = small + np.pi
    wrapped = jnp.arctan2(jnp.sin(turned), jnp.cos(turned))
    found = blade_element.mean_angle(wrapped, average)
    np.testing.assert_allclose(jnp.exp(1j * found), jnp.exp(1j * (average @ turned)), atol=1e-14)
    opposed = jnp.where(R < 0.5, np.pi, 0.0)
    np.testing.assert_allclose(blade_element.mean_angle(opposed, average), opposed, atol=1e-12)
