import matplotlib.pyplot as plt

import rotorjax as rj
from rotorjax.commands.new import PACKAGE

data, _ = rj.over_deck(PACKAGE / "examples" / "deck" / "case.toml")
figure, axes = plt.subplots(3, 1, sharex=True, figsize=(7, 5))
shown = ("height", "edge"), ("uniform", "static_uniform"), ("cosine", "static_cosine")
for one, names in zip(axes, shown, strict=True):
    for name in names:
        one.plot(data.time, data[name], "--" if "static" in name else "-", label=data[name].long_name)
    one.legend(fontsize=8)
    one.set_ylabel(data[names[0]].units)
axes[-1].set_xlabel("time, s")
