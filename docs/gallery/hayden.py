import matplotlib.pyplot as plt

from rotorjax.calibration import hayden
from rotorjax.reference.published import cheeseman_bennett

data, _ = hayden.hayden_data((0.5, 0.75, 1.0, 1.5, 2.0, 3.0))
figure, axes = plt.subplots()
axes.plot(data.heights, data.targets, "k", label="Hayden, flight tests")
axes.plot(data.heights, hayden.inflow_ratio(data, *hayden.PARAMETERS.printed), "s--", label="VPBFSM")
axes.plot(data.heights, [cheeseman_bennett(float(h)) for h in data.heights], ":", label="Cheeseman and Bennett")
axes.set(xlabel="height of the hub, h/R", ylabel="mean inflow over that in free air, same thrust", ylim=(0, 1.05))
axes.legend()
