"""Several rotors solved together: read, drawn and written."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Array, Float

from rotorjax.wake.several_solution import SeveralSolution
from rotorjax.wake.solution import tip_vortices

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class SolvedTogether:
    """N rotors in their common periodic wake, beside `found`, the solution in rotor units.

    Arrays (N,): CT = T/(ρA(ΩR)²), CP, CP_induced, mean_inflow (over ΩR, the others' flow included), collective_deg.
    """

    def __init__(self, found: SeveralSolution):
        """Take a solution."""
        self.found = found

    CT = property(lambda self: self.found.CT, doc="Thrust coefficients.")
    CP = property(lambda self: self.found.CP, doc="Power coefficients.")
    CP_induced = property(lambda self: self.found.CP_induced, doc="Their induced parts.")
    mean_inflow = property(lambda self: self.found.mean_inflow, doc="Area-weighted mean inflows over ΩR.")
    collective_deg = property(lambda self: self.found.collective_deg, doc="Collectives, trimmed where asked for.")
    rotors = property(lambda self: self.found.rotors, doc="Each rotor's own readings, in its own frame.")
    converged = property(lambda self: self.found.converged, doc="Whether this is the steady state that was asked for.")
    why = property(lambda self: self.found.why, doc="How the search ended, in words.")
    clearance = property(lambda self: self.found.clearance, doc="Height over R of the lowest node above the ground.")
    leak = property(lambda self: self.found.leak, doc="Share that goes through surfaces between panels' middles.")

    def velocity(self, points: Float[Array, "P 3"]) -> Float[Array, "P 3"]:
        """Induced velocity over ΩR at points of the common frame over R, mean over the blades' passage."""
        return self.found.velocity(points)

    def tip_vortices(self) -> Float[np.ndarray, "N B A 3"]:
        """Nodes of all tip vortices at the instant at which every blade 0 stands at its phase, common frame, over R."""
        model = self.found.model
        own = np.stack([tip_vortices(one, model.wakes.rotor.blades) for one in self.rotors])
        placed = [v @ np.asarray(a).T + p for v, a, p in zip(own, model.axes, np.asarray(model.places), strict=True)]
        return np.stack(placed)

    def to_xarray(self) -> "xr.Dataset":
        """Everything as labelled arrays over rotor, azimuth (of each in its own sense) and radius."""
        import xarray as xr

        model, around = self.found.model, ("rotor", "azimuth", "radius")
        each = {"CT": "thrust coefficient T/(ρA(ΩR)²)", "CP": "power coefficient P/(ρA(ΩR)³)"}
        each |= {"CP_induced": "its induced part", "mean_inflow": "mean inflow over ΩR, positive down"}
        return xr.Dataset(
            {
                name: ("rotor", np.asarray(getattr(self, name)), {"units": "1", "long_name": t})
                for name, t in each.items()
            }
            | {
                "collective_deg": ("rotor", np.asarray(self.collective_deg), {"units": "degree"}),
                "sense": ("rotor", np.asarray(model.senses), {"units": "1", "long_name": "1: counter-clockwise"}),
                "shaft": (
                    ("rotor", "axis"),
                    np.asarray(model.axes)[..., 2],
                    {"units": "1", "long_name": "unit vector"},
                ),
                "place": (("rotor", "axis"), np.asarray(model.places), {"units": "1", "long_name": "hub over R"}),
                "inflow": (around, np.stack([np.asarray(one.inflow) for one in self.rotors]), {"units": "1"}),
                "dct_dr": (around, np.stack([np.asarray(one.dct_dr) for one in self.rotors]), {"units": "1"}),
                "converged": ((), int(self.converged)),
            },
            coords={
                "radius": ("radius", np.asarray(self.rotors[0].r), {"units": "1", "long_name": "radius over R"}),
                "azimuth": ("azimuth", np.asarray(self.rotors[0].psi), {"units": "rad"}),
                "axis": ["aft", "starboard", "up"],
            },
            attrs={"rotor": model.wakes.rotor.name, "model": "free wake of several rotors", "why": self.why},
        )

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Draw the mean flow in the upright plane in which the rotors lie apart, with their disks and tip vortices."""
        from rotorjax.api.picture import together
        from rotorjax.bench.plotting import save_file

        figure = together(self.found, self.tip_vortices())
        if path is not None:
            save_file(figure, path)
        return figure

    def to_vtk(self, path: str | Path) -> None:
        """Write all tip vortices for ParaView, lengths over R."""
        from rotorjax.io.vtk import write_polydata

        paths = self.tip_vortices()
        rotors, blades, ages = paths.shape[:3]
        lines = np.arange(rotors * blades * ages).reshape(rotors * blades, ages)
        number = np.repeat(np.arange(rotors), blades * ages).astype(float)
        write_polydata(path, paths.reshape(-1, 3), lines.tolist(), [], {"rotor": number}, "tip vortices over R")
