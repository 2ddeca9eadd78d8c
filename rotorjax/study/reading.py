"""Numbers read off the merged data set: means, sides, extremes; what claims and report quote."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import xarray as xr

from rotorjax.bench.cases import SLOPE_HEIGHT, Case
from rotorjax.bench.dataset import present, select
from rotorjax.bench.record import annulus_shares, rms_difference


@dataclass(frozen=True)
class Reading:
    """The merged data set with questions to ask it. Inflow is over the free wake's mean out of ground effect.

    ours: which finite-state model is asked about, "vpbfsm" (the default choices) or "printed" (the paper's own).
    """

    merged: xr.Dataset
    ours: str = "vpbfsm"

    @property
    def as_printed(self) -> "Reading":
        """The same questions about the paper's own model."""
        return replace(self, ours="printed")

    @property
    def reference(self) -> float:
        """The free wake's mean inflow out of ground effect, over ΩR."""
        return float(self.merged["reference_inflow"])

    @property
    def r(self) -> np.ndarray:
        """Radii of the stations, over R."""
        return self.merged["radius"].to_numpy()

    @property
    def psi(self) -> np.ndarray:
        """Azimuths of the stations (rad)."""
        return self.merged["station_azimuth"].to_numpy()

    @property
    def widths(self) -> np.ndarray:
        """Widths of the panels, over R."""
        return self.merged["panel_width"].to_numpy()[0]

    def has(self, *cases: Case) -> bool:
        """Whether all these cases converged and have a sound solution of both models."""
        found = [select(self.merged, case) for case in cases]
        return all(data is not None and bool(data["converged"]) for data in found)

    def level(self) -> list[Case]:
        """Level cases that are there, from the highest down."""
        found = [c for c in present(self.merged) if c.height is not None and not c.slope_deg and self.has(c)]
        return sorted(found, key=lambda c: -(c.height or 0))

    def slopes(self) -> list[Case]:
        """Cases on a slope at h = 1 that are there, the level one first."""
        found = [c for c in present(self.merged) if c.height == SLOPE_HEIGHT and self.has(c)]
        return sorted(found, key=lambda c: c.slope_deg)

    def number(self, case: Case, name: str) -> float:
        """A scalar of a case."""
        return float(self.merged[name].sel(case=case.name))

    def field(self, case: Case, name: str) -> np.ndarray:
        """An array of a case, (K, R) for inflow and loading."""
        return self.merged[name].sel(case=case.name).to_numpy()

    def inflow(self, case: Case, model: str) -> np.ndarray:
        """Normalised inflow at the stations, (K, R); model: free_wake, vpbfsm, printed or exact_image."""
        return self.field(case, f"{model}_inflow") / self.reference

    def mean(self, case: Case, model: str) -> float:
        """Normalised mean inflow by area over what the blades sweep, where all models are asked."""
        return float(np.mean(self.inflow(case, model) @ annulus_shares(self.widths, (0.0, 1.0))))

    def side(self, case: Case, model: str, *, mountain: bool) -> float:
        """Normalised area-weighted mean inflow over one half of the annulus that is compared."""
        half = (np.cos(self.psi) * (1 if mountain else -1)) > 1e-9
        return float(np.mean(self.inflow(case, model)[half] @ annulus_shares(self.widths)))

    def tilt(self, case: Case, model: str) -> float:
        """Valley side less mountain side."""
        return self.side(case, model, mountain=False) - self.side(case, model, mountain=True)

    def side_rms(self, case: Case, model: str, *, mountain: bool) -> float:
        """Rms difference of a model and the free wake over one half."""
        half = (np.cos(self.psi) * (1 if mountain else -1)) > 1e-9
        ours, theirs = self.inflow(case, model)[half], self.inflow(case, "free_wake")[half]
        return rms_difference(ours, theirs, self.widths)

    def zone_rms(self, case: Case, model: str, between: tuple[float, float]) -> float:
        """Rms difference of a model and the free wake over an annulus."""
        pair = self.inflow(case, model), self.inflow(case, "free_wake")
        return rms_difference(*pair, self.widths, between)

    def zone_bias(self, case: Case, model: str, between: tuple[float, float]) -> float:
        """Area-weighted mean over an annulus of the free wake's inflow less a model's."""
        gap = self.inflow(case, "free_wake") - self.inflow(case, model)
        return float(np.mean(gap @ annulus_shares(self.widths, between)))

    def peak(self, case: Case, between: tuple[float, float], *, lowest: bool = False) -> tuple[float, float, float]:
        """Value, radius and azimuth (degrees) of the free wake's largest (or smallest) loading in an annulus."""
        inside = np.flatnonzero((self.r >= between[0]) & (self.r <= between[1]))
        field = self.field(case, "free_wake_dct_dr")[:, inside]
        k, i = np.unravel_index(np.argmin(field) if lowest else np.argmax(field), field.shape)
        return float(field[k, i]), float(self.r[inside[i]]), float(np.rad2deg(self.psi[k]))

    def sector(self, case: Case, between: tuple[float, float], centre_deg: float) -> float:
        """Mean loading of the free wake over an annulus, within 60° of an azimuth."""
        inside = (self.r >= between[0]) & (self.r <= between[1])
        near = np.cos(self.psi - np.deg2rad(centre_deg)) > 0.5 - 1e-9
        field = self.field(case, "free_wake_dct_dr")[near][:, inside]
        return float(np.mean(field @ self.widths[inside]) / self.widths[inside].sum())


def falls(values: list[float]) -> bool:
    """Whether each value is below the one before it."""
    return all(b < a for a, b in pairwise(values))


def listed(names: list[str], values: list[float], digits: int = 3) -> str:
    """`name value` pairs in one line."""
    return ", ".join(f"{name}: {value:.{digits}f}" for name, value in zip(names, values, strict=True))
