import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt

import rotorjax as rj

uh60, hover = rj.rotor("uh60", collective_deg=18.0)
heights = jnp.linspace(0.5, 3.0, 40)
both = jax.jit(jax.vmap(jax.value_and_grad(lambda h: rj.solve(rj.finite_state(uh60, hover, rj.plane(h))).CT)))
figure, axes = plt.subplots(2, 1, sharex=True)
for one, values, name in zip(axes, both(heights), ("$C_T$", "d$C_T$/dh"), strict=True):
    one.plot(heights, values)
    one.set(ylabel=name, xlabel="height of the hub, h/R" if one is axes[1] else "")
