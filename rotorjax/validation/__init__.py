"""Validation of the free wake against measurements and theory: `rotorjax validate`."""
