"""A rotor over a heaving, pitching deck with an edge, at microseconds a step."""
