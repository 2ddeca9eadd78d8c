import matplotlib.pyplot as plt
import numpy as np

import rotorjax as rj
from rotorjax.rotor.moving_blade import blade_sections
from rotorjax.trim.problem import outputs_at

found = rj.trim(*rj.rotor("uh60"), 0.00575, inflow="pitt-peters", advance=0.3, drag_area=3.2).trimmed
alpha = np.rad2deg(outputs_at(found.z, found.flight, found.p).alpha)  # nodes of a quarter turn, blades, stations
alpha = alpha.transpose(1, 0, 2).reshape(-1, alpha.shape[-1])
psi, r = 2 * np.pi / len(alpha) * np.arange(len(alpha) + 1), blade_sections(found.p.rotor).r
figure, axes = plt.subplots(subplot_kw={"projection": "polar", "theta_offset": -np.pi / 2})
drawn = axes.contourf(psi, r, np.vstack([alpha, alpha[:1]]).T, levels=np.arange(-6, 13, 1.5), extend="both")
figure.colorbar(drawn, label="angle of attack, deg; advance ratio 0.3, flying up the page")
