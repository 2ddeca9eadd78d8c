import matplotlib.pyplot as plt
import numpy as np

import rotorjax as rj
from rotorjax.wake.solution import tip_vortices

wake = rj.solve(rj.free_wake(*rj.rotor("caradonna_tung"), None, rj.quick_settings())).found
figure, axes = plt.subplots(subplot_kw={"projection": "3d"}, figsize=(6, 5))
for blade, path in enumerate(tip_vortices(wake, 2)):
    axes.plot(*path.T, lw=2)
    axes.plot(*np.outer([0.1, 1.0], [(-1) ** blade, 0, 0]).T, "k", lw=4)
axes.set(xlabel="x/R, aft", ylabel="y/R, starboard", zlabel="z/R, up", box_aspect=(1, 1, 0.6))
axes.set(xticks=(-1, 0, 1), yticks=(-1, 0, 1), zticks=(-0.6, -0.3, 0))
axes.view_init(elev=18, azim=-60)
