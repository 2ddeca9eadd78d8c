from rotorjax.api.applications import calibrate as calibrate
from rotorjax.api.applications import evaluate as evaluate
from rotorjax.api.applications import linearise as linearise
from rotorjax.api.applications import march as march
from rotorjax.api.applications import over_deck as over_deck
from rotorjax.api.applications import simulate as simulate
from rotorjax.api.applications import sweep as sweep
from rotorjax.api.applications import trim as trim
from rotorjax.api.models import finite_state as finite_state
from rotorjax.api.models import rotor as rotor
from rotorjax.api.solved import Solved as Solved
from rotorjax.api.solved import performance as performance
from rotorjax.api.solved import solve as solve
from rotorjax.api.solved import velocity as velocity
from rotorjax.errors import InputError as InputError
from rotorjax.ground import plane as plane
from rotorjax.linearisation.modes import modes as modes
from rotorjax.ode.export import save_mat as save_mat
from rotorjax.ode.export import to_control as to_control
from rotorjax.operating import OperatingPoint as OperatingPoint
from rotorjax.operating import operating_point as operating_point
from rotorjax.panels.shapes import box as box
from rotorjax.panels.shapes import slab as slab
from rotorjax.panels.shapes import terrain as terrain
from rotorjax.panels.shapes import wall as wall
from rotorjax.panels.stl import read_stl as read_stl
from rotorjax.potential.model import steady_state
from rotorjax.rotor.catalogue import names as names
from rotorjax.rotor.geometry import rotor as _rotor
from rotorjax.sweep.inflow_table import InflowTable as InflowTable
from rotorjax.sweep.inflow_table import inflow_table as inflow_table
from rotorjax.wake.model import free_wake as free_wake
from rotorjax.wake.settings import WakeSettings as WakeSettings
from rotorjax.wake.settings import flight_settings as flight_settings
from rotorjax.wake.settings import hover_settings as hover_settings
from rotorjax.wake.settings import quick_settings as quick_settings
from rotorjax.wake.several import several_wakes as several_wakes

__version__: str
make_rotor = _rotor
steady = steady_state
