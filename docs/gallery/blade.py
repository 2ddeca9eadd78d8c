import matplotlib.pyplot as plt
import numpy as np

import rotorjax as rj
from rotorjax.rotor.geometry import chord, twist

figure, axes = plt.subplots(2, 1, sharex=True)
for name in ("uh60", "elliott_althoff", "caradonna_tung"):
    rotor, r = rj.rotor(name)[0], np.linspace(0.2, 1.0, 200)
    axes[0].plot(r, chord(rotor, r), label=rotor.name)
    axes[1].plot(r, np.rad2deg(twist(rotor, r)))
axes[0].set(ylabel="chord over R", ylim=(0, None), title="Rotors of the catalogue")
axes[1].set(xlabel="r/R", ylabel="built-in twist, deg")
axes[0].legend()
