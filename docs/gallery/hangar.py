import jax.numpy as jnp
import matplotlib.pyplot as plt

import rotorjax as rj

hangar = rj.box((1.3, -2.0, -1.0), (2.2, 2.0, 0.5), panel=0.3)
rotor = rj.rotor("knight_hefner_2", collective_deg=8.0)
wake = rj.solve(rj.free_wake(*rotor, rj.plane(1.0), rj.quick_settings(tip_core=0.05), hangar))
x, z = jnp.meshgrid(jnp.linspace(-2.4, 2.6, 81), jnp.linspace(-0.98, 1.0, 41))
u, _, w = jnp.moveaxis(rj.velocity(wake, jnp.stack([x, 0 * x, z], -1).reshape(-1, 3)).reshape(*x.shape, 3), -1, 0)
figure, axes = plt.subplots(figsize=(7, 3.2))
axes.streamplot(*(v.__array__() for v in (x, z, u, w)), color=jnp.hypot(u, w).__array__(), density=1.3, arrowsize=0.7)
axes.add_patch(plt.Rectangle((1.3, -1.0), 0.9, 1.5, color="#7a5c3e", zorder=3))
axes.plot([-1, 1], [0, 0], "k", lw=3)
axes.set(xlabel="x/R, aft", ylabel="z/R, up", aspect="equal", ylim=(-1, 1))
