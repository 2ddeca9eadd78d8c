import matplotlib.pyplot as plt

import rotorjax as rj
from rotorjax.commands.new import PACKAGE

data, _ = rj.over_deck(PACKAGE / "examples" / "deck" / "case.toml")
shown = {"height": "height over deck, R", "uniform": "mean inflow, ΩR", "cosine": "fore-and-aft inflow, ΩR"}
figure, axes = plt.subplots(3, 1, sharex=True, figsize=(7, 7))
for one, (name, label) in zip(axes, shown.items(), strict=True):
    one.plot(data.time, data[name], label="in motion")
    one.set_ylabel(label)
    if name != "height":
        one.plot(data.time, data[f"static_{name}"], "--", label="steady at each instant")
axes[1].legend()
axes[-1].set_xlabel("time, s")
