"""The files that a flight leaves behind."""

from pathlib import Path
from typing import Any

from rotorjax.bench import plotting
from rotorjax.io import netcdf
from rotorjax.io.atomic import write_json
from rotorjax.io.scene import write_scene
from rotorjax.simulation import output
from rotorjax.simulation.report import write_report
from rotorjax.simulation.run import Simulated
from rotorjax.simulation.wake_output import wake_scene, write_vtk
from rotorjax.simulation.wake_pictures import wake_film, wake_picture


def write_all(found: Simulated, out: Path, *, animated: bool = False) -> dict[str, Any]:
    """Write history.nc, report.json, report.html, histories.png; of a free wake wake.png, wake.html, vtk/; on request
    animation.gif.

    Returns the report. Raises InputError where a file cannot be written.
    """
    data = output.dataset(found)
    netcdf.write(out / "history.nc", data)
    told = output.report(found, data)
    write_json(out / "report.json", told)
    plotting.save(output.histories(data), out / "histories")
    wake = "wake_filaments" in data
    if wake:
        write_vtk(out / "vtk", data)
        write_scene(out / "wake.html", wake_scene(data))
        plotting.save(wake_picture(data), out / "wake")
    if animated and wake:
        wake_film(data, output.over_a_turn(data, "CT"), out / "animation.gif")
    elif animated:
        output.animation(data, out / "animation.gif")
    write_report(out, told, _asked(found))
    return told


def _asked(found: Simulated) -> dict[str, Any]:
    """What the case asks for, in its own keys."""
    case, wanted = found.case, found.case.request
    keys = {"rotor": wanted.rotor.name, "inflow": wanted.inflow, "thrust_coefficient": wanted.thrust}
    keys |= {"advance_ratio": wanted.advance, "height": wanted.height, "slope_deg": wanted.slope_deg}
    return keys | {"tilt_deg": wanted.tilt_deg, "drag_area": wanted.drag_area, "duration": case.duration}
