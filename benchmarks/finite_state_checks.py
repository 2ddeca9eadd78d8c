"""Measure the dynamic finite-state model against exact limits: `python benchmarks/finite_state_checks.py [--out DIR]`.

Prints one table a check and, with --out, writes figures: costates both ways in time, the causal form's error over
its delay, heave response over reduced frequency, and inflow as an edge passes under the rotor.
"""

import argparse
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.bench import plotting
from rotorjax.deck.blades import linear_blades
from rotorjax.deck.over_ground import controls, output, over_ground, trim
from rotorjax.deck.state_space import heave_response, state_space
from rotorjax.ground import plane
from rotorjax.potential.dynamics import costates, hover_inputs
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.ground_table import ground_table
from rotorjax.potential.matrices import apparent_mass, damping
from rotorjax.potential.model import (
    FiniteStateModel,
    finite_state_model,
    ground_normal_velocity_rms,
    mean_inflow,
    steady_state,
)
from rotorjax.potential.moving_ground import ground_states, prescribed, residual, still
from rotorjax.potential.rotors import mean_inflows, rotors, steady
from rotorjax.potential.wake_transport import wake_transport
from rotorjax.potential.window import delayed_costates, forgetting_rate
from rotorjax.region import half_plane

CT = 0.006
V0 = np.sqrt(CT / 2)


def loads(model: FiniteStateModel) -> jax.Array:
    tau = jnp.zeros(len(model.modes))
    return tau.at[: min(3, tau.size)].set(jnp.array([np.sqrt(3) / 4 * CT, 5e-4, 2e-4])[: min(3, tau.size)])


def causal_form(out: Path | None) -> None:
    """Error of delayed costates over the delay, and the costates of 50 turns marched both ways."""
    model, psi = finite_state_model(), jnp.linspace(0, 100 * np.pi, 2001)
    tau = loads(model) * (1 + 0.3 * jnp.sin(0.1 * psi))[:, None]
    inputs, a = hover_inputs(tau), jnp.broadcast_to(steady_state(model, loads(model)).a, tau.shape)
    backward = costates(psi, a, inputs, model, skewed=False)
    d, mass = damping(model.modes, model.modes), apparent_mass(model.modes, model.modes)
    v = np.array([V0, 2 * V0, 2 * V0])
    forward = [np.array(backward[0])]
    step = float(psi[1] - psi[0])
    for row in np.array(tau[:-1]):
        forward.append(forward[-1] + step * np.linalg.solve(mass, d @ (v * forward[-1] - row)))
    size_back, size_forward = (np.linalg.norm(np.array(w), axis=1) for w in (backward, np.array(forward)))
    print("costates over 50 turns: largest backward / forward march")
    print(f"  {size_back.max():.4f}   {size_forward.max():.3g}")
    rate = forgetting_rate(a[0], jax.tree.map(lambda w: w[0], inputs), model)
    steps = np.array([8, 16, 32, 64, 96, 128, 192])
    errors = []
    for count in steps:
        found = delayed_costates(psi, a, inputs, model, int(count))[:1500]
        errors.append(float(jnp.sqrt(jnp.mean((found - backward[:1500]) ** 2) / jnp.mean(backward[:1500] ** 2))))
    delays = steps * step
    print(f"causal costates: delay (turns), relative rms error, e^(-rate delay), rate {rate:.4f} per rad")
    for delay, error in zip(delays, errors, strict=True):
        print(f"  {delay / (2 * np.pi):6.2f}  {error:.2e}  {np.exp(-rate * delay):.2e}")
    if out:
        with plotting.style():
            figure = plotting.new_figure(9, 3.4)
            left, right = figure.subplots(1, 2)
            left.semilogy(psi / (2 * np.pi), np.minimum(size_forward, 1e30), color=plotting.VPBFSM, label="forward")
            left.semilogy(psi / (2 * np.pi), size_back, color=plotting.FREE_WAKE, label="backward")
            left.set(xlabel="turns", ylabel="size of the costates", ylim=(1e-3, 1e12))
            right.semilogy(delays / (2 * np.pi), errors, "o-", color=plotting.FREE_WAKE, label="causal form")
            right.semilogy(delays / (2 * np.pi), np.exp(-rate * delays) * errors[3] / np.exp(-rate * delays[3]), "k:")
            right.set(xlabel="delay, turns", ylabel="relative rms error")
            left.legend()
            right.legend()
        plotting.save(figure, out / "costates", ("png",))


def moving_plane() -> None:
    """Ground at rest against the steady model, and what is left on a moving plane."""
    model = finite_state_model(plane(1.0, 10.0), harmonics=1, ground_harmonics=1, ground_radial_terms=7)
    tau, transport = loads(model), wake_transport(2.2)
    state, inputs = steady_state(model, tau), hover_inputs(tau)
    for variant in ("static", "quasi-steady", "dynamic"):
        c = ground_states(state.a, still(model.ground), inputs, model, variant, transport)
        print(f"ground at rest, {variant}: {float(jnp.abs(c - state.c).max() / jnp.abs(state.c).max()):.1e} of steady")
    psi = jnp.linspace(0, 120, 481)
    motion = prescribed(psi, 1 + 0.2 * jnp.sin(0.3 * psi), 0.15 * jnp.sin(0.2 * psi))
    swing = 1 + 0.2 * jnp.sin(0.25 * psi[:, None] - 5 * transport.depths)

    @eqx.filter_jit
    def left(now: object, scale: jax.Array) -> jax.Array:
        b = scale[:, None] * state.a
        settings = (now, inputs, model, "dynamic", transport, b[1:])
        return residual(ground_states(b[0], *settings), b[0], *settings)

    found = jax.lax.map(lambda row: left(*row), (motion, swing))
    print(f"heaving and pitching plane: residual {float(found.min()):.4f} to {float(found.max()):.4f} (rms)")


