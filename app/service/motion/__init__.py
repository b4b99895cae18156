"""Motion of the axes: who may move them, what holds them back, and what stops them when nobody holds them.

This is not a safety function: the limit switches, the EFC chain and the drive itself are.
"""
