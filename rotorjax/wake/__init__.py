"""The state-space free vortex wake."""
