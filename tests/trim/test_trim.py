"""Trim of the UH-60: what it was asked for, its power balance, marching, derivatives, bad input, the command."""

import json

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.cli import main
from rotorjax.coupled import CoupledState, rhs
from rotorjax.errors import InputError
from rotorjax.ode.trajectory import integrate
from rotorjax.trim.problem import inputs_at, node_azimuths, outputs_at, revolution
from rotorjax.trim.run import numbers, prepare, request, run
from rotorjax.trim.solve import power, trim, trimmed_power
from tests.browser import opens

THRUST = 0.00575


@pytest.fixture(scope="module")
def cruise():
    return run(request("uh60", THRUST, "pitt-peters", 0.2, tilt_deg=4.0))


@pytest.fixture(scope="module")
def hover():
    return run(request("uh60", THRUST, "pitt-peters"))


@pytest.fixture(scope="module")
def told(cruise):
    return numbers(cruise)


def test_forward_flight_is_trimmed(cruise, told):
    assert cruise.trimmed.outcome.converged
    assert told["residual"] < 1e-9
    assert told["CT"] == pytest.approx(THRUST, rel=1e-9)
    assert abs(told["beta_1c_deg"]) < 1e-6
    assert abs(told["beta_1s_deg"]) < 1e-6
    # cyclic pitch against the dissymmetry of lift, and against the coning's and the inflow's tilt
    assert told["theta_1s_deg"] < -1
    assert told["theta_1c_deg"] > 0.5


def test_power_adds_up(told):
    parts = sum(told[f"CP_{part}"] for part in ("induced", "profile", "parasite", "damper"))
    assert parts == pytest.approx(told["CP"], rel=1e-9)
    assert told["CP_damper"] > 0


def test_hover_needs_no_cyclic_and_momentum_theorys_power(hover):
    found = numbers(hover)
    assert found["residual"] < 1e-9
    assert abs(found["theta_1c_deg"]) + abs(found["theta_1s_deg"]) < 1e-6
    # drag and tip loss apart, C_T λ with λ = √(C_T/2): swirl and coning are second order
    assert found["CP_induced"] == pytest.approx(THRUST * np.sqrt(THRUST / 2), rel=0.005)
    assert found["CP_damper"] < 1e-12


def test_a_revolution_marched_from_the_trim_ends_where_it_began(cruise):
    """The trim is an orbit of the equations of motion themselves, found without marching them."""
    z, u = cruise.trimmed.z, inputs_at(cruise.trimmed.z.controls, cruise.trimmed.flight)
    start = CoupledState(jnp.zeros(()), *jax.tree.map(lambda v: v[0], (z.rotor, z.inflow)))
    steps = 240
    march = eqx.filter_jit(lambda x, u, p: integrate(rhs, x, 0.0, 2 * np.pi / steps, steps, u, p, save_every=10))
    found = march(start, u, cruise.trimmed.p)
    assert found.x.psi[-1] == pytest.approx(2 * np.pi)
    whole, _ = revolution(z, 4)
    np.testing.assert_allclose(found.x.rotor.flap[:-1], whole.flap, atol=2e-5)
    np.testing.assert_allclose(found.x.inflow[-1], start.inflow, atol=2e-5)
    assert float(jnp.ptp(whole.flap[:, 3])) > 1e-4  # the differential coordinate does move


def test_a_thrust_beyond_stall_names_the_limit():
    """Below the bound that is refused at once, but more than the retreating blade can carry."""
    found = run(request("uh60", 0.012, "pitt-peters", 0.2, tilt_deg=4.0)).trimmed.outcome
    assert not found.converged
    limit = float(found.why.split("C_T = ")[1].split(";")[0])
    assert 0.008 < limit < 0.012


def test_outputs_are_those_of_equal_blades(cruise):
    """Every node sees all blades; blade b at node k stands at ψ_k + 2πb/B: one curve over the azimuth."""
    out = outputs_at(cruise.trimmed.z, cruise.trimmed.flight, cruise.trimmed.p)
    psi = node_azimuths(cruise.trimmed.z, 4)[:, None] + np.pi / 2 * np.arange(4)
    order = np.argsort(np.ravel(psi))
    flap = np.ravel(out.flap)[order]
    assert np.max(np.abs(np.fft.rfft(flap)[6:])) / flap.size < 1e-4  # smooth: no blade is out of track


