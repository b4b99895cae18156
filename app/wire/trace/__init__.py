"""Frames with what they mean, one by one: rows, filters, a ring of the latest."""
