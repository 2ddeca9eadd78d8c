import matplotlib.pyplot as plt
import numpy as np

import rotorjax as rj
from rotorjax.rotor.airfoil import lift_drag

table, alpha = rj.rotor("uh60")[0].airfoil, np.linspace(-10, 20, 301)
figure, axes = plt.subplots(1, 2, figsize=(8, 3.4))
for mach in (0.3, 0.5, 0.7, 0.8):
    cl, cd = lift_drag(table, np.deg2rad(alpha), np.full(alpha.shape, mach))
    axes[0].plot(alpha, cl, label=f"M = {mach:g}")
    axes[1].semilogy(alpha, cd)
axes[0].set(xlabel="angle of attack, deg", ylabel="$c_l$", title=table.name)
axes[1].set(xlabel="angle of attack, deg", ylabel="$c_d$")
axes[0].legend()
