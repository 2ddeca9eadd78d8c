"""First-order systems: differences in age, Runge-Kutta, trajectories, periodic orbits. Knows no rotors."""
