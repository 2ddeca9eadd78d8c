import matplotlib.pyplot as plt
import numpy as np

import rotorjax as rj

figure, axes = plt.subplots(2, 1, sharex=True)
for advance in (0.0, 0.15, 0.3):
    level = rj.trim(*rj.rotor("uh60"), 0.00575, inflow="pitt-peters", advance=advance)
    gain = rj.linearise(level, ["theta_0"], ["CT"]).response(w := np.geomspace(0.02, 2, 200))[:, 0, 0]
    axes[0].loglog(w, abs(gain), label=f"μ = {advance}")
    axes[1].semilogx(w, np.rad2deg(np.unwrap(np.angle(gain))))
axes[0].set(ylabel="|δ$C_T$/δθ₀|, per rad")
axes[1].set(xlabel="frequency, per revolution", ylabel="phase, deg")
axes[0].legend()
