"""What the free wake is compared with: measurements that ship with the package, and formulas with their sources."""

import csv
from functools import cache
from importlib import resources
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

MASS = 0.849
"""Apparent mass of an impermeable disk over ρπR³, 8/(3π)."""
OTHER_MASS = 0.543
"""The same for a disk whose flow follows its load, 128/(75π) (Pitt & Peters, Vertica 5, 1981)."""
SLOPE = 5.73
"""Lift slope (per rad) that goes with Carpenter and Fridovich's response."""


class Hover(NamedTuple):
    """Caradonna and Tung's rotor at 8°. thrust: C_T. r, lift (5,): stations over R and section lift coefficient."""

    thrust: float
    r: Float[np.ndarray, " N"]
    lift: Float[np.ndarray, " N"]


class Polar(NamedTuple):
    """A measured hover polar. pitch_deg (N,); thrust, torque (N,): C_T and C_Q, rising."""

    pitch_deg: Float[np.ndarray, " N"]
    thrust: Float[np.ndarray, " N"]
    torque: Float[np.ndarray, " N"]


class Path(NamedTuple):
    """A tip vortex. age (A,) in rad, from the blade; r (A,) over R; z (A,) over R, positive up."""

    age: Float[np.ndarray, " A"]
    r: Float[np.ndarray, " A"]
    z: Float[np.ndarray, " A"]


@cache
def caradonna_tung() -> Hover:
    """Measured C_T and section lift at 8° (NASA TM-81232)."""
    rows = _rows("hover_8deg.csv")
    lift = [(float(r["r_over_R"]), float(r["value"])) for r in rows if r["quantity"] == "c_l"]
    thrust = next(float(r["value"]) for r in rows if r["quantity"] == "C_T")
    return Hover(thrust, *np.array(lift).T)


@cache
def caradonna_tung_thrust() -> dict[float, float]:
    """Measured C_T by collective in degrees, 1250 rpm (NASA TM-81232)."""
    return {float(r["collective_deg"]): float(r["CT"]) for r in _rows("caradonna_tung_thrust.csv")}


@cache
def knight_hefner(blades: int) -> Polar:
    """Measured hover polar of Knight and Hefner's rotor with two or four blades (NACA TN 626, 1937)."""
    rows = [r for r in _rows("knight_hefner.csv") if int(r["blades"]) == blades]
    return Polar(*(np.array([float(r[name]) for r in rows]) for name in ("pitch_deg", "CT", "CQ")))


@cache
def caradonna_tung_path() -> Path:
    """Measured tip vortex at 8°, the authors' curve fit (NASA TM-81232, fig. 10)."""
    rows = np.array([[float(v) for v in r.values()] for r in _rows("tip_vortex_8deg.csv")])
    return Path(np.deg2rad(rows[:, 0]), rows[:, 1], -rows[:, 2])


def momentum_inflow(thrust: float) -> float:
    """Uniform inflow over ΩR in hover, √(C_T/2)."""
    return float(np.sqrt(thrust / 2))


def figure_of_merit(thrust: float, torque: float) -> float:
    """Ideal induced power over power, C_T^1.5/√2 / C_P (C_P = C_Q)."""
    return float(thrust**1.5 / np.sqrt(2) / torque)


def induced_power_factor(thrust: float, induced: float) -> float:
    """C_Pi over that of uniform inflow, C_T^1.5/√2."""
    return float(induced / (thrust**1.5 / np.sqrt(2)))


def landgrebe(age: Float[np.ndarray, " A"], thrust: float, solidity: float, twist_deg: float, blades: int) -> Path:
    """Landgrebe's tip vortex in hover (J. AHS 17(4), 1972).

    age: in rad. twist_deg: linear twist from axis to tip, negative for washout.
    r = 0.78 + 0.22 exp(−Λζ), Λ = 0.145 + 27 C_T. z falls by k₁ = −0.25 (C_T/σ + 0.001 θ_tw) a radian up to the first
    blade passage at 2π/B, and by k₂ (`landgrebe_pitch`) from there.
    """
    rate = 0.145 + 27 * thrust
    first = -0.25 * (thrust / solidity + 0.001 * twist_deg)
    passage = 2 * np.pi / blades
    z = first * np.minimum(age, passage) + landgrebe_pitch(thrust, twist_deg) * np.maximum(age - passage, 0.0)
    return Path(age, 0.78 + 0.22 * np.exp(-rate * age), z)


