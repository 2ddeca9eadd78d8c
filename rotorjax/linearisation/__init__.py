"""Linear models of the free wake about its periodic state, for control and stability."""
