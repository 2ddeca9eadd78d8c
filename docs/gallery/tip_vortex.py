import matplotlib.pyplot as plt
import numpy as np

import rotorjax as rj

figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.4))
for ground, name in ((None, "free air"), (rj.plane(1.0), "h = 1 R")):
    wake = rj.solve(rj.free_wake(*rj.rotor("uh60", collective_deg=18.0), ground, rj.quick_settings())).found
    age, (x, y, z) = np.rad2deg(wake.tip_vortex_age), np.asarray(wake.tip_vortex[0]).T
    left.plot(age, np.hypot(x, y), label=name)
    right.plot(age, z)
left.set(xlabel="wake age, deg", ylabel="tip vortex r/R")
right.set(xlabel="wake age, deg", ylabel="tip vortex z/R")
left.legend()
