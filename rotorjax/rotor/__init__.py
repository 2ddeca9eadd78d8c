"""What a rotor is: geometry, airfoil tables, the catalogue and blade-element loads."""
