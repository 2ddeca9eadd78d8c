"""The gradient ladder of the finite-state model's public functions, at ordinary points and at the nasty ones.

Every rung is a function of one flat vector. jit and vmap must give the eager value; forward must agree with reverse
mode everywhere, also where the function has no derivative (the disk edge: finite, and the same both ways); both must
agree with central differences wherever it has one. Run with -s to see what is covered.
"""

import inspect
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from derivatives import both_ways

from rotorjax.calibration import taught
from rotorjax.ground import Plane, plane
from rotorjax.potential import (
    contraction,
    dynamics,
    ellipsoidal,
    ground_source,
    legendre,
    loading,
    matrices,
    model,
    rigid_cylinder,
)
from rotorjax.potential import (
    field as flow,
)
from rotorjax.potential.contraction import Contraction
from rotorjax.potential.ground_source import Correction, DiskQuadrature
from rotorjax.potential.model import FiniteState, finite_state_model
from rotorjax.potential.modes import ground_modes, rotor_modes
from rotorjax.reference import published

ROTOR, SOURCES = rotor_modes(1, 2), ground_modes(1, 2)
PAIRS = ((0, 1), (0, 2), (1, 2), (1, 3))
QUADRATURE = DiskQuadrature(8, 8)
LEVEL = plane(1.0)
OVER = finite_state_model(LEVEL, 1, 2, 1, 2, printed=True, strengths="closed", quadrature=QUADRATURE)
FREE = finite_state_model(None, 1, 2, 1, 2, printed=True, quadrature=QUADRATURE)
DEFAULT = finite_state_model(LEVEL, 1, 2, 1, 2, quadrature=QUADRATURE)
ODD = DEFAULT.sources
PATCH = DiskQuadrature(8, 8)
R, WEIGHTS, PSI = jnp.array([0.3, 0.6, 0.9]), jnp.array([0.2, 0.3, 0.2]), 2 * jnp.pi / 4 * jnp.arange(4)
LOADED = [2.6e-3, 5e-4, 1e-4, -1e-4, 2e-4, 1e-4]  # two axisymmetric, then cosine and sine for each n
M, G = len(ROTOR), len(SOURCES)
STATES = [0.05, 0.01, 0.004, -0.002, 0.003, 0.001, 0.02, 0.01, 0.005, -0.004, 0.003, 0.002]

# name: coordinates, whether the function has a derivative along each of them there
ABOVE = {
    "above": ([0.4, 0.3, 0.25], True),
    "axis above": ([0.0, 0.0, 0.5], True),
    "plane of the disk, outside": ([1.7, 0.2, 0.0], [True, True, False]),
    "far": ([0.5, 0.2, 30.0], True),
    "disk edge": ([1.0, 0.0, 0.0], False),
    "axis on the disk": ([0.0, 0.0, 0.0], [True, True, False]),
}
EVERYWHERE = ABOVE | {"below": ([0.4, -0.3, -0.35], True), "axis below": ([0.0, 0.0, -0.5], True)}
STATIONS = {
    "ordinary": ([0.4, 0.3], True),
    "axis": ([0.0, 0.0], True),
    "disk edge": ([1.0, 0.0], False),
    "outside": ([1.2, 0.1], True),
}
GROUND = {
    "level": ([1.0, 0.0], True),
    "slope": ([1.2, 0.4], True),
    "far ground": ([40.0, 0.1], True),
}


@dataclass(frozen=True)
class Rung:
    """function(v) at points: name → (v, where it has a derivative). covers: names of public functions."""

    covers: tuple[str, ...]
    function: Callable
    points: dict = field(default_factory=dict)


def ground_of(v) -> Plane:
    return Plane(v[0], v[1])


def over(v):
    """The model over a plane (height, slope) with b and p; the first four of v."""
    where = lambda m: (m.ground, m.correction)  # noqa: E731
    return eqx.tree_at(where, OVER, (ground_of(v), Correction(v[2], v[3])))


def contracting(v):
    """The default model over a plane (height, slope) with the wake's radius, length and clearance; the first five."""
    return eqx.tree_at(lambda m: (m.ground, m.wake), DEFAULT, (ground_of(v), Contraction(v[2], v[3], v[4])))


