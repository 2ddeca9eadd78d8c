import matplotlib.pyplot as plt
import numpy as np

import rotorjax as rj

level = rj.trim(*rj.rotor("uh60"), 0.00575, inflow="pitt-peters", advance=0.15)
model = rj.linearise(level, ["theta_0", "theta_1s"], ["Z", "M"], order=15, time="seconds")
t = np.linspace(0, 1.5, 301)
figure, axes = plt.subplots(2, 2, sharex=True, figsize=(8, 4.4))
for (i, j), one in np.ndenumerate(axes):
    one.plot(t, np.deg2rad(1) * model.step(t)[:, i, j] / 1e3)
    one.set(title=f"{model.inputs[j]} + 1°" if i == 0 else "", ylabel=("Z, kN", "M, kN m")[i] if j == 0 else "")
    one.set(xlabel="time, s" if i == 1 else "")
