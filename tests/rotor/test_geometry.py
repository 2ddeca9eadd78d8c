"""Blade geometry: tables read exactly, areas and sweep against hand integrals, derivatives, refusals."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.rotor import catalogue, geometry
from rotorjax.rotor.airfoil import linear_airfoil

AIRFOIL = linear_airfoil()


def make(**changes):
    arguments = {"name": "x", "blades": 3, "radius": 2.0, "root_cutout": 0.2, "chord": 0.1, "airfoil": AIRFOIL}
    return geometry.rotor(**(arguments | changes))


def test_tables_are_read_exactly_at_stations_and_linearly_between():
    rotor = make(chord=([0.2, 0.6, 1.0], [0.3, 0.2, 0.1]), twist=([0.0, 1.0], [0.2, -0.2]))
    np.testing.assert_allclose(geometry.chord(rotor, jnp.array([0.2, 0.4, 0.6, 1.0])), [0.15, 0.125, 0.1, 0.05])
    np.testing.assert_allclose(geometry.twist(rotor, jnp.array([0.0, 0.25, 0.75])), [0.2, 0.1, -0.1])


def test_solidity_of_a_rectangular_blade():
    np.testing.assert_allclose(geometry.solidity(make()), 3 * 0.1 / (np.pi * 2.0), rtol=1e-15)


def test_solidity_of_a_tapered_blade_is_its_area_over_the_disks():
    rotor = make(chord=([0.0, 1.0], [0.3, 0.1]))
    np.testing.assert_allclose(geometry.solidity(rotor), 3 * (0.2 * 2.0) / (np.pi * 4.0), rtol=1e-15)


def test_uh60_solidity_is_the_published_one_with_the_streamwise_chord_of_the_swept_tip():
    """0.0826 and the blade area of 186.9 ft² (Table 1) hold the tip's chord along the flow, 20.76 in/cos 20°."""
    rotor = catalogue.load("uh60")[0]
    root, tab, tip = 20.76 * 0.0254, (20.965 - 20.76) * 0.0254, 1 - 0.9286
    plain = 4 / (np.pi * 8.177784) * (root + tab * (0.8629 - 0.7316))
    np.testing.assert_allclose(geometry.solidity(rotor), plain, rtol=1e-5)
    streamwise = plain + 4 / (np.pi * 8.177784) * root * (1 / np.cos(np.deg2rad(20)) - 1) * tip
    assert abs(streamwise - 0.0826) < 5e-5
    area = streamwise * np.pi * 26.83**2
    np.testing.assert_allclose(area, 186.9, rtol=1e-3)


def test_sweep_offset_of_a_constant_sweep_is_a_straight_line():
    rotor = make(sweep=([0.2, 1.0], [0.3, 0.3]))
    r = jnp.array([0.1, 0.2, 0.7, 1.0])
    np.testing.assert_allclose(geometry.sweep_offset(rotor, r), np.tan(0.3) * np.array([0, 0, 0.5, 0.8]), rtol=1e-14)


def test_sweep_offset_of_a_growing_sweep_is_its_integral():
    rotor = make(sweep=([0.0, 1.0], [0.0, 0.5]))
    r = jnp.array([0.25, 0.5, 1.0])
    np.testing.assert_allclose(geometry.sweep_offset(rotor, r), -np.log(np.cos(0.5 * r)) / 0.5, rtol=1e-12)


def test_sweep_offset_has_the_slope_tan_sweep():
    rotor = catalogue.load("uh60")[0]
    slope = jax.vmap(jax.grad(lambda r: geometry.sweep_offset(rotor, r)))(jnp.array([0.5, 0.95, 0.99]))
    np.testing.assert_allclose(slope, [0, np.tan(np.deg2rad(20)), np.tan(np.deg2rad(20))], rtol=1e-12, atol=1e-15)


