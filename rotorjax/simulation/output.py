"""A flight as labelled arrays, as a report, as pictures and as an animation."""

from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from rotorjax.bench import plotting
from rotorjax.bench.film import write_film
from rotorjax.coupled import inflow_velocity, stations
from rotorjax.coupled_wake import CoupledWake
from rotorjax.inflow.momentum import in_vortex_ring
from rotorjax.rotor import multiblade
from rotorjax.rotor.hub import ATTITUDE
from rotorjax.simulation.ground_view import ground_arrays, ground_line
from rotorjax.simulation.run import Simulated
from rotorjax.simulation.wake_output import wake_arrays

_RAYS, _RADII, _MOST_FRAMES = 36, 16, 90
_LINES = ("-", "--", ":", "-.", (0, (1, 3)))


def dataset(found: Simulated) -> xr.Dataset:
    """Histories over time: inputs, multi-blade angles, coefficients, hub loads in SI, and the inflow over the disk."""
    p, flown = found.start.p, found.flown
    u, x, y = flown.u, flown.x, flown.y
    degrees = {"units": "deg"}
    radius, tip = float(p.rotor.radius), float(p.operating.tip_speed(p.rotor.radius))
    force = float(p.operating.force(p.rotor.radius))
    omega = float(p.operating.omega)
    data = xr.Dataset(
        coords={
            "time": ("time", np.asarray(flown.t) / omega, {"units": "s"}),
            "coordinate": list(multiblade.names(p.rotor.blades)),
            "blade": np.arange(p.rotor.blades),
            "axis": ["aft", "starboard", "up"],
        },
        attrs={
            "rotor": p.rotor.name,
            "inflow": found.case.request.inflow,
            "slope_deg": found.case.request.slope_deg,
            "finished": int(found.finished),
        },
    )
    for name in ("CT", "CQ"):
        data[f"trim_{name}"] = ((), getattr(found.start, name), {"long_name": "mean over a revolution of the trim"})
    data = data.assign(_inputs(found, tip))
    data["azimuth"] = ("time", np.asarray(x.psi), {"units": "rad"})
    if u.height is not None:
        data = data.assign(ground_arrays(u, found.case.request.slope_deg))
    data["flap"] = (("time", "coordinate"), np.rad2deg(x.rotor.flap), degrees)
    data["lag"] = (("time", "coordinate"), np.rad2deg(x.rotor.lag), degrees)
    data["blade_flap"] = (("time", "blade"), np.rad2deg(y.flap), degrees)
    for name in ("CT", "CQ", "CP_induced", "CP_profile", "CP_parasite", "CP_damper"):
        data[name] = ("time", np.asarray(getattr(y, name)))
    data["hub_force"] = (("time", "axis"), np.asarray(y.force) * force, {"units": "N"})
    data["hub_moment"] = (("time", "axis"), np.asarray(y.moment) * force * radius, {"units": "N m"})
    data["largest_alpha"] = ("time", np.rad2deg(np.max(np.asarray(y.alpha), axis=(1, 2))), degrees)
    count = found.flown.t.size
    at = np.arange(0, count, max(1, -(-count // _MOST_FRAMES)))
    data = data.assign(_frames(found, at))
    return data.assign(wake_arrays(found, at)) if isinstance(p, CoupledWake) else data


def _inputs(found: Simulated, tip: float) -> dict[str, tuple]:
    """Controls, hub motion and attitude; tip: ΩR in m/s."""
    u, omega = found.flown.u, float(found.start.p.operating.omega)
    angles = ("theta_0", "theta_1c", "theta_1s", *ATTITUDE)
    told = {name: ("time", np.rad2deg(getattr(u, name)), {"units": "deg"}) for name in angles}
    told |= {name: ("time", np.asarray(getattr(u, name)) * tip, {"units": "m/s"}) for name in ("u", "v", "w")}
    told |= {name: ("time", np.rad2deg(getattr(u, name)) * omega, {"units": "deg/s"}) for name in ("p", "q", "r")}
    return told | {"rotor_speed": ("time", np.asarray(u.omega), {"long_name": "over the nominal one"})}


def _frames(found: Simulated, at: np.ndarray) -> dict[str, xr.DataArray]:
    """The inflow over the disk at the saves `at`; in a free wake with what the blades themselves induce."""
    p = found.start.p
    r = np.linspace(float(stations(p)[0]), float(stations(p)[-1]), _RADII)
    psi = 2 * np.pi / _RAYS * np.arange(_RAYS)
    points = np.stack([r * np.cos(psi)[:, None], r * np.sin(psi)[:, None], 0 * r * psi[:, None]], axis=-1)

    rows = jax.tree.map(lambda v: v[at], (found.flown.x, found.flown.u))
    fields = np.asarray(_fields(rows, jnp.asarray(points.reshape(-1, 3)), p)).reshape(-1, _RAYS, _RADII)
    coords = {"frame": at, "ray": ("ray", psi, {"units": "rad"}), "radius": r}
    attrs = {"long_name": "λ over ΩR, positive down"}
    return {"inflow": xr.DataArray(fields, coords, ("frame", "ray", "radius"), attrs=attrs)}


@eqx.filter_jit
def _fields(rows, points, p):
    def field(row):
        return -inflow_velocity(row[0], points, row[1], p)[..., 2]

    return jax.lax.map(field, rows, batch_size=None if isinstance(p, CoupledWake) else 16)


def report(found: Simulated, data: xr.Dataset) -> dict[str, Any]:
    """How it went and how fast: seconds of the march per revolution and against the clock."""
    flown_s = float(data["time"][-1])
    turns = float(data["azimuth"][-1]) / (2 * np.pi)
    names = [
        n for n in ("height", "clearance", "roll", "pitch", "CT", "CQ", "rotor_speed", "largest_alpha") if n in data
    ]
    series = {n: data[n].values for n in names}
    series |= {f"beta_{c}_deg": data["flap"].sel(coordinate=c).values for c in data["coordinate"].values}
    return {
        "rotor": data.attrs["rotor"],
        "inflow": data.attrs["inflow"],
        "finished": found.finished,
        "why": found.why,
        "steps": found.steps,
        "simulated_s": flown_s,
        "revolutions": turns,
        "march_s": found.march_s,
        "march_s_per_revolution": found.march_s / turns,
        "real_time_factor": flown_s / found.march_s,
        **({} if found.pace is None else {"frames": found.pace.frames, "late_frames": found.pace.late}),
        "vortex_ring_s": vortex_ring(found, data["time"].values),
        **_of_the_wake(data),
        "histories": {
            n: {"first": v[0], "last": v[-1], "min": float(np.min(v)), "max": float(np.max(v))}
            for n, v in series.items()
        },
    }


def vortex_ring(found: Simulated, time: np.ndarray) -> float:
    """Seconds of a flight in the vortex ring state, by C_T and the hub's velocities along and across the shaft."""
    u, thrust = found.flown.u, np.asarray(found.flown.y.CT)
    within = in_vortex_ring(thrust, -np.asarray(u.w), np.hypot(np.asarray(u.u), np.asarray(u.v)))
    return float(np.sum(np.diff(time) * within[1:]))


def _of_the_wake(data: xr.Dataset) -> dict[str, Any]:
    """How far a free wake has left itself: its change over the last revolution, and the largest."""
    if "wake_change" not in data:
        return {}
    change = data["wake_change"].values
    late = change[np.isfinite(change)]
    return {} if not late.size else {"wake_change_last": float(late[-1]), "wake_change_max": float(late.max())}


def histories(data: xr.Dataset) -> Figure:
    """Controls, flapping, thrust and power, hub motion over time."""
    t = data["time"].values
    with plotting.style():
        figure = plotting.new_figure(9.0, 6.0)
        controls, flapping, loads, motion = figure.subplots(2, 2, sharex=True).flat
        for name, label, line in zip(("theta_0", "theta_1c", "theta_1s"), ("0", "1c", "1s"), _LINES, strict=False):
            added = data[name] - data[name][0]
            controls.plot(t, added, ls=line, label=rf"$\theta_{{{label}}}$ {float(data[name][0]):+.2f}°")
        controls.set(ylabel="pitch less the trim's, deg")
        for name, line in zip(data["coordinate"].values, _LINES, strict=False):
            flapping.plot(t, data["flap"].sel(coordinate=name), ls=line, label=rf"$\beta_{{{name}}}$")
        flapping.set(ylabel="flap, deg")
        for name, label, line in (("CT", r"$C_T$", "-"), ("CQ", r"$C_Q$", "--")):
            turned = over_a_turn(data, name)
            (mean,) = loads.plot(t, turned / turned[0], ls=line, label=f"{label}, trim {turned[0]:.3e}")
            loads.plot(t, data[name] / turned[0], ls=line, lw=0.7, alpha=0.5, color=mean.get_color())
        loads.set(xlabel="time, s", ylabel="over the trim's (bold: last turn's mean)")
        for name in ("u", "v", "w"):
            if float(abs(data[name]).max()) > 1e-9:
                motion.plot(t, data[name], label=f"${name}$, m/s")
        for name in ("p", "q", "r"):
            if float(abs(data[name]).max()) > 1e-9:
                motion.plot(t, data[name], ls="--", label=f"${name}$, deg/s")
        for name in ("roll", "pitch"):
            if float(abs(data[name] - data[name][0]).max()) > 1e-9:
                motion.plot(t, data[name], ls=(0, (1, 3)), label=f"{name}, deg")
        if float(abs(data["rotor_speed"] - 1).max()) > 1e-9:
            motion.plot(t, 100 * (data["rotor_speed"] - 1), ls=":", label=r"$\Omega$ change, %")
        if "height" in data:
            motion.plot(t, data["height"], ls="-.", color=plotting.INK, label="height over $R$")
        motion.set(xlabel="time, s", ylabel="hub")
        if not motion.lines:
            motion.text(0.5, 0.5, "hub at rest", ha="center", transform=motion.transAxes)
        for axes in (controls, flapping, loads, *([motion] if motion.lines else [])):
            axes.legend(loc="best", fontsize=8)
    return figure


def over_a_turn(data: xr.Dataset, name: str) -> np.ndarray:
    """Mean of a history over the revolution that ends at each instant; before the start it is the trim's mean.

    ∫f dψ/2π from ψ − 2π to ψ by trapezoids: no instant knows of what comes after it.
    """
    psi, values, before = data["azimuth"].values, data[name].values, float(data[f"trim_{name}"])
    before = before if np.isfinite(before) else float(values[0])
    so_far = np.concatenate([[0.0], np.cumsum(np.diff(psi) * (values[1:] + values[:-1]) / 2)])
    since = psi - psi[0] - 2 * np.pi
    earlier = np.where(since < 0, since * before, np.interp(psi - 2 * np.pi, psi, so_far))
    return (so_far - earlier) / (2 * np.pi)


def animation(data: xr.Dataset, path: str | Path, frames_per_second: int = 15) -> None:
    """Write a GIF: blades from the side with their flapping drawn large, the inflow from above, thrust so far."""
    frames, psi = data["frame"].values, np.append(data["ray"].values, 2 * np.pi)
    fields = data["inflow"].values
    fields = np.concatenate([fields, fields[:, :1]], axis=1)
    r = data["radius"].values
    x, y = r * np.cos(psi)[:, None], r * np.sin(psi)[:, None]
    large, thrust, t = 3.0, over_a_turn(data, "CT"), data["time"].values

    def build(figure: Figure) -> Any:
        side, disk, history = figure.subplots(1, 3, width_ratios=(1.3, 1.0, 1.2))
        levels = plotting.shared_levels([fields])
        mesh = disk.pcolormesh(x, y, fields[0], shading="gouraud", vmin=levels[0], vmax=levels[-1], cmap="viridis")
        disk.set(aspect="equal", xticks=[], yticks=[], title="inflow from above", xlabel="forward ← → aft")
        disk.grid(visible=False)
        figure.colorbar(mesh, ax=disk, shrink=0.7, label=r"$\lambda$")
        spokes = [disk.plot([], [], color="white", lw=1.2)[0] for _ in data["blade"]]
        history.plot(t, thrust, color=plotting.FREE_WAKE)
        (dot,) = history.plot([], [], "o", color=plotting.INK, ms=5)
        history.set(xlabel="time, s", ylabel=r"$C_T$, mean over the last revolution")
        lowest = -float(data["height"].max()) if "height" in data else -0.6
        side.set(xlim=(-1.15, 1.15), ylim=(min(lowest, -0.6) - 0.1, 0.8), aspect="equal", xticks=[], yticks=[])
        side.set_xlabel("forward ← → aft")
        side.grid(visible=False)
        blades = [side.plot([], [], color=plotting.INK, lw=2)[0] for _ in data["blade"]]
        (floor,) = side.plot([], [], color="#888888", lw=3)
        ends = np.array([-1.15, 1.15])

        def draw(frame: int) -> None:
            at = int(frames[frame])
            mesh.set_array(fields[frame])
            for k, (blade, spoke) in enumerate(zip(blades, spokes, strict=True)):
                azimuth = float(data["azimuth"][at]) + 2 * np.pi * k / len(blades)
                flap = np.deg2rad(large * float(data["blade_flap"][at, k]))
                blade.set_data([0, np.cos(azimuth) * np.cos(flap)], [0, np.sin(flap)])
                spoke.set_data([0, np.cos(azimuth)], [0, np.sin(azimuth)])
            if "height" in data:
                floor.set_data(ends, ground_line(ends, data, at))
            dot.set_data([t[at]], [thrust[at]])
            side.set_title(f"t = {t[at]:.2f} s, flapping ×{large:g}")

        return draw

    write_film(path, build, len(frames), (9.0, 3.4), frames_per_second)
