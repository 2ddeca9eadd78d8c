"""Loads with the measured tip vortex in place of the computed one: `python benchmarks/prescribed_path.py`.

Caradonna and Tung's rotor at 8°. The solved wake's tip vortex is moved to the measured radius, height or both up to
380° of age, by the last difference beyond; everything else of the wake stays, and the bound circulation is found anew.
What then remains of the differences in lift is not the path's. For each: C_T, lift at the five stations, induced power
factor, and how far from the measured place the flow would then carry the tip vortex, at 120° to 360° of age.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.reference import published as reference
from rotorjax.validation import caradonna_tung
from rotorjax.validation.measure import tip_path
from rotorjax.wake.equilibrium import Evaluation, Unknowns, evaluate, evaluated, transported
from rotorjax.wake.model import FreeWake
from rotorjax.wake.performance import performance
from rotorjax.wake.solution import Solution, solve

ITERATIONS = 12
"""Newton's, on the bound circulation of one blade."""
AGES_DEG = (120, 180, 240, 300, 360)
CASES = {
    "nothing": (0.0, 0.0, False),
    "radius": (1.0, 0.0, False),
    "height": (0.0, 1.0, False),
    "both": (1.0, 1.0, False),
    "both, lattice too": (1.0, 1.0, True),
}
"""Arguments of `moved`."""


def moved(solution: Solution, radius: float, height: float, lattice: bool) -> Unknowns:
    """The wake with its tip vortex taken this far, 0 to 1, from the computed path to the measured one.

    lattice: the near wake's outer part goes along, by r^16, from the blade on.
    """
    own, measured, x = tip_path(solution), reference.caradonna_tung_path(), solution.unknowns
    ages = own.age[1:]
    by_r = radius * np.interp(ages, measured.age, measured.r - np.interp(measured.age, own.age, own.r))
    by_z = height * np.interp(ages, measured.age, measured.z - np.interp(measured.age, own.age, own.z))
    near = x.near.shape[2]
    by_r[:near] *= np.minimum(1, ages[:near] / ages[near - 1])
    tip = _shifted(x.far[:, :1], by_r[near:], by_z[near:])
    x = x._replace(far=jnp.concatenate([tip, x.far[:, 1:]], axis=1))
    if lattice:
        share = solution.model.edges[:, None] ** 16
        x = x._replace(near=_shifted(x.near, share * by_r[:near], share * by_z[:near]))
    return x


def _shifted(nodes: Float[Array, "*n 3"], by_r: np.ndarray | Array, by_z: np.ndarray | Array) -> Float[Array, "*n 3"]:
    """Nodes further out by by_r and higher by by_z."""
    r = jnp.hypot(nodes[..., 0], nodes[..., 1])
    return jnp.concatenate([nodes[..., :2] * (1 + by_r / r)[..., None], (nodes[..., 2] + by_z)[..., None]], axis=-1)


@eqx.filter_jit
def _mismatch(gamma: Float[Array, " R"], model: FreeWake, x: Unknowns) -> Float[Array, " R"]:
    found = transported(model, evaluate(model, x._replace(gamma_bound=gamma[None])))
    return found.gamma_bound[0] - gamma


_slope = eqx.filter_jit(jax.jacfwd(_mismatch))


def loaded(model: FreeWake, x: Unknowns) -> Evaluation:
    """A wake with these nodes and the circulation that its blades then have."""
    gamma = x.gamma_bound[0]
    for _ in range(ITERATIONS):
        gamma = gamma - jnp.linalg.solve(_slope(gamma, model, x), _mismatch(gamma, model, x))
    left = float(jnp.max(jnp.abs(_mismatch(gamma, model, x))))
    if not left < 1e-10:
        raise RuntimeError(f"no circulation goes with these nodes: {left:.1e} is left after {ITERATIONS} iterations")
    return evaluated(model, x._replace(gamma_bound=gamma[None]))


def main() -> None:
    jax.config.update("jax_enable_x64", True)
    solution, measured = solve(caradonna_tung.AT.model(False)), reference.caradonna_tung()
    model, wanted = solution.model, reference.caradonna_tung_path()
    print("moved to the measured          C_T         lift over measured, % at", *measured.r, "   κ")
    for name, arguments in CASES.items():
        found = loaded(model, moved(solution, *arguments))
        numbers = performance(model, found)
        thrust, lift = float(numbers.thrust), np.interp(measured.r, solution.r, np.asarray(found.loads.cl)[0])
        percent = " ".join(f"{100 * v:+6.1f}" for v in lift / measured.lift - 1)
        factor = reference.induced_power_factor(thrust, float(numbers.induced))
        print(f"{name:22} {thrust:10.5f} ({100 * (thrust / measured.thrust - 1):+.1f} %)  {percent}   {factor:.3f}")
        nodes = np.asarray(transported(model, found).far[0, 0])
        ages = solution.tip_vortex_age[1:]
        for part, of in (("r", np.hypot(nodes[:, 0], nodes[:, 1])), ("z", nodes[:, 2])):
            at = np.deg2rad(AGES_DEG)
            off = np.interp(at, ages, of) - np.interp(at, wanted.age, getattr(wanted, part))
            print(f"    the flow would carry {part} off the measured by", *(f"{v:+.3f}" for v in off))


if __name__ == "__main__":
    main()
