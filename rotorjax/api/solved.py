"""A rotor in its steady inflow, of either model: found by `solve`, read, drawn and written."""

import warnings
from functools import singledispatch
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.api.models import FiniteStateRotor
from rotorjax.bench.mean_flow import mean_velocity
from rotorjax.checks import known
from rotorjax.errors import InputError
from rotorjax.ground import Plane
from rotorjax.inflow.balance import Balance, balance
from rotorjax.panels.surface import told
from rotorjax.potential import model as potential
from rotorjax.wake import sensitivity
from rotorjax.wake.model import FreeWake
from rotorjax.wake.several import SeveralWakes
from rotorjax.wake.solution import Number, Solution, submerged, tip_vortices

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from rotorjax.api.several import SolvedTogether
    from rotorjax.wake.several_solution import SeveralSolution


class Performance(NamedTuple):
    """What a rotor gives and takes, SI. thrust (N), torque (N m), power, induced_power (W), mean_inflow (m/s, positive
    down, induced). figure_of_merit: C_T^1.5/(√2 C_P), of a hover.
    """

    thrust: Number
    torque: Number
    power: Number
    induced_power: Number
    mean_inflow: Number
    figure_of_merit: Number


class Solved(eqx.Module):
    """A rotor in its steady inflow. model: what was solved. found: the solution in rotor units, whose numbers are here
    too: C_T = T/(ρA(ΩR)²), C_P = P/(ρA(ΩR)³), inflow over ΩR, positive down, at azimuths psi (rad) and radii r/R.
    """

    model: FreeWake | FiniteStateRotor
    found: Solution | Balance

    CT = property(lambda self: self.found.CT, doc="Thrust coefficient.")
    CP = property(lambda self: self.found.CP, doc="Power coefficient.")
    CP_induced = property(lambda self: self.found.CP_induced, doc="Its induced part.")
    CP_profile = property(lambda self: self.found.CP_profile, doc="Its profile part.")
    mean_inflow = property(
        lambda self: self.found.mean_inflow,
        doc="Area-weighted mean inflow over ΩR, (); a free wake's over what the blades sweep.",
    )
    inflow = property(lambda self: self.found.inflow, doc="Inflow over ΩR, (K, R).")
    dct_dr = property(lambda self: self.found.dct_dr, doc="Loading dC_T/d(r/R), (K, R).")
    r = property(lambda self: self.found.r, doc="Radii over R, (R,).")
    psi = property(lambda self: self.found.psi, doc="Azimuths in rad, (K,); one alone where nothing changes with it.")
    converged = property(lambda self: self.found.converged, doc="Whether this is the steady state that was asked for.")
    why = property(lambda self: self.found.why, doc="How the search ended, in words.")

    @property
    def leak(self) -> float | None:
        """Share of what a free wake blows on surfaces that goes through between their panels' middles, else None."""
        return self.found.leak if isinstance(self.found, Solution) else None

    @property
    def clearance(self) -> float | None:
        """Height over R of a free wake's lowest node above the ground, inf without ground; None of finite states."""
        return self.found.clearance if isinstance(self.found, Solution) else None

    def performance(self) -> Performance:
        """Thrust, torque and power in SI."""
        return performance(self)

    def to_xarray(self) -> "xr.Dataset":
        """Everything as labelled arrays."""
        import xarray as xr

        around = ("azimuth", "radius")
        surfaces = self.model.surfaces
        panels = 0 if surfaces is None else len(surfaces.panels)
        data = xr.Dataset(
            {
                "inflow": (around, np.asarray(self.inflow), _about("inflow over ΩR, positive down")),
                "dct_dr": (around, np.asarray(self.dct_dr), _about("loading dC_T/d(r/R)")),
                **{name: ((), float(getattr(self, name)), _about(text)) for name, text in NUMBERS.items()},
            },
            coords={
                "radius": ("radius", np.asarray(self.r), _about("radius over R")),
                "azimuth": ("azimuth", np.asarray(self.psi), _about("azimuth, 0 aft, counter-clockwise", "rad")),
                **{name: ((), value, _about(text, unit)) for name, (value, text, unit) in _place(self.model).items()},
            },
            attrs={"rotor": self.model.rotor.name, "model": NAMES[type(self.model)], "why": self.why, "panels": panels},
        )
        return data.assign(converged=((), int(self.converged), _about("1 where the steady state was found")))

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Draw the inflow across the disk and, where it varies with azimuth, over it; written to a path if given."""
        from rotorjax.api.picture import picture
        from rotorjax.bench.plotting import save_file

        figure = picture(self.to_xarray())
        if path is not None:
            save_file(figure, path)
        return figure

    def to_vtk(self, path: str | Path) -> None:
        """Write the tip vortices of a free wake, lengths over R: .vtk for ParaView, .vtu for meshio too.

        Raises InputError for another model or ending.
        """
        from rotorjax.io.vtk import write_polydata

        if not isinstance(self.found, Solution):
            raise InputError("Argument `path` must be given to a free wake's solution, but this has no vortices")
        paths = tip_vortices(self.found, self.model.rotor.blades)
        count, ages = paths.shape[:2]
        lines = np.arange(count * ages).reshape(count, ages)
        age = np.tile(np.rad2deg(self.found.tip_vortex_age), count)
        write_polydata(path, paths.reshape(-1, 3), lines.tolist(), [], {"age_deg": age}, "tip vortices over R")

    def to_html(self, path: str | Path) -> None:
        """Write the free wake as a page in which it can be turned, offline; needs a browser with WebGL.

        Raises InputError for another model.
        """
        from rotorjax.bench.wake_scene import solved_scene
        from rotorjax.io.scene import write_scene

        if not isinstance(self.found, Solution):
            raise InputError("Argument `path` must be given to a free wake's solution, but this has no vortices")
        write_scene(path, solved_scene(self.found))


NUMBERS = {
    "CT": "thrust coefficient T/(ρA(ΩR)²)",
    "CP": "power coefficient P/(ρA(ΩR)³)",
    "CP_induced": "induced part of the power coefficient",
    "CP_profile": "profile part of the power coefficient",
    "mean_inflow": "area-weighted mean inflow over ΩR, positive down; a free wake's over what the blades sweep",
}
NAMES = {FreeWake: "free wake", FiniteStateRotor: "finite state"}


@singledispatch
def solve(model: FreeWake | FiniteStateRotor, start: Solved | None = None, **settings: Any) -> Solved:
    """Find the steady inflow of a rotor and what it does in it; of several rotors (`rj.several_wakes`) too.

    start: a solved neighbour that a free wake's search begins from. settings: of a free wake's search (`tol`,
    `progress`). Warns where much of a wake goes through surfaces between their panels' middles (`Solved.leak`) and
    where nodes lie under the ground (`Solved.clearance`). Works under jax.grad, jacfwd, vmap and jit
    (`wake.sensitivity.solve` says how a free wake does). Raises InputError where the finite-state model finds no
    loading that reproduces itself; a free wake that is not found comes back with `converged` False, under tracing it
    raises.

    >>> import jax, rotorjax as rj
    >>> uh60, hover = rj.rotor("uh60", collective_deg=18.0)
    >>> def thrust(height):
    ...     return rj.solve(rj.finite_state(uh60, hover, rj.plane(height))).CT
    >>> bool(jax.grad(thrust)(1.0) < 0)  # the ground's help fades with height
    True
    """
    raise InputError(f"Argument `model` must be of rj.free_wake or rj.finite_state, but is {type(model).__name__}")


@solve.register
def _(model: FreeWake, start: Solved | None = None, **settings: Any) -> Solved:
    if start is not None and not isinstance(start.found, Solution):
        raise InputError("Argument `start` must be the solution of a free wake, but is of the finite-state model")
    near: Solution | None = None if start is None else start.found  # type: ignore[assignment]
    found = sensitivity.solve(model, near, **settings)
    if known(found):
        _warn_of(found)
    return Solved(model, found)


@solve.register
def _(model: FiniteStateRotor, start: Solved | None = None) -> Solved:
    return Solved(model, balance(model.flow, model.rotor, model.operating, model.stations))


@solve.register(SeveralWakes)
def _(model: SeveralWakes, start: "SolvedTogether | None" = None, **settings: Any) -> Any:
    from rotorjax.api.several import SolvedTogether
    from rotorjax.wake.several_solution import solve_several

    found = solve_several(model, None if start is None else start.found, **settings)
    _warn_of(found)
    return SolvedTogether(found)


def _warn_of(found: "Solution | SeveralSolution") -> None:
    """Warn where surfaces leak and where a wake lies under the ground."""
    for words in (told(found.leak), submerged(found) if found.converged else None):
        if words is not None:
            warnings.warn(words, stacklevel=4)


def velocity(solved: Solved, points: Float[Array, "N 3"], instants: int = 12) -> Float[Array, "N 3"]:
    """Induced velocity over ΩR at hub-frame points over R (x aft, y to starboard, z up), mean over time.

    instants: of a blade's passage, over which an axisymmetric free wake is averaged; one over a slope has its own.
    """
    points = jnp.asarray(points, float)
    if isinstance(solved.found, Solution):
        return mean_velocity(solved.found, points, instants)
    assert isinstance(solved.model, FiniteStateRotor)
    return potential.velocity(solved.found.state, points, solved.model.flow)


def performance(solved: Solved) -> Performance:
    """Thrust, torque and power of a solved rotor in SI.

    >>> import rotorjax as rj
    >>> f"{rj.performance(rj.solve(rj.finite_state(*rj.rotor('uh60', 18.0)))).thrust / 1e3:.0f} kN"
    '77 kN'
    """
    rotor, operating = solved.model.rotor, solved.model.operating
    tip = operating.tip_speed(rotor.radius)
    force = operating.force(rotor.radius)
    power = force * tip
    hover = solved.CT**1.5 / (jnp.sqrt(2) * solved.CP)
    return Performance(
        thrust=force * solved.CT,
        torque=power * solved.CP / operating.omega,
        power=power * solved.CP,
        induced_power=power * solved.CP_induced,
        mean_inflow=tip * solved.mean_inflow,
        figure_of_merit=hover,
    )


def _about(text: str, unit: str = "1") -> dict[str, str]:
    return {"units": unit, "long_name": text}


def _place(model: FreeWake | FiniteStateRotor) -> dict[str, tuple[float, str, str]]:
    """Where a rotor stands, and how."""
    ground: Plane | None = model.ground
    height, slope = (np.nan, 0.0) if ground is None else (float(ground.height), float(ground.slope))
    return {
        "height": (height, "height of the hub over the ground, over R; NaN: none", "1"),
        "slope_deg": (float(np.rad2deg(slope)), "slope of the ground", "degree"),
        "collective_deg": (float(np.rad2deg(model.operating.collective)), "collective pitch", "degree"),
    }
