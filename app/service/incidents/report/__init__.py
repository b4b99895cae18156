"""The report of an incident: one HTML file that opens anywhere, with plots, values, words and the 3D scene."""
