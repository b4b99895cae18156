"""Digital inputs and outputs of the controller: levels from outside, forced ones, and what they mean by mode. Pure.

Limit switches are active low (3.6). Numbers are those of the manual: inputs 1 to 18, outputs 1 to 6.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final

from app.twins.object_store import RefusedAccessError
from app.wire.sdo import Abort

INPUTS: Final = 18
OUTPUTS: Final = 6
_EXTERN: Final = 2


class Input(IntEnum):
    """Inputs with a meaning (4.2.1, 4.3.1)."""

    RELEASE = 1
    OPEN_LOOP = 3
    LIMIT_POSITIVE_2 = 6
    LIMIT_NEGATIVE_2 = 7
    AXIS_2 = 9
    FORWARD_1 = 10
    BACKWARD_1 = 11
    RAPID_1 = 12
    FORWARD_2 = 13
    BACKWARD_2 = 14
    RAPID_2 = 15
    LIMIT_POSITIVE_1 = 16
    LIMIT_NEGATIVE_1 = 17
    NONE = 18
    """It has no meaning, and nothing is wired to it."""


SINGLE: Final = Input.BACKWARD_2
"""With synchronous axes input 14 chooses single ones (4.3.1.4)."""
LIMITS: Final = (
    (Input.LIMIT_NEGATIVE_1, Input.LIMIT_POSITIVE_1),
    (Input.LIMIT_NEGATIVE_2, Input.LIMIT_POSITIVE_2),
)
"""Of axis 1 and 2: negative, positive."""
HANDS: Final = (
    (Input.FORWARD_1, Input.BACKWARD_1, Input.RAPID_1),
    (Input.FORWARD_2, Input.BACKWARD_2, Input.RAPID_2),
)


class Forced:
    """Inputs, or outputs, of which some have a value that was written (12/224, 12/225)."""

    def __init__(self, count: int) -> None:
        self._count = count
        self.values: dict[int, int] = {}
        """By number; what is not here is as outside."""

    def check(self, raw: int) -> None:
        """Raises RefusedAccessError where a number or a value does not exist."""
        number, value = raw >> 8, raw & 0xFF
        if not 1 <= number <= self._count or value > _EXTERN:
            raise RefusedAccessError(Abort.VALUE_RANGE)

    def write(self, raw: int) -> None:
        """Force one, or take it from outside again."""
        number, value = raw >> 8, raw & 0xFF
        if value == _EXTERN:
            self.values.pop(number, None)
        else:
            self.values[number] = value

    def answer(self, raw: int, levels: int) -> int:
        """A read: its request names the number, its answer has the state beside it. Raises RefusedAccessError."""
        number = raw >> 8
        if not 1 <= number <= self._count:
            raise RefusedAccessError(Abort.VALUE_RANGE)
        return number << 8 | self.apply(levels) >> (number - 1) & 1

    def apply(self, levels: int) -> int:
        """The states in force, bit 0 for number 1."""
        for number, value in self.values.items():
            levels = levels & ~(1 << number - 1) | value << number - 1
        return levels


def is_on(levels: int, number: int) -> bool:
    """State of one input."""
    return bool(levels >> (number - 1) & 1)


def level_of(*numbers: int) -> int:
    """The bits of inputs that are on."""
    return sum(1 << number - 1 for number in numbers)
