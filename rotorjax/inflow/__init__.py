"""Inflow models that a rotor can be coupled with, all behind one interface: uniform, Pitt-Peters, finite state."""
