import matplotlib.pyplot as plt

import rotorjax as rj

uh60, hover = rj.rotor("uh60", collective_deg=18.0)
figure, axes = plt.subplots()
for h, colour in ((0.5, "C0"), (0.75, "C1"), (1.0, "C2"), (1.5, "C3"), (3.0, "C4")):
    near = rj.solve(rj.finite_state(uh60, hover, rj.plane(h)))
    axes.plot(near.r, near.inflow[0], color=colour, label=f"h = {h:g} R, $C_T$ = {near.CT:.4f}")
axes.set(xlabel="r/R", ylabel=r"inflow over $\Omega R$, positive down", ylim=(None, 0.09))
axes.legend()