def landgrebe_pitch(thrust: float, twist_deg: float) -> float:
    """Landgrebe's k₂: change of z over R a radian beyond the first blade passage, −(1.41 + 0.0141 θ_tw) √(C_T/2)."""
    return float(-(1.41 + 0.0141 * twist_deg) * np.sqrt(thrust / 2))


def hayden_factor(height: Float[Array, "*N"]) -> Float[Array, "*N"]:
    """Return Hayden's k_G of heights over R: induced power over that out of ground effect at the same thrust, ≤ 1."""
    return jnp.minimum(1 / (0.9926 + 0.0379 * (2 / height) ** 2), 1.0)


def isolated_rotors(height: float) -> float | None:
    """Measured inflow near level ground over that far from it, at the same thrust: isolated model rotors in hover.

    Mean curve of Knight & Hefner (NACA TN 835, 1941) and others as reduced by Prouty; digitised to 0.005, None where it
    has no measurement. height: over R.
    """
    curve = np.array([[float(v) for v in row.values()] for row in _rows("isolated_rotors_in_ground_effect.csv")])
    inside = curve[0, 0] <= height <= curve[-1, 0]
    return float(np.interp(height, *curve.T)) if inside else None


def hayden(height: float) -> float:
    """Hayden's induced power in ground effect over that out of it, at the same thrust (AHS 32nd Forum, 1976).

    A fit to flight tests, so of rotors with a fuselage underneath. height: over R.
    """
    return float(hayden_factor(jnp.asarray(height)))


def cheeseman_bennett(height: float) -> float:
    """Cheeseman and Bennett's inflow in ground effect over that out of it, at the same thrust (ARC R&M 3021, 1955).

    height: over R. Their T/T∞ = 1/(1 − (R/4h)²) holds at the same power. As induced power goes with T^1.5, at the same
    thrust it is that to the power −3/2.
    """
    return (1 - (1 / (4 * height)) ** 2) ** 1.5


@cache
def _curve(name: str, column: str) -> tuple[np.ndarray, np.ndarray]:
    rows = _rows(name)
    return tuple(np.array([float(row[key]) for row in rows]) for key in ("h_over_R", column))  # type: ignore[return-value]


def model_rotors(height: float) -> float:
    """Measured inflow of isolated model rotors over that out of ground effect, at the same thrust; height: over R.

    NACA TN 835 and USAAMRDL TR 72-4, as reduced by Prouty. The curve ends at 2.2 R with 0.982; beyond, 1 less it falls
    as 1/h².
    """
    heights, ratio = _curve("ground_effect_model_rotors.csv", "v_ratio_constant_thrust")
    if height > heights[-1]:
        return float(1 - (1 - ratio[-1]) * (heights[-1] / height) ** 2)
    return float(np.interp(height, heights, ratio))


def computed_ground_model(height: float) -> float:
    """Peters' computed induced power ratio over ground (J. AHS 54(1) 011001, fig. 16); NaN above 2 R."""
    heights, ratio = _curve("ground_effect_computed.csv", "kG")
    return float(np.interp(height, heights, ratio, right=np.nan))


def step_response(
    psi: Float[np.ndarray, " N"], inflow: float, solidity: float, mass: float = MASS
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """Inflow and thrust after a small step of collective, over their final changes (Carpenter & Fridovich, TN 3044).

    0.849 λ' + 2λ² = C_T with C_T = σa/2 (θ/3 − λ/2), linear about the inflow λ over ΩR: one exponential of the rate
    (4λ + σa/4)/0.849. psi: azimuth since the step (rad); mass: in place of 0.849. Returns δλ/δλ(∞) and δC_T/δC_T(∞),
    which starts at 1 + σa/(16 λ), not at 1.
    """
    feedback = solidity * SLOPE / 4
    left = np.exp(-(4 * inflow + feedback) / mass * psi)
    return 1 - left, 1 + feedback / (4 * inflow) * left


def _rows(name: str) -> list[dict[str, str]]:
    text = (resources.files("rotorjax.reference") / "data" / name).read_text(encoding="utf-8")
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
