import rotorjax as rj
from rotorjax.linearisation.told import roots

found = {}
for advance in (0.05, 0.2, 0.35):
    level = rj.trim(*rj.rotor("uh60"), 0.00575, inflow="pitt-peters", advance=advance)
    found[advance] = rj.modes(rj.linearise(level, ["theta_0"], ["CT"], harmonics=None))
figure = roots(found)
