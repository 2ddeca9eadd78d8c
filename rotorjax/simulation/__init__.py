"""Flights of the coupled rotor: a case file with histories of controls and hub motion, marched from a trim."""
