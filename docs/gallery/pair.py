import rotorjax as rj

rotor, hover = rj.rotor("knight_hefner_2", collective_deg=8.0)
hubs = [(0, 0, 0), (0, 0, -0.3)]
pair = rj.solve(rj.several_wakes(rotor, hover, hubs, ground=rj.plane(1.5), settings=rj.quick_settings()))
figure = pair.plot()
