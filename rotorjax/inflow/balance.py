"""Blade loads and the steady finite-state inflow that make each other: the pressure terms that reproduce themselves."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from rotorjax.checks import known
from rotorjax.errors import InputError
from rotorjax.inflow.momentum import VORTEX_RING
from rotorjax.operating import OperatingPoint
from rotorjax.potential import loading
from rotorjax.potential.model import (
    FiniteState,
    FiniteStateModel,
    UnitStates,
    steady_state,
    unit_inflow,
    unit_states,
)
from rotorjax.rotor.blade_element import SectionLoads, disk_loading, lifting_share, rotor_coefficients, section_loads
from rotorjax.rotor.geometry import Rotor

AZIMUTHS, PANELS = 24, 48
FIRST_CT = 0.005
"""Where the search for a loading starts."""


class Stations(eqx.Module):
    """Where the blades carry load. r, widths (R,): over R. psi (K,): equally spaced azimuths over one turn (rad)."""

    r: Float[Array, " R"]
    widths: Float[Array, " R"]
    psi: Float[Array, " K"]

    @property
    def xy(self) -> tuple[Float[Array, "K R"], Float[Array, "K R"]]:
        """Hub-frame stations."""
        return self.r * jnp.cos(self.psi)[:, None], self.r * jnp.sin(self.psi)[:, None]


class StationFlow(eqx.Module):
    """unit: of a model. at (M, K, R): inflow of unit rotor states at the stations."""

    unit: UnitStates
    at: Float[Array, "M K R"]


class Balance(eqx.Module):
    """Loads and inflow in balance, in rotor units. tau (M,): pressure coefficients. state: rotor and ground.

    r, widths (R,), psi (K,): stations. inflow (over ΩR, positive down, induced), dct_dr (K, R): there. CT, CP =
    CP_induced + CP_profile: of the blade elements. mean_inflow: area-weighted over the whole disk. converged: True
    (static): where there is no balance none is returned.
    """

    tau: Float[Array, " M"]
    state: FiniteState
    r: Float[Array, " R"]
    widths: Float[Array, " R"]
    psi: Float[Array, " K"]
    inflow: Float[Array, "K R"]
    dct_dr: Float[Array, "K R"]
    CT: Float[Array, ""]
    CP: Float[Array, ""]
    CP_induced: Float[Array, ""]
    CP_profile: Float[Array, ""]
    mean_inflow: Float[Array, ""]
    converged: bool = eqx.field(static=True, default=True)
    why: str = eqx.field(static=True, default="loads and inflow in balance")

    @property
    def stations(self) -> Stations:
        """Where loads and inflow are."""
        return Stations(self.r, self.widths, self.psi)


@partial(jax.jit, static_argnames=("panels", "azimuths"), inline=True)
def stations_of(rotor: Rotor, panels: int = PANELS, azimuths: int = AZIMUTHS) -> Stations:
    """Middles of equal panels from the cut-out to the tip, at equally spaced azimuths."""
    edges = rotor.root_cutout + (1 - rotor.root_cutout) * np.linspace(0.0, 1.0, panels + 1)
    psi = 2 * np.pi / azimuths * np.arange(azimuths)
    return Stations(0.5 * (edges[1:] + edges[:-1]), jnp.diff(edges), jnp.asarray(psi, edges.dtype))


def axial_state(
    model: FiniteStateModel, tau: Float[Array, " M"], climb: Float[Array, ""], unit: UnitStates | None = None
) -> FiniteState:
    """Steady states in any axial flight that momentum theory knows; a thrust down is one up, upside down.

    unit: of the model, where it is at hand. In the windmill brake state, out of ground effect, the air goes up with V_T
    = −(V_c + v) and V̄ = −(V_c + 2v); else `steady_state`.
    """
    thrust = loading.thrust_coefficient(tau, model.modes)
    sign = jnp.where(thrust < 0, -1.0, 1.0)
    tau, climb, hover = sign * tau, sign * climb, jnp.sqrt(jnp.abs(thrust) / 2)
    windmill = climb <= VORTEX_RING[0] * hover
    state = steady_state(model, tau, jnp.where(windmill, 0.0, climb), unit)
    if model.ground is None and model.surfaces is None:
        inner = jnp.sqrt(jnp.where(windmill, climb**2 / 4 - hover**2, 1.0))  # |V_c|/2 − v
        through, varying = inner - climb / 2, 2 * inner
        braked = tau / jnp.where(model.varying, varying, through)
        state = FiniteState(jnp.where(windmill, braked, state.a), state.c)
    return FiniteState(sign * state.a, sign * state.c)


def balance(
    model: FiniteStateModel,
    rotor: Rotor,
    operating: OperatingPoint,
    stations: Stations,
    thrust: float = FIRST_CT,
    flow: StationFlow | None = None,
) -> Balance:
    """Find the loading that reproduces itself, by Newton's method; differentiable by the implicit function theorem.

    thrust: C_T that the search starts from, negative for a rotor that is turned by the wind or thrusts down. flow: of
    unit states at the stations, where it is at hand. Lift ends at the rotor's `tip_loss`. Raises InputError where
    none is found, under jit an error at run time.
    """
    flow = flow_of(model, stations) if flow is None else flow
    tau, found = _search(flow, model, rotor, operating, stations, jnp.asarray(thrust, stations.r.dtype))
    pitch = f"at {np.rad2deg(float(operating.collective)):g} deg " if known(operating.collective) else ""
    words = (
        f"Argument `collective` must give a loading that thrusts {'up' if thrust > 0 else 'down'}ward, but {pitch}no "
        f"steady one was found (residual tolerance {tolerance(tau.dtype):.0e})"
    )
    if known(found) and not bool(found):
        raise InputError(words)
    return _read(eqx.error_if(tau, ~found, words), flow, model, rotor, operating, stations)


@eqx.filter_jit
def flow_of(model: FiniteStateModel, stations: Stations) -> StationFlow:
    """The costly part of a balance, which neither blades nor loads change."""
    unit = unit_states(model)
    return StationFlow(unit, unit_inflow(model, unit, *stations.xy))


def attempt(
    flow: StationFlow,
    model: FiniteStateModel,
    rotor: Rotor,
    operating: OperatingPoint,
    stations: Stations,
    thrust: Float[Array, ""],
) -> tuple[Balance, Bool[Array, ""]]:
    """As `balance`, but never refused: what the search ended with, and whether it is a balance. For batches by vmap."""
    tau, found = _search(flow, model, rotor, operating, stations, thrust)
    return _read(tau, flow, model, rotor, operating, stations), found


@eqx.filter_jit
def _search(flow: StationFlow, model, rotor, operating, stations: Stations, thrust):
    """Pressure terms in balance, and whether they are and thrust as the first ones do."""
    start = jnp.zeros(len(model.modes), stations.r.dtype).at[model.modes.index(0, 1)].set(np.sqrt(3) / 4 * thrust)
    climb = operating.climb_ratio(rotor.radius)

    def inflow_of(tau):
        return jnp.tensordot(axial_state(model, tau, climb, flow.unit).a, flow.at, 1)

    tau, found = self_consistent(start, inflow_of, model, rotor, operating, stations)
    return tau, found & (loading.thrust_coefficient(tau, model.modes) * thrust > 0)


@eqx.filter_jit
def _read(tau, flow: StationFlow, model, rotor, operating, stations: Stations) -> Balance:
    climb = operating.climb_ratio(rotor.radius)
    state = axial_state(model, tau, climb, flow.unit)
    induced = jnp.tensordot(state.a, flow.at, 1)
    loads = blade_loads(induced + climb, rotor, operating, stations)
    total = rotor_coefficients(rotor, loads, stations.r, stations.widths)
    return Balance(
        tau=tau,
        state=state,
        r=stations.r,
        widths=stations.widths,
        psi=stations.psi,
        inflow=induced,
        dct_dr=disk_loading(rotor, loads),
        CT=total.thrust,
        CP=total.power,
        CP_induced=total.induced,
        CP_profile=total.profile,
        mean_inflow=(flow.unit.down - flow.unit.up) @ state.a,
    )


def self_consistent(
    start: Float[Array, " M"],
    inflow_of: Callable[[Float[Array, " M"]], Float[Array, "K R"]],
    model: FiniteStateModel,
    rotor: Rotor,
    operating: OperatingPoint,
    stations: Stations,
) -> tuple[Float[Array, " M"], Array]:
    """Pressure terms whose inflow at the stations, made of them by `inflow_of`, gives them back; and whether found."""
    import optimistix as optx  # takes a quarter of a second to load, and given loads need none of it

    climb = operating.climb_ratio(rotor.radius)

    def residual(tau, _):
        down = inflow_of(tau) + climb
        return pressure(disk_loading(rotor, blade_loads(down, rotor, operating, stations)), stations, model) - tau

    rtol = tolerance(start.dtype)
    found = optx.root_find(residual, optx.Newton(rtol=rtol, atol=rtol / 100), start, max_steps=50, throw=False)
    return found.value, found.result == optx.RESULTS.successful


def blade_loads(down: Float[Array, "K R"], rotor: Rotor, operating: OperatingPoint, stations: Stations) -> SectionLoads:
    """Section loads of an inflow over ΩR, positive down, climb included; no lift beyond the rotor's `tip_loss`."""
    loads = section_loads(rotor, operating, stations.r, jnp.broadcast_to(stations.r, down.shape), down)
    return replace(loads, dlift=loads.dlift * lifting_share(rotor, stations.widths))


def tolerance(dtype: Any) -> float:
    """Relative change of the pressure terms at which they count as found: 1e-10, or single precision's rounding."""
    return 1e-10 if jnp.finfo(dtype).bits == 64 else 2e-5


@eqx.filter_jit
def pressure(dct_dr: Float[Array, "K R"], stations: Stations, model: FiniteStateModel) -> Float[Array, " M"]:
    """Pressure coefficients of a loading dC_T/dr̄ (Eq. 2)."""
    return loading.from_distribution(dct_dr, stations.r, stations.widths, stations.psi, model.modes)
