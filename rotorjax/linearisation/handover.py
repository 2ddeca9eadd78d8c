"""Models handed over, in SI and seconds or in rotor units and azimuth, with a README that says how to load them."""

import math
from pathlib import Path
from typing import Literal

from rotorjax.io.atomic import write_text
from rotorjax.ode.export import save_mat, save_netcdf
from rotorjax.ode.models import LinearModel, PeriodicModel
from rotorjax.ode.units import Model, converted
from rotorjax.operating import OperatingPoint
from rotorjax.rotor.geometry import Rotor

Time = Literal["seconds", "azimuth"]
TIMES: tuple[Time, ...] = ("seconds", "azimuth")


def handed_over(model: Model, rotor: Rotor, operating: OperatingPoint, time: Time = "seconds") -> Model:
    """The model as it is handed over: seconds come with SI units, azimuth with rotor units; coefficients stay."""
    if time == "azimuth":
        return model
    omega, radius = float(operating.omega), float(rotor.radius)
    tip, force = omega * radius, float(operating.force(rotor.radius))
    units = {
        "R": (radius, "m"),
        "ΩR": (tip, "m/s"),
        "Ω²R": (omega * tip, "m/s²"),
        "Ω": (omega, "rad/s"),
        "Ω²": (omega**2, "rad/s²"),
        "rad Ω": (omega, "rad/s"),
        "ΩR²": (tip * radius, "m²/s"),
        "ρA(ΩR)²": (force, "N"),
        "ρA(ΩR)²R": (force * radius, "N m"),
        "ρΩ²R³": (force / math.pi / radius, "N/m"),
    }
    return converted(model, units, omega, "seconds")


def save(models: dict[str, LinearModel | PeriodicModel], folder: Path, title: str) -> None:
    """Write every model as NetCDF and .mat, and README.md."""
    for name, model in models.items():
        save_netcdf(model, folder / f"{name}.nc")
        save_mat(model, folder / f"{name}.mat")
    write_text(folder / "README.md", readme(models, title))


def readme(models: dict[str, LinearModel | PeriodicModel], title: str) -> str:
    """What the files hold and how each is loaded."""
    one = models["reduced"]
    notes = "\n".join(
        f"- {name}: {value if isinstance(value, str) else format(value, '.6g')}" for name, value in one.notes.items()
    )
    signals = "\n".join(
        f"| {kind} | `{name}` | {unit} | {value:.6g} |"
        for kind, names, units, values in (
            ("input", one.inputs, one.input_units, one.u),
            ("output", one.outputs, one.output_units, one.y),
            ("state", one.states, one.state_units, one.x),
        )
        for name, unit, value in zip(names, units, values, strict=True)
    )
    files = "\n".join(f"| `{name}` | {model.order} | {FILES[name]} |" for name, model in models.items())
    return README.format(title=title, time=one.time, notes=notes, signals=signals, files=files)


FILES = {
    "reduced": "time-invariant, the blades' states kept, the inflow small",
    "full": "time-invariant, every state that the inputs reach (in a free wake in flight those it is condensed to)",
    "periodic": "A(t) … D(t) over one revolution, their last axis in MATLAB, their first in NetCDF",
}
"""What each file holds."""


README = """# {title}

Linear models about a trim: deviations obey x' = A x + B u, y = C x + D u; what is flown is u0 + u, x0 + x, y0 + y.
**Time is {time}**: poles are per unit of it.

| file | states | what |
|---|---|---|
{files}

Each as `.mat` (A, B, C, D, x0, u0, y0, states, inputs, outputs, their units, time, notes) and as `.nc`.

MATLAB and Simulink:

    m = load('reduced.mat');
    sys = ss(m.A, m.B, m.C, m.D, 'StateName', cellstr(m.states), ...
             'InputName', cellstr(m.inputs), 'OutputName', cellstr(m.outputs));
    % Simulink's State-Space block: A, B, C, D as they are, its input u - m.u0', its output y + m.y0', from rest

python-control:

    import scipy.io, control
    m = scipy.io.loadmat('reduced.mat', simplify_cells=True)
    system = control.StateSpace(m['A'], m['B'], m['C'], m['D'], inputs=list(m['inputs']), outputs=list(m['outputs']))

NetCDF, with names as coordinates:

    import xarray
    m = xarray.open_dataset('reduced.nc', engine='h5netcdf')
    m['B'].sel(input='theta_0')

Axes: u, v, w, p, q, r along and about x forward, y to starboard, z down (of a rotor that turns clockwise port takes
starboard's place); X, Y, Z, L, M, N on the hub in the same axes, its blades' weight and inertia included. theta_0,
theta_1c, theta_1s: pitch θ₀ + θ₁c cos ψ + θ₁s sin ψ, ψ = 0 aft. beta_0, beta_1c, … and lag_0, …: flap up and lag back
in multi-blade coordinates, `_D` the differential one. lambda_0, lambda_1c, lambda_1s: inflow over the disk, positive
down, λ_0 + λ_1c r cos ψ + λ_1s r sin ψ. A name `…|4c` is the coefficient of cos 4ψ. gust_u, gust_v, gust_w: velocity of
the air along the same axes; gust_aft, gust_starboard: amplitude of an upward gust sin πx/R, sin πy/R. CT is over
ρA(ΩR)², CQ over ρA(ΩR)²R.

## Operating point

{notes}

## Signals of the reduced model

| | name | unit | value in trim |
|---|---|---|---|
{signals}
"""
