"""Devices that answer: plant physics, device behaviour, one mount a bus."""
