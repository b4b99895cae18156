"""The twin of a Wandfluh ED2, controller of two hydraulic axes: a slave on PROFIBUS-DP by the profile DSP-408.

``docs/twin-ed2.md`` tells what is simulated, what is assumed, and what is not there.
"""