def heave(out: Path | None) -> None:
    """Response of the mean inflow to heave over the reduced frequency."""
    rotor, transport = finite_state_model(radial_terms=3), wake_transport(2.2, 10)
    now, reduced = controls(still(plane(1.0)), rotor, jnp.deg2rad(8.0)), np.geomspace(0.003, 3.0, 25)
    found = {}
    for variant in ("static", "quasi-steady", "dynamic"):
        table = ground_table(rotor, (0.6, 2.0), transport=transport if variant == "dynamic" else None)
        model = over_ground(rotor, table, linear_blades(0.08), variant, transport)
        state = trim(model, now)
        mean = float(output(jnp.zeros(()), state, now, model).uniform)
        found[variant] = heave_response(state_space(model, state, now), reduced * mean)[:, 0]
    print("heave at h = 1: reduced frequency, amplitude and phase (deg) over the static ones, quasi-steady and dynamic")
    for i in range(0, 25, 4):
        ratios = [found[variant][i] / found["static"][0] for variant in ("quasi-steady", "dynamic")]
        print(f"  {reduced[i]:6.3f}" + "".join(f"   {abs(r):.4f} {np.rad2deg(np.angle(r)):7.2f}" for r in ratios))
    if out:
        with plotting.style():
            figure = plotting.new_figure(9, 3.4)
            left, right = figure.subplots(1, 2)
            for (variant, values), colour in zip(found.items(), ("#888888", plotting.VPBFSM, "#0072B2"), strict=True):
                left.semilogx(reduced, np.abs(values), color=colour, label=variant)
                right.semilogx(reduced, np.rad2deg(np.angle(values)), color=colour)
            left.set(xlabel="reduced frequency", ylabel=r"$|\delta\lambda_0/\delta h|$", ylim=(0, None))
            right.set(xlabel="reduced frequency", ylabel="phase, deg")
            left.legend()
        plotting.save(figure, out / "heave", ("png",))


def edge(out: Path | None) -> None:
    """Inflow and residual as an edge passes under the rotor at h = 1."""
    settings = {"ground_harmonics": 6, "ground_radial_terms": 5, "ground_parity": "odd"}
    model = finite_state_model(
        plane(1.0), harmonics=1, quadrature=DiskQuadrature(24, 32), region=half_plane(0.0), **settings
    )
    edges, tau = jnp.linspace(-1.4, 1.4, 57), loads(model)

    @eqx.filter_jit
    def one(place: jax.Array) -> jax.Array:
        chosen = eqx.tree_at(lambda m: m.region.edge, model, place)
        state = steady_state(chosen, tau)
        return jnp.stack([mean_inflow(state, chosen), ground_normal_velocity_rms(state, chosen)])

    mean, left = jax.lax.map(one, edges).T
    whole = finite_state_model(plane(1.0), harmonics=1, quadrature=DiskQuadrature(24, 32), **settings)
    free = finite_state_model(harmonics=1, quadrature=DiskQuadrature(24, 32))
    limits = [float(mean_inflow(steady_state(m, tau), m)) for m in (free, whole)]
    print(
        f"edge: monotone {bool(np.all(np.diff(mean) < 1e-15))}, limits differ by "
        f"{abs(float(mean[0]) - limits[0]):.1e} and {abs(float(mean[-1]) - limits[1]):.1e}"
    )
    for i in range(8, 57, 8):
        print(f"  edge {float(edges[i]):5.2f}  mean inflow {float(mean[i]):.5f}  residual {float(left[i]):.4f}")
    if out:
        with plotting.style():
            figure = plotting.new_figure(9, 3.4)
            first, second = figure.subplots(1, 2)
            first.plot(edges, mean, color=plotting.FREE_WAKE)
            first.set(xlabel="edge aft of the hub, x/R", ylabel=r"$\lambda_0/\Omega R$")
            second.plot(edges, left, color=plotting.FREE_WAKE)
            second.axhline(0.03, color="k", ls=":", lw=0.8)
            second.set(xlabel="edge aft of the hub, x/R", ylabel="left on the ground, rms", ylim=(0, 0.12))
        plotting.save(figure, out / "edge", ("png",))


def several() -> None:
    """Coaxial and side-by-side pairs against momentum theory."""
    model = finite_state_model(radial_terms=1, quadrature=DiskQuadrature(16, 16))
    tau = jnp.broadcast_to(loads(model), (2, 1))
    print("coaxial: distance, mean inflow of upper and lower over v0 (limits 1.4142, 1.4142 and 1, 2.4142)")
    for gap in (1e-4, 0.1, 0.5, 1.0, 3.0, 40.0):
        system = rotors(model, [(0, 0, 0), (0, 0, -gap)])
        print(f"  {gap:7.4f}", np.array(mean_inflows(steady(system, tau), system) / V0).round(4))
    print("side by side, one 0.5 R lower: distance, mean inflow over v0 (in one plane they do not feel each other)")
    for gap in (2.05, 3.0, 6.0, 12.0):
        system = rotors(model, [(0, 0, 0), (0, gap, -0.5)])
        print(f"  {gap:5.2f}", np.array(mean_inflows(steady(system, tau), system) / V0).round(6))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="folder for figures")
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
    causal_form(options.out)
    moving_plane()
    heave(options.out)
    edge(options.out)
    several()


if __name__ == "__main__":
    main()
