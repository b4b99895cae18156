"""Hubside: the service bench for turbine pitch drives."""

__version__ = "0.1.0"
