"""The velocity-potential finite-state inflow model (VPBFSM) with ground effect."""
