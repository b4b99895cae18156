"""Comparing devices and sets: where columns come from, what is compared, and how it is exported."""
