"""Trim: the controls and the periodic motion of a rotor in steady flight, found together."""
