from rotorjax.api.applications import calibrate as calibrate
from rotorjax.api.applications import linearise as linearise
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
from rotorjax.operating import OperatingPoint as OperatingPoint
from rotorjax.operating import operating_point as operating_point
from rotorjax.rotor.catalogue import names as names
from rotorjax.sweep.inflow_table import InflowTable as InflowTable
from rotorjax.sweep.inflow_table import inflow_table as inflow_table
from rotorjax.wake.model import free_wake as free_wake
from rotorjax.wake.settings import WakeSettings as WakeSettings
from rotorjax.wake.settings import flight_settings as flight_settings
from rotorjax.wake.settings import quick_settings as quick_settings

__version__: str
