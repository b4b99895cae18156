"""What is wrong with bytes of PROFIBUS, and at which of them."""

from __future__ import annotations

from app.wire.records import Fault


class FormatError(ValueError):
    """Bytes that make no sense: ``fault`` at byte ``offset`` of what was given, or of the stream for a splitter."""

    def __init__(self, fault: Fault, offset: int, reason: str) -> None:
        super().__init__(f"byte {offset}: {reason}")
        self.fault = fault
        self.offset = offset
        self.reason = reason


def checked(value: int, least: int, most: int, name: str) -> int:
    """``value``, or ValueError where it is outside its limits: nothing is sent that no peer could read."""
    if not least <= value <= most:
        raise ValueError(f"{name} {value} is outside {least} to {most}")
    return value
