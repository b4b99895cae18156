"""Reads recordings by columns: whole chunks of CAN frames as NumPy arrays, and objects decoded out of them.

``can_columns`` gives the frames, ``samples`` the values of chosen objects: exactly those that the decoders see.
"""

from app.recording.can_table import CanColumns
from app.recording.columns.frames import can_columns
from app.recording.columns.samples import Signal, samples
from app.recording.columns.values import SOURCES, Samples

__all__ = ["SOURCES", "CanColumns", "Samples", "Signal", "can_columns", "samples"]
