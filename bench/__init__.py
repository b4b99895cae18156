"""Benchmarks: one file each, measured beside a peer in one run. ``python -m bench NAME`` runs one, ``all`` runs all.

A benchmark is a module with ``run(full: bool) -> Result``; modules that begin with an underscore are helpers.
"""