def test_derivatives_in_the_tables_match_finite_differences():
    rotor = make(
        chord=([0.2, 0.6, 1.0], [0.3, 0.2, 0.1]),
        twist=([0.0, 0.5, 1.0], [0.2, 0.0, -0.2]),
        sweep=([0.2, 0.7, 1.0], [0.0, 0.1, 0.4]),
    )
    r = jnp.array([0.33, 0.81])

    def quantities(values):
        moved = eqx.tree_at(lambda x: [x.chord.values, x.twist.values, x.sweep.values], rotor, list(values))
        offset = geometry.sweep_offset(moved, r)
        return jnp.concatenate(
            [geometry.chord(moved, r), geometry.twist(moved, r), offset, geometry.solidity(moved)[None]]
        )

    at = jnp.stack([rotor.chord.values, rotor.twist.values, rotor.sweep.values])
    forward, reverse = jax.jit(jax.jacfwd(quantities))(at), jax.jit(jax.jacrev(quantities))(at)
    values = jax.jit(quantities)
    direction = jnp.asarray(np.random.default_rng(0).normal(size=at.shape))
    numeric = (values(at + 1e-6 * direction) - values(at - 1e-6 * direction)) / 2e-6
    np.testing.assert_allclose(jnp.tensordot(forward, direction), numeric, rtol=1e-6)
    np.testing.assert_allclose(forward, reverse, atol=1e-14)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"blades": 0}, "Argument `blades` must be a whole number from 1 to 20, but is 0"),
        ({"blades": 2.0}, "Argument `blades` must"),
        ({"blades": True}, "Argument `blades` must"),
        ({"radius": 0.0}, r"Argument `radius` must be a number in \[0.02, 200\] m, but is 0"),
        ({"root_cutout": 1.2}, r"Argument `root_cutout` must be a number in \[0, 0.95\], but is 1.2"),
        ({"chord": -0.1}, r"Argument `chord` must be a number in \[0.0001, 50\] m, but is -0.1"),
        ({"chord": ([0.2, 0.6, 1.0], [0.1, 0.0, 0.1])}, "Argument `chord.value` must be .* m, but is 0 at r = 0.6"),
        ({"chord": ([0.3, 1.0], [0.1, 0.1])}, r"Argument `chord.r` must cover 0.2 to 1 \(r/R\), but is 0.3 to 1"),
        ({"chord": ([0.2, 0.9], [0.1, 0.1])}, "Argument `chord.r` must cover"),
        ({"chord": ([0.2, 1.2], [0.1, 0.1])}, "Argument `chord.r` must stay within 0 to 1"),
        ({"twist": ([0.0, 0.6, 0.6, 1.0], [0.0] * 4)}, "Argument `twist.r` must increase .* 0.6 followed by 0.6"),
        ({"twist": ([0.0, 0.5, 1.0], [0.0, 0.1])}, "Argument `twist` must hold as many values as stations"),
        (
            {"twist": ([0.0, 1.0], [0.0, float("nan")])},
            "Argument `twist.value` must be a finite number throughout, but is nan at entry 2",
        ),
        (
            {"twist": ([0.0, 1.0], [0.0, -18.0])},
            "Argument `twist.value` must be .* rad, but is -18 at r = 1: degrees go through",
        ),
        ({"twist": "linear"}, "Argument `twist` must be .* rad, but is 'linear'"),
        ({"sweep": 1.5}, "Argument `sweep` must be .* rad, but is 1.5: degrees"),
    ],
)
def test_refuses(changes, text):
    with pytest.raises(InputError, match=text):
        make(**changes)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"offset": -0.1}, "Argument `hinge.offset` must"),
        ({"flap_inertia": 0.0}, "Argument `hinge.flap_inertia` must"),
        ({"damper": ([0.1, 0.2], [0.0, 1.0])}, "Argument `hinge.damper.r` must cover 0"),
    ],
)
def test_hinge_refuses(changes, text):
    good = {"offset": 0.3, "blade_mass": 100.0, "first_moment": 300.0, "flap_inertia": 2000.0}
    assert geometry.hinge(**good).damper_rate is None
    with pytest.raises(InputError, match=text):
        geometry.hinge(**(good | changes))