def field_of(v):
    """Flows of a contracting wake (radius, length) at a point."""
    wake = Contraction(v[0], v[1], jnp.asarray(0.9)).over(jnp.asarray(2.0)).in_stream(jnp.asarray(0.6))
    above = jnp.concatenate([v[2:4], jnp.abs(v[4:])])[None]
    return jnp.concatenate(
        [
            jnp.ravel(contraction.near_flow(flow.pressure_functions, ROTOR, above, wake)),
            jnp.ravel(contraction.far_flow(flow.axial_functions, ROTOR, v[None, 2:], wake)),
            jnp.ravel(contraction.wake_flow(flow.axial_functions, ROTOR, v[None, 2:], wake)),
            jnp.ravel(contraction.disk_flow(ROTOR, v[2:3], v[3:4], wake)),
            contraction.disk_means(ROTOR, wake),
        ]
    )


def inflow_of(v):
    """Inflow of loads under a contracting wake, from the loads and from unit states."""
    made, tau = contracting(v), v[5:]
    unit = model.unit_states(made)
    state = model.steady_state(made, tau, 0.01, unit)
    grounded = model.with_ground(tau * model.answer_means(made), made)
    return jnp.concatenate(
        [
            jnp.ravel(model.inflow(state, R, PSI[:2], made)),
            model.unit_inflow(made, unit, R, 0.3 * R).T @ grounded.a,
            grounded.c,
        ]
    )


def state_of(v) -> FiniteState:
    return FiniteState(v[:M], v[M : M + G])


def at(v):
    return v[None, :]


NEAR = {
    "level, loaded": ([1.0, 0.0, 0.4, 2.0, *LOADED], True),
    "slope, p below 1": ([1.1, 0.3, 0.1, 0.8, *LOADED], True),
    "far ground": ([30.0, 0.0, 0.45, 2.0, *LOADED], True),
    "only the mean loaded": ([0.8, 0.1, 0.2, 1.3, 2.6e-3, 0, 0, 0, 0, 0], True),
}
CONTRACTING = {
    "level, loaded": ([1.0, 0.0, 0.7, 0.2, 0.9, *LOADED], True),
    "slope": ([1.1, 0.3, 0.8, 0.15, 0.5, *LOADED], True),
    "far ground": ([30.0, 0.0, 0.7, 0.2, 0.9, *LOADED], True),
    "no thrust": ([1.0, 0.1, 0.7, 0.2, 0.9, 0.0, *LOADED[1:]], False),
    "thrust downward": ([1.0, 0.1, 0.7, 0.2, 0.9, -2.6e-3, *LOADED[1:]], True),
}
HELD = {
    "states": ([*STATES], True),
    "rest (τ = 0)": ([0.0] * len(STATES), True),
}
ROTOR_INPUTS = {
    "hover": ([*LOADED, 0.0, 0.0, *STATES[:M]], True),
    "climb and wind": ([*LOADED, 0.05, 0.02, *STATES[:M]], True),
    "τ = 0": ([0.0] * M + [0.05, 0.01] + STATES[:M], True),
    "rest": ([0.0] * (2 * M + 2), False),
}


def inputs_of(v):
    return dynamics.InflowInputs(v[:M], v[M], v[M + 1])


def window(v):
    psi = jnp.array([0.0, 1.0, 2.5])
    tau = jnp.stack([v[:M], 1.1 * v[:M], 0.9 * v[:M]])
    a = jnp.stack([v[M + 2 :], v[M + 2 :], 1.05 * v[M + 2 :]])
    return psi, a, dynamics.InflowInputs(tau, jnp.ones(3) * v[M], jnp.ones(3) * v[M + 1])


def axial(v):
    psi = jnp.array([0.0, 20.0, 40.0])
    a = jnp.stack([v[3:], 1.2 * v[3:], 0.8 * v[3:]])
    return dynamics.axial_velocity(jnp.asarray(30.0), v[:3], psi, a, 0.5 * a, jnp.asarray(0.06), FREE)


def with_states(points, count=M):
    return {
        k: ([*p, *STATES[:count]], d if isinstance(d, bool) else [*d, *[True] * count]) for k, (p, d) in points.items()
    }


