"""The oscilloscope: signals as they crossed the wire, caught around a trigger and kept."""
