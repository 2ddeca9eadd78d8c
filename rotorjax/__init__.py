"""Differentiable rotor inflow near the ground: a finite-state model and a free vortex wake in JAX."""

__version__ = "0.1.0"
