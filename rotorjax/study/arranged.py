"""Both models of an arrangement: the free wake of all rotors, and the finite states of the loads that it has, as in
every other study; inflow maps side by side, the flow between, and the wind over the ground.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Bool, Float
from matplotlib.figure import Figure

from rotorjax.bench.azimuth import refine_azimuth
from rotorjax.bench.markdown import table
from rotorjax.bench.plotting import new_figure, polar_contour, save, shared_levels, style
from rotorjax.inflow.balance import Stations, pressure
from rotorjax.io import netcdf
from rotorjax.io.atomic import write_json, write_text
from rotorjax.io.page import write_page
from rotorjax.panels.kernel import solid_angles
from rotorjax.panels.surface import told
from rotorjax.potential.model import finite_state_model
from rotorjax.potential.rotors import Rotors, inflow_at, mean_inflows, rotors, steady, velocity
from rotorjax.potential.surfaces import IN_SHADOW
from rotorjax.study.arrangement import Arrangement
from rotorjax.wake.search import Progress
from rotorjax.wake.several_solution import SeveralSolution, solve_several

AZIMUTHS = 24
"""Of the maps, at least."""
NAMES = {"free_wake": "free wake", "vpbfsm": "VPBFSM"}
NEAR_GROUND = 0.1
"""Height over R at which the wind over the ground is shown: 0.8 m under a rotor of 8 m."""

Flow = Callable[[Float[Array, "P 3"]], Float[Array, "P 3"]]


@dataclass(frozen=True)
class Arranged:
    """An arrangement solved. wake: the free wake. states (N, M) of system: the finite states under its loads. inflow:
    maps (N, K, R) of each model over ΩR, positive down, at azimuths psi (rad, each rotor's own sense) and radii r/R.
    mean: area-weighted, (N,), the finite states' over each whole disk, the wake's over what its blades sweep. seconds:
    of the wake.
    """

    case: Arrangement
    wake: SeveralSolution
    system: Rotors
    states: Float[Array, "N M"]
    stations: Stations
    inflow: dict[str, Float[np.ndarray, "N K R"]]
    mean: dict[str, Float[np.ndarray, " N"]]
    seconds: float

    @property
    def flows(self) -> dict[str, Flow]:
        """Mean induced velocity over ΩR at points of the common frame, by each model."""
        return {"free_wake": self.wake.velocity, "vpbfsm": lambda points: velocity(self.states, points, self.system)}

    @property
    def differences(self) -> Float[np.ndarray, " N"]:
        """Area-weighted rms difference of the two maps over each annulus of blades, over the free wake's mean."""
        area = self.stations.r * self.stations.widths
        square = np.mean((self.inflow["vpbfsm"] - self.inflow["free_wake"]) ** 2, axis=1) @ area / np.sum(area)
        return np.sqrt(square) / self.mean["free_wake"]


def solve_arrangement(
    case: Arrangement, progress: Progress | None = None, *, solver: Callable[..., SeveralSolution] = solve_several
) -> Arranged:
    """Solve both models; a wake that is lost comes back with `converged` False."""
    began = time.perf_counter()
    wake = solver(case.wakes, None, progress)
    seconds = time.perf_counter() - began
    one = wake.rotors[0]
    (psi, loads), (_, maps) = (_around(wake, name) for name in ("dct_dr", "inflow"))
    stations = Stations(jnp.asarray(one.r), jnp.asarray(one.widths), jnp.asarray(psi))
    system = finite_states(case)
    states = steady(system, jnp.stack([pressure(jnp.asarray(load), stations, system.model) for load in loads]))
    return Arranged(
        case,
        wake,
        system,
        states,
        stations,
        {"free_wake": maps, "vpbfsm": np.asarray(inflow_at(states, stations.r, stations.psi, system))},
        {"free_wake": np.asarray(wake.mean_inflow), "vpbfsm": np.asarray(mean_inflows(states, system))},
        seconds,
    )


def _around(wake: SeveralSolution, name: str) -> tuple[Float[np.ndarray, " K"], Float[np.ndarray, "N K R"]]:
    """Azimuths of the maps, and a field of all rotors there."""
    found = [refine_azimuth(np.asarray(one.psi), np.asarray(getattr(one, name)), AZIMUTHS) for one in wake.rotors]
    return found[0][0], np.stack([values for _, values in found])


def finite_states(case: Arrangement) -> Rotors:
    """The finite states of all rotors, each closing ground and surfaces to its own wake."""
    settings = case.settings
    sources = (settings.harmonics, settings.source_terms) if case.surfaces is None else IN_SHADOW
    model = finite_state_model(
        None,
        harmonics=settings.harmonics,
        radial_terms=settings.radial_terms,
        ground_harmonics=sources[0],
        ground_radial_terms=sources[1],
    )
    return rotors(model, case.places.tolist(), None, case.senses.tolist(), case.ground, case.surfaces)


def write_arranged(found: Arranged, folder: Path) -> None:
    """Write maps.nc, summary.json, pictures and the report into a folder that exists."""
    netcdf.write(folder / "maps.nc", to_xarray(found))
    write_json(folder / "summary.json", summary(found))
    save(draw_maps(found), folder / "maps", ("png",))
    drawn = ["maps"]
    if found.case.ground is not None:
        save(draw_outwash(found), folder / "outwash", ("png",))
        drawn.append("outwash")
    text = report(found, drawn)
    write_text(folder / "report.md", text)
    write_page(folder / "report.html", text)


def to_xarray(found: Arranged) -> xr.Dataset:
    """Maps, means and loads as labelled arrays over rotor, azimuth (of each in its own sense) and radius."""
    around, each = ("rotor", "azimuth", "radius"), {"units": "1"}
    data = {f"{name}_inflow": (around, values, each | {"long_name": f"inflow over ΩR, {NAMES[name]}"})
            for name, values in found.inflow.items()}  # fmt: skip
    data |= {f"{name}_mean_inflow": ("rotor", values, each) for name, values in found.mean.items()}
    data |= {"CT": ("rotor", found.wake.CT, each), "CP": ("rotor", found.wake.CP, each)}
    data |= {"place": (("rotor", "axis"), found.case.places, each), "sense": ("rotor", found.case.senses, each)}
    data |= {"converged": ((), int(found.wake.converged), each)}
    axes = {"radius": ("radius", np.asarray(found.stations.r), each), "axis": ["aft", "starboard", "up"]}
    axes |= {"azimuth": ("azimuth", np.asarray(found.stations.psi), {"units": "rad"})}
    return xr.Dataset(data, axes, {"rotor": found.case.settings.rotor.name, "why": found.wake.why})


def summary(found: Arranged) -> dict:
    """Content of summary.json."""
    wake, ground, surfaces = found.wake, found.case.ground, found.case.surfaces
    return {
        "rotor": found.case.settings.rotor.name,
        "case": found.case.tables,
        "height": None if ground is None else float(ground.height),
        "panels": 0 if surfaces is None else len(surfaces),
        "leak": wake.leak,
        "converged": wake.converged,
        "why": wake.why,
        "residual": wake.residual,
        "iterations": wake.iterations,
        "seconds": found.seconds,
        "CT": wake.CT.tolist(),
        "CP": wake.CP.tolist(),
        "mean_inflow": {name: values.tolist() for name, values in found.mean.items()},
        "inflow_rms_difference": found.differences.tolist(),
    }


def report(found: Arranged, drawn: list[str]) -> str:
    """The report in Markdown."""
    wake, names = found.wake, tuple(NAMES.values())
    head = ["rotor", "hub x, y, z over R", "sense", "C_T", "C_P", *(f"{name}: mean inflow/ΩR" for name in names)]
    head += ["rms difference of the maps over the mean"]
    rows = [
        (str(i), ", ".join(f"{v:g}" for v in found.case.places[i]), "ccw" if sense > 0 else "cw", float(wake.CT[i]),
         float(wake.CP[i]), *(float(values[i]) for values in found.mean.values()), float(found.differences[i]))
        for i, sense in enumerate(found.case.senses)
    ]  # fmt: skip
    ground, surfaces = found.case.ground, found.case.surfaces
    place = "out of ground effect" if ground is None else f"{float(ground.height):g} R over level ground"
    place += "" if surfaces is None else f", among surfaces of {len(surfaces)} panels"
    verdict = (
        "" if wake.converged else f"**The free wake was not found: {wake.why}.** What follows is what was reached."
    )
    titles = {"maps": "Inflow over each disk", "outwash": f"Wind {NEAR_GROUND:g} R over the ground"}
    parts = [
        f"# Both models: {found.case.name}",
        f"{len(rows)} × {found.case.settings.rotor.name} at {found.case.settings.collective_deg:g}°, {place}. The free "
        f"wake is periodic (residual {wake.residual:.1e} R, {found.seconds:.0f} s); its loads drive the finite states, "
        "whose rotors induce on each other. Inflow is induced, positive down, C_T = T/(ρA(ΩR)²) of one disk.",
        verdict,
        f"Note: {words}." if (words := told(wake.leak)) else "",
        table(head, rows),
        *(f"## {titles[name]}\n\n![{titles[name]}]({name}.png)" for name in drawn),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def draw_maps(found: Arranged) -> Figure:
    """Inflow over each disk as it is seen from above, the free wake's over the finite states'."""
    count, r = len(found.case.senses), np.asarray(found.stations.r)
    levels = shared_levels(list(found.inflow.values()))
    with style():
        figure = new_figure(1.6 + 3.1 * count, 7.4)
        for row, (name, values) in enumerate(found.inflow.items()):
            for i, sense in enumerate(found.case.senses):
                axes = figure.add_subplot(2, count, row * count + i + 1, projection="polar")
                psi = np.asarray(found.stations.psi)
                shown = values[i] if sense > 0 else np.roll(values[i][::-1], 1, axis=0)  # from its own sense
                filled = polar_contour(axes, r, psi, shown, levels, ("aft", "ahead"))
                axes.set_title(f"{NAMES[name]}, rotor {i}", pad=18)
        figure.colorbar(filled, ax=figure.axes, label=r"inflow over $\Omega R$, positive down", shrink=0.7)
    return figure


def within(case: Arrangement, points: Float[Array, "P 3"]) -> Bool[np.ndarray, " P"]:
    """Which points lie inside a closed surface, where there is no air."""
    if case.surfaces is None:
        return np.zeros(len(points), bool)
    angle = jnp.sum(solid_angles(points, case.surfaces.corners), axis=1)
    return np.asarray(angle < -2 * np.pi)


def draw_outwash(found: Arranged) -> Figure:
    """Mean wind along the ground, NEAR_GROUND over it, by each model."""
    places, ground = found.case.places, found.case.ground
    assert ground is not None
    reach = [(places[:, k].min() - 2.5, places[:, k].max() + 2.5) for k in (0, 1)]
    x, y = np.meshgrid(*(np.linspace(*ends, 61) for ends in reach))
    z = np.full_like(x, NEAR_GROUND - float(ground.height))
    points = jnp.asarray(np.stack([x, y, z], axis=-1).reshape(-1, 3))
    winds = {name: np.asarray(flow(points)).reshape(*x.shape, 3) for name, flow in found.flows.items()}
    inside = within(found.case, points).reshape(x.shape)
    speeds = {name: np.where(inside, np.nan, np.hypot(wind[..., 0], wind[..., 1])) for name, wind in winds.items()}
    levels = shared_levels([np.minimum(speed, np.nanquantile(speed, 0.995)) for speed in speeds.values()])
    turn = np.linspace(0, 2 * np.pi, 100)
    with style():
        figure = new_figure(11.0, 1.0 + 4.4 * np.ptp(reach[1]) / np.ptp(reach[0]))
        for i, (name, wind) in enumerate(winds.items()):
            axes = figure.add_subplot(1, 2, i + 1, facecolor="#7a5c3e")
            filled = axes.contourf(x, y, speeds[name], levels=levels, cmap="viridis", extend="max")
            u, v = (np.where(inside, np.nan, wind[..., k]) for k in (0, 1))
            axes.streamplot(x[0], y[:, 0], u, v, color="white", linewidth=0.5, arrowsize=0.6)
            for hub in places:
                axes.plot(hub[0] + np.cos(turn), hub[1] + np.sin(turn), color="black", linewidth=1)
            axes.set(xlabel="aft, x/R", ylabel="to starboard, y/R", aspect="equal", title=NAMES[name])
            axes.set(xlim=reach[0], ylim=reach[1])
            axes.grid(visible=False)
        figure.colorbar(filled, ax=figure.axes, label=r"mean wind along the ground over $\Omega R$", shrink=0.8)
    return figure
