import matplotlib.pyplot as plt

import rotorjax as rj

figure, axes = plt.subplots(figsize=(7, 4.4))
for advance, mark in ((0.05, "o"), (0.2, "s"), (0.35, "^")):
    level = rj.trim(*rj.rotor("uh60"), 0.00575, inflow="pitt-peters", advance=advance)
    for k, mode in enumerate(rj.modes(rj.linearise(level, ["theta_0"], ["CT"], harmonics=None))):
        axes.plot(mode.exponent.real, mode.exponent.imag, mark, color="C0", label=f"μ = {advance}" if k == 0 else None)
        if mark == "s" and mode.exponent.imag >= 0 and "differential" not in mode.name:
            axes.annotate(" " + mode.name, (mode.exponent.real, mode.exponent.imag), fontsize=8)
axes.set(xlabel="growth, per rad", ylabel="frequency, per revolution", ylim=(-0.1, None))
axes.legend()