RUNGS = [
    Rung(("ellipsoidal.nu_eta", "ellipsoidal.ellipsoidal"), lambda v: jnp.stack(ellipsoidal.ellipsoidal(v)), ABOVE),
    Rung(
        ("ellipsoidal.azimuth",),
        lambda v: ellipsoidal.azimuth(v[0], v[1]),
        {"ordinary": ([0.4, 0.3], True), "axis": ([0.0, 0.0], False)},
    ),
    Rung(
        ("ellipsoidal.from_ellipsoidal",),
        lambda v: jnp.stack(ellipsoidal.from_ellipsoidal(v[0], v[1], v[2])),
        {"ordinary": ([0.4, 0.3, 1.0], True), "on the disk": ([0.4, 0.0, 1.0], True)},
    ),
    Rung(
        ("legendre.legendre_p",),
        lambda v: legendre.legendre_p(PAIRS, v),
        {"ordinary": ([0.4], True), "disk edge": ([0.0], True)},
    ),
    Rung(
        ("legendre.reduced_legendre_p",),
        lambda v: legendre.reduced_legendre_p(PAIRS, v),
        {"ordinary": ([0.4], True), "disk edge": ([0.0], True), "axis": ([1.0], True)},
    ),
    Rung(
        ("legendre.legendre_q",),
        lambda v: legendre.legendre_q(PAIRS, v),
        {"ordinary": ([0.4], True), "on the disk": ([0.0], True), "far": ([40.0], True)},
    ),
    Rung(
        ("legendre.powers", "legendre.combined"),
        lambda v: legendre.combined(np.array([[1.0, 0.0], [2.0, -3.0]]), legendre.powers(v, [1, 3])),
        {"ordinary": ([0.4], True), "zero": ([0.0], True)},
    ),
    Rung(("field.pressure_functions",), lambda v: flow.pressure_functions(ROTOR, v), ABOVE),
    Rung(("field.disk_functions",), lambda v: flow.disk_functions(ROTOR, v[0], v[1]), STATIONS),
    Rung(("field.velocity_potentials",), lambda v: flow.velocity_potentials(SOURCES, v), ABOVE),
    Rung(("field.velocity_functions",), lambda v: flow.velocity_functions(ROTOR, at(v)), ABOVE),
    Rung(("field.axial_functions",), lambda v: flow.axial_functions(ROTOR, at(v)), EVERYWHERE),
    Rung(("field.column_functions",), lambda v: flow.column_functions(ROTOR, at(v)), EVERYWHERE),
    Rung(("field.field_functions",), lambda v: flow.field_functions(ROTOR, at(v)), EVERYWHERE),
    Rung(
        ("loading.shaping", "loading.azimuthal", "loading.distribution"),
        lambda v: loading.distribution(v[2:], v[:1], v[1:2], ROTOR),
        {
            "ordinary": ([0.4, 0.3, *LOADED], True),
            "τ = 0": ([0.7, 0.3, *[0.0] * M], True),
            "axis": ([0.0, 0.3, *LOADED], True),
            "near the disk edge": ([1 - 1e-4, 0.3, *LOADED], [False, *[True] * (M + 1)]),
            "disk edge": ([1.0, 0.3, *LOADED], [False, *[True] * (M + 1)]),
        },
    ),
    Rung(
        ("loading.from_blades", "loading.from_axisymmetric", "loading.from_distribution", "loading.thrust_coefficient"),
        lambda v: jnp.concatenate(
            [
                loading.from_blades(v[None, :], R, WEIGHTS, PSI[:1], ROTOR),
                loading.from_axisymmetric(v, R, WEIGHTS, ROTOR),
                loading.from_distribution(PSI[:, None] * v, R, WEIGHTS, PSI, ROTOR),
                loading.thrust_coefficient(loading.from_axisymmetric(v, R, WEIGHTS, ROTOR), ROTOR)[None],
            ]
        ),
        {"ordinary": ([0.3, 0.5, 0.2], True), "no load": ([0.0, 0.0, 0.0], True)},
    ),
    Rung(
        ("ground_source.Correction.factor",),
        lambda v: Correction(v[0], v[1]).factor(v[2]),
        {
            "ordinary": ([0.4, 1.5, 0.8], True),
            "far": ([0.4, 2.0, 30.0], True),
            "on the ground": ([0.4, 2.0, 0.0], False),
            "on the ground, p below 1": ([0.4, 0.5, 0.0], False),
        },
    ),
    Rung(
        ("ground_source.depth",), lambda v: ground_source.depth(ground_of(v), v[2]), {"slope": ([1.0, 0.3, 0.5], True)}
    ),
    Rung(
        ("ground_source.rotor_on_ground",),
        lambda v: ground_source.rotor_on_ground(ROTOR, ground_of(v), v[2:3], v[3:4]),
        {
            "ordinary": ([1.0, 0.3, 0.4, 0.2], True),
            "axis": ([1.0, 0.3, 0.0, 0.0], True),
            "far ground": ([40.0, 0.0, 0.4, 0.2], True),
            "under the edge": ([1.0, 0.0, 1.0, 0.0], False),
        },
    ),
    Rung(
        ("ground_source.ground_on_rotor",),
        lambda v: ground_source.ground_on_rotor(SOURCES, ground_of(v), Correction(v[2], v[3]), v[None, 4:]),
        {
            "ordinary": ([1.0, 0.3, 0.4, 1.5, 0.4, 0.2, 0.0], True),
            "disk edge": ([1.0, 0.0, 0.4, 2.0, 1.0, 0.0, 0.0], True),
            "axis": ([0.8, 0.2, 0.1, 0.7, 0.0, 0.0, 0.0], True),
            "far": ([40.0, 0.0, 0.4, 2.0, 0.4, 0.2, 0.0], True),
        },
    ),
    Rung(
        ("ground_source.self_flow",),
        lambda v: ground_source.self_flow(SOURCES, v[0], v[1]),
        {k: v for k, v in STATIONS.items() if k != "disk edge"} | {"disk edge": ([1.0, 0.0], False)},
    ),
    Rung(
        ("ground_source.correlation", "model.ground_matrix"),
        lambda v: (
            ground_source.correlation(ROTOR, SOURCES, ground_of(v), QUADRATURE)
            + model.ground_matrix(OVER, ground_of(v))
        ),
        GROUND,
    ),
    Rung(
        ("ground_source.sheet_flow",),
        lambda v: ground_source.sheet_flow(ODD, ground_of(v), v[None, 2:], QUADRATURE),
        {
            "ordinary": ([1.0, 0.3, 0.4, 0.2, 0.0], True),
            "level": ([1.0, 0.0, 0.4, 0.2, 0.0], True),
            "far": ([40.0, 0.1, 0.4, 0.2, 0.0], True),
        },
    ),
    Rung(
        (
            "contraction.near_flow",
            "contraction.far_flow",
            "contraction.wake_flow",
            "contraction.disk_flow",
            "contraction.disk_means",
        ),
        field_of,
        {
            "above": ([0.7, 0.2, 0.4, 0.3, 0.25], True),
            "below": ([0.7, 0.2, 0.4, 0.3, -0.15], True),
            "axis below": ([0.8, 0.1, 0.0, 0.0, -0.5], True),
            "hardly contracted": ([1 - 1e-6, 0.2, 0.4, 0.3, -0.2], True),
        },
    ),
    Rung(
        (
            "model.wake_over",
            "model.source_radius",
            "model.closing",
            "model.rotor_into_ground",
            "model.mean_upflow",
            "model.rotor_means",
            "model.unit_states",
            "model.rotor_flow",
            "model.answer_means",
            "model.unit_inflow",
            "model.with_ground",
        ),
        inflow_of,
        CONTRACTING,
    ),
    Rung(
        ("model.rotor_velocity",),
        lambda v: model.rotor_velocity(contracting(v), ground_of(v), v[None, 5:]),
        {
            "below": ([1.1, 0.3, 0.8, 0.15, 0.5, 0.4, 0.3, -0.2], True),
            "above": ([1.1, 0.3, 0.8, 0.15, 0.5, 0.4, 0.3, 0.2], True),
        },
    ),
    Rung(
        ("model.answer_matrix", "model.answer_upflow", "model.level_velocity", "ground_source.level_flow"),
        lambda v: jnp.concatenate(
            [
                model.answer_upflow(contracting(v), model.answer_matrix(contracting(v)), v[None, 5:]).T,
                model.level_velocity(contracting(v), ground_of(v), v[None, 5:])[:, :, 0],
            ],
            axis=None,
        ),
        {"above level ground": ([1.1, 0.0, 0.8, 0.15, 0.5, 0.4, 0.3, 0.2], True)},
    ),
    Rung(
        ("dynamics.rotor_rate",),
        lambda v: dynamics.rotor_rate(v[M + 3 :], inputs_of(v), DEFAULT, v[M + 2]),
        {
            "hover": ([*LOADED, 0.0, 0.0, 0.01, *STATES[:M]], True),
            "climb and wind": ([*LOADED, 0.05, 0.02, 0.01, *STATES[:M]], True),
        },
    ),
    Rung(
        ("matrices.influence",),
        lambda v: matrices.influence(ROTOR, ROTOR, v[0]),
        {"skewed": ([0.3], True), "straight wake": ([0.0], True)},
    ),
    Rung(
        ("model.mass_flow_parameters", "model.steady_state", "model.mean_inflow"),
        lambda v: model.mean_inflow(model.steady_state(over(v), v[4:]), over(v)),
        NEAR,
    ),
    Rung(
        ("model.inflow", "model.disk_inflow", "model.ground_upflow"),
        lambda v: model.inflow(model.steady_state(over(v), v[4:]), jnp.array([0.0, 0.5, 1.0]), PSI[:2], over(v)),
        NEAR,
    ),
    Rung(
        ("model.ground_normal_velocity_rms", "model.relative_residual"),
        lambda v: model.ground_normal_velocity_rms(model.steady_state(over(v), v[4:]), over(v)),
        {k: NEAR[k] for k in ("level, loaded", "slope, p below 1")},
    ),
    Rung(
        ("model.velocity",),
        lambda v: model.velocity(state_of(v), jnp.array([[0.4, 0.3, 0.2], [0.0, 0.0, -0.4], [1.0, 0.0, 0.0]]), OVER),
        HELD,
    ),
    Rung(
        (
            "rigid_cylinder.inflow",
            "rigid_cylinder.disk_inflow",
            "rigid_cylinder.patch_upflow",
            "rigid_cylinder.reflected_sink_downflow",
        ),
        lambda v: rigid_cylinder.inflow(
            model.steady_state(over(v), v[4:]), jnp.array([0.0, 0.5, 1.0]), PSI[:2], over(v), PATCH
        ),
        NEAR,
    ),
    Rung(
        ("rigid_cylinder.mean_inflow",),
        lambda v: rigid_cylinder.mean_inflow(state_of(v), OVER, PATCH),
        HELD,
    ),
    Rung(
        ("dynamics.rhs", "dynamics.mass_flow", "dynamics.mean_induced_inflow"),
        lambda v: dynamics.rhs(jnp.asarray(0.0), model.with_ground(v[M + 2 :], OVER), inputs_of(v), OVER).a,
        ROTOR_INPUTS,
    ),
    Rung(
        ("dynamics.flow_matrices",),
        lambda v: dynamics.flow_matrices(v[M + 2 :], inputs_of(v), OVER)[1],
        {k: ROTOR_INPUTS[k] for k in ("hover", "climb and wind", "rest")},
    ),
    Rung(
        ("dynamics.costates",),
        lambda v: dynamics.costates(*window(v), FREE),
        {k: ROTOR_INPUTS[k] for k in ("hover", "climb and wind", "τ = 0")},
    ),
    Rung(
        ("dynamics.axial_velocity", "dynamics.passage", "dynamics.rows_at"),
        axial,
        with_states({k: EVERYWHERE[k] for k in ("above", "axis above", "far", "below", "axis below", "disk edge")}),
    ),
    Rung(
        ("taught.taught_model", "taught.taught_state"),
        lambda v: taught.taught_state(taught.taught_model(contracting(v), v[5:11]), v[11:], v[5:11]).c,
        {
            "ordinary": ([1.0, 0.3, 0.7, 0.2, 0.9, 0.8, 0.3, 0.5, 1.1, 0.9, 0.4, *LOADED], True),
            "far ground": ([30.0, 0.0, 0.7, 0.2, 0.9, 0.8, 0.3, 0.5, 1.1, 0.9, 0.4, *LOADED], True),
        },
    ),
    Rung(
        ("published.hayden_factor",),
        lambda v: published.hayden_factor(v),
        {"ordinary": ([1.0], True), "high": ([30.0], True)},
    ),
]
MODULES = {
    "ellipsoidal": ellipsoidal, "legendre": legendre, "field": flow, "loading": loading,
    "ground_source": ground_source, "matrices": matrices, "model": model, "rigid_cylinder": rigid_cylinder,
    "dynamics": dynamics, "taught": taught, "contraction": contraction,
}  # fmt: skip
STATIC = {  # numbers and tables that no one differentiates
    "legendre.double_factorial", "legendre.h_constant", "legendre.k_constant", "legendre.rho", "field.sigma",
    "field.zeta", "ground_source.correction", "ground_source.source_solver", "matrices.gamma", "matrices.damping",
    "matrices.apparent_mass", "model.finite_state_model", "model.footprint", "dynamics.hover_inputs",
    "dynamics.rate_table", "ground_source.printed_strengths", "model.choices", "model.strength_factors",
    "contraction.contraction",
}  # fmt: skip


