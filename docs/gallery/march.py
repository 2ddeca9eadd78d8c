from dataclasses import replace

import matplotlib.pyplot as plt

import rotorjax as rj

march = rj.march(rj.trim(*rj.rotor("uh60"), 0.00575, inflow="pitt-peters", advance=0.15), precision="double")
state, thrust, turn = march.start, [], march.steps_per_turn
for k in range(6 * turn):
    state = march.step(state, replace(march.inputs, theta_0=march.inputs.theta_0 + 0.0175 * (k > turn)))
    thrust.append(float(state.y.CT))
figure, axes = plt.subplots()
axes.plot([k / turn for k in range(6 * turn)], thrust)
axes.set(xlabel="revolutions", ylabel="$C_T$", title="A degree of collective after one revolution")
