import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt

import rotorjax as rj

uh60, hover = rj.rotor("uh60", collective_deg=10.0)
washout = jnp.linspace(0.0, 24.0, 25)


def merit(w):
    own = rj.make_rotor(
        "own", 4, 8.18, 0.15, 0.53, uh60.airfoil, twist=([0.15, 1.0], [0.6 * w, -0.25 * w]), tip_loss=0.97
    )
    return rj.performance(rj.solve(rj.finite_state(own, hover))).figure_of_merit


figure, axes = plt.subplots()
axes.plot(washout, jax.jit(jax.vmap(merit))(jnp.deg2rad(washout)))
axes.set(xlabel="washout from axis to tip, deg", ylabel="figure of merit", title="Plain blade, pitch 10° at 0.75 R")