# Derivatives do not depend on the compiler's polish, which takes most of the time; the value is compared with that of
# the usual compilation.
QUICK = {"xla_backend_optimization_level": 0, "xla_llvm_disable_expensive_passes": True}


@pytest.mark.slow  # all together
@pytest.mark.parametrize("rung", RUNGS, ids=lambda rung: rung.covers[0])
def test_ladder(rung):
    names = list(rung.points)
    points = jnp.array([rung.points[n][0] for n in names], float)
    moves = jax.vmap(jnp.diag)(step_of(points))
    flat = lambda v: jnp.ravel(rung.function(v))  # noqa: E731

    @partial(jax.jit, compiler_options=QUICK)
    def climb(moved):
        return jax.vmap(flat)(moved), *both_ways(flat)(moved[0])

    moved = jnp.concatenate([points[:, None], points[:, None] + moves, points[:, None] - moves], axis=1)
    width = points.shape[1]
    every, forward, reverse = (np.stack(v) for v in zip(*map(climb, moved), strict=True))  # point by point
    np.testing.assert_allclose(every[0, 0], flat(points[0]), rtol=1e-11, atol=1e-14)  # one point, not under jit
    for i, name in enumerate(names):
        values, ahead, behind = every[i, 0], every[i, 1 : width + 1], every[i, width + 1 :]
        assert np.all(np.isfinite([*forward[i], *reverse[i]])), name
        assert np.all(np.isfinite(values)), name
        scale = np.max(np.abs(forward[i])) + 1e-12
        np.testing.assert_allclose(forward[i] / scale, reverse[i] / scale, atol=1e-11, err_msg=name)
        steps = np.diag(moves[i])
        error = np.abs(forward[i] - ((ahead - behind) / (2 * steps[:, None])).T)
        allowed = 2e-6 * scale + 1e-15 * np.max(np.abs(values)) / steps
        smooth = np.broadcast_to(rung.points[name][1], width)
        assert np.all((error <= allowed)[:, smooth]), f"{name}: {error[:, smooth].max()} against {allowed}"


def step_of(v):
    """Steps of central differences: relative for loads and states, which are small, absolute for places."""
    return jnp.where((v == 0) | (jnp.abs(v) > 0.05), 1e-5 * jnp.maximum(1.0, jnp.abs(v)), 1e-4 * jnp.abs(v))


def test_nothing_public_is_left_out():
    covered = {name for rung in RUNGS for name in rung.covers}
    public = {
        f"{short}.{name}"
        for short, module in MODULES.items()
        for name, thing in vars(module).items()
        if callable(thing) and not name.startswith("_") and not inspect.isclass(thing)
        and getattr(thing, "__module__", "") == module.__name__
    }  # fmt: skip
    print("\ngradient ladder:")
    for rung in RUNGS:
        print(f"  {', '.join(rung.covers)}: {', '.join(rung.points)}")
    assert public - covered - STATIC == set()
