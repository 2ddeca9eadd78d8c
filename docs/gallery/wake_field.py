import jax.numpy as jnp
import matplotlib.pyplot as plt

import rotorjax as rj

wake = rj.solve(rj.free_wake(*rj.rotor("uh60", collective_deg=18.0), rj.plane(1.0), rj.quick_settings()))
x, z = jnp.meshgrid(jnp.linspace(-2.5, 2.5, 81), jnp.linspace(-0.98, 0.6, 41))
u, _, w = rj.velocity(wake, jnp.stack([x, 0 * x, z], -1).reshape(-1, 3)).T.reshape(3, *x.shape)
figure, axes = plt.subplots(figsize=(7, 3.0))
x, z, u, w = (v.__array__() for v in (x, z, u, w))
axes.streamplot(x, z, u, w, color=(u**2 + w**2) ** 0.5, density=1.2, arrowsize=0.7)
axes.plot([-1, 1], [0, 0], "k", lw=3)
axes.set(xlabel="x/R, aft", ylabel="z/R, up", aspect="equal", ylim=(-1, 0.6))
