import jax
import matplotlib.pyplot as plt
import numpy as np

import rotorjax as rj


def hover(height, collective_deg):
    told = rj.performance(rj.solve(rj.finite_state(*rj.rotor("uh60", collective_deg), rj.plane(height))))
    return told.thrust / 1e3, told.power / 1e3


heights, collectives = np.linspace(0.5, 2.5, 24), np.linspace(13.0, 20.0, 15)
thrust, power = jax.jit(jax.vmap(jax.vmap(hover, (0, None)), (None, 0)))(heights, collectives)
figure, axes = plt.subplots()
figure.colorbar(axes.contourf(heights, collectives, power, 14), label="power, kW")
axes.clabel(axes.contour(heights, collectives, thrust, 10, colors="white"), fmt="%.0f kN")
axes.set(xlabel="height of the hub, h/R", ylabel="collective, deg", title="A hover of the UH-60")
