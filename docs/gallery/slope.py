import rotorjax as rj

uh60, hover = rj.rotor("uh60", collective_deg=18.0)
figure = rj.solve(rj.finite_state(uh60, hover, rj.plane(1.0, 20.0))).plot()
