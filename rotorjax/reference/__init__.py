"""Measured and published data that models are compared with and fitted to, each with its source."""