@pytest.mark.slow
def test_derivative_of_power_at_trim(cruise):
    """Along a change of thrust, chord and twist together against trims made anew: 1e-6."""
    way = jnp.array([1.0, -0.7, 0.4])

    def of(step):
        v = 1 + step * way
        rotor = cruise.trimmed.p.rotor
        changed = eqx.tree_at(
            lambda p: (p.rotor.chord.values, p.rotor.twist.values),
            cruise.trimmed.p,
            (rotor.chord.values * v[1], rotor.twist.values * v[2]),
        )
        return eqx.tree_at(lambda f: f.thrust, cruise.trimmed.flight, THRUST * v[0]), changed

    _, slope = jax.jvp(lambda s: trimmed_power(cruise.trimmed, *of(s)), (0.0,), (1.0,))
    ends = []
    for step in (1e-4, -1e-4):
        flight, p = of(step)
        ends.append(float(power(trim(p, flight, start=cruise.trimmed.z).z, flight, p)))
    assert float(slope) == pytest.approx((ends[0] - ends[1]) / 2e-4, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"thrust": 0.05}, r"thrust_coefficient.*below 0\.0"),
        ({"thrust": -0.001}, "thrust_coefficient"),
        ({"advance": 0.9}, "advance_ratio"),
        ({"slope_deg": 5.0}, "height"),
        ({"height": 1.0, "slope_deg": 5.0}, "vpbfsm"),
        ({"height": 1.0, "climb": 0.01}, "climb"),
        ({"inflow": "pit-peters"}, "pitt-peters"),
        ({"rotor": "caradonna_tung"}, "hinge"),
        ({"tilt_deg": 90.0}, "tilt"),
        ({"tilt_deg": 3.0, "drag_area": 3.0}, "tilt_deg"),
        ({"height": 0.6, "tilt_deg": 39.0}, "height"),
    ],
)
def test_bad_input(change, words):
    wanted = request(**{"rotor": "uh60", "thrust": THRUST, **change})
    with pytest.raises(InputError, match=words):
        trim(*prepare(wanted))


def test_the_command(tmp_path, capsys, cruise, told):
    file = tmp_path / "trim.json"
    flags = ["--thrust-coefficient", str(THRUST), "--advance-ratio", "0.2", "--tilt", "4", "--json", str(file)]
    assert main(["trim", *flags]) == 0
    content = json.loads(file.read_text())
    asked = "converged residual collective_deg theta_1c_deg theta_1s_deg beta_0_deg beta_1c_deg beta_1s_deg CT CP"
    assert set(asked.split()) | {"CP_induced", "wall_time_s"} <= set(content)
    assert content["collective_deg"] == pytest.approx(told["collective_deg"], rel=1e-9)
    assert "converged" in capsys.readouterr().out


def test_the_command_says_at_once_what_cannot_be(capsys):
    assert main(["trim", "--thrust-coefficient", "0.05"]) == 2
    assert "--thrust-coefficient must be below" in capsys.readouterr().err


def test_a_curve_over_speed(tmp_path, cruise, told):
    """The power's bucket: less at advance ratio 0.2 than in hover; each point as if trimmed alone."""
    file, picture, page = tmp_path / "curve.json", tmp_path / "curve.png", tmp_path / "curve.html"
    flags = ["--thrust-coefficient", str(THRUST), "--advance-ratio", "0", "0.1", "0.2", "--tilt", "4"]
    assert main(["trim", *flags, "--json", str(file), "--plot", str(picture), "--html", str(page)]) == 0
    points = json.loads(file.read_text())["points"]
    assert [p["advance_ratio"] for p in points] == [0, 0.1, 0.2]
    assert points[2]["CP"] < points[0]["CP"]
    assert points[2]["CP"] == pytest.approx(told["CP"], rel=1e-7)
    assert picture.stat().st_size > 10_000
    told = page.read_text()
    assert told.count("data:image/png") == 1
    assert opens(page, tmp_path)
    assert "3 of 3 points converged" in told
    assert f"{points[2]['power_watt'] / 1e3:.0f} kW (C_P = {points[2]['CP']:.4e}) at advance ratio 0.2" in told


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--advance-ratio", "0.1", "0.2", "--height", "1", "2"], "Either the speed or the height"),
        (["--plot", "x.png"], "several"),
        (["--plot", "x.xyz", "--height", "1", "2"], "plot"),
        (["--height", "1", "0.2"], "height"),
    ],
)
def test_bad_curves(capsys, flags, words):
    assert main(["trim", "--thrust-coefficient", str(THRUST), *flags]) == 2
    assert words in capsys.readouterr().err
