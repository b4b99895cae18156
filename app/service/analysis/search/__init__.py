"""Searching recordings for a signature: events in their order, and conditions of signals."""
