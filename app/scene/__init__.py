"""The live state as a 3D scene."""
