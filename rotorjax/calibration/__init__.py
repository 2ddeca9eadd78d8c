"""Calibration by gradient: the finite-state model fitted to Hayden's ground effect and to the free wake."""
