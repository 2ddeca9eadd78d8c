import matplotlib.pyplot as plt

import rotorjax as rj

speeds = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3)
trims = [rj.trim(*rj.rotor("uh60"), 0.00575, inflow="pitt-peters", advance=mu, drag_area=3.2).means for mu in speeds]
figure, axes = plt.subplots()
below = [0.0] * len(speeds)
for name, label in (("CP_induced", "induced"), ("CP_profile", "profile"), ("CP_parasite", "parasite")):
    above = [b + 1e4 * getattr(one, name) for b, one in zip(below, trims, strict=True)]
    axes.fill_between(speeds, below, above, alpha=0.7, label=label)
    below = above
axes.set(xlabel="advance ratio", ylabel="$10^4\\, C_P$", ylim=(0, None), title="Power of a trimmed UH-60")
axes.legend()
