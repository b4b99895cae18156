"""The state machine of an axis as its description tells it: states by the statusword, transitions by the controlword.

A description with the controlword and statusword of CiA 402 has that machine without saying so; any other names the
objects, the bits of each state and what leads from one to the other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from app.model.address import Address
from app.model.axis_state import ENERGISED, AxisState

CIA402: Final = "cia402"


@dataclass(frozen=True, slots=True)
class MachineState:
    """A state: the bits of the statusword that tell it, of those in ``mask``.

    ``powered``: something may move the axis, a closed loop or an open valve. ``runs``: it follows what it is told.
    ``fault``: an error has brought it there. ``place`` is its column and row in a drawing.
    """

    name: str
    text_key: str
    bits: int
    mask: int
    powered: bool = False
    runs: bool = False
    fault: bool = False
    place: tuple[int, int] = (0, 0)


@dataclass(frozen=True, slots=True)
class Transition:
    """From ``source`` to ``target``; ``word`` is the controlword that leads there, None: the device goes by itself.

    ``command_key`` is the text key of what is commanded. ``source`` ``*`` is any state.
    """

    name: str
    source: str
    target: str
    word: int | None = None
    command_key: str | None = None


@dataclass(frozen=True, slots=True)
class StateMachine:
    """``stop_word`` is the controlword that brings the axis to rest at once, from wherever it is."""

    profile: str
    controlword: Address
    statusword: Address
    stop_word: int
    states: tuple[MachineState, ...]
    transitions: tuple[Transition, ...] = ()

    def state_of(self, statusword: int) -> MachineState | None:
        """The state that a statusword tells; None for bits that no state has."""
        return next((one for one in self.states if statusword & one.mask == one.bits), None)

    def runs(self, statusword: int) -> bool:
        """The axis follows what it is told."""
        state = self.state_of(statusword)
        return state is not None and state.runs

    def rests(self, statusword: int) -> bool:
        """The axis does not follow what it is told any more, by a state that is known."""
        state = self.state_of(statusword)
        return state is not None and not state.runs


def _cia402() -> StateMachine:
    faults = (AxisState.FAULT, AxisState.FAULT_REACTION_ACTIVE)
    return StateMachine(
        CIA402,
        Address(0x6040),
        Address(0x6041),
        0x010B,
        tuple(
            MachineState(
                one.name.lower(), one.text_key, one.value, one.mask,
                powered=one in ENERGISED, runs=one is AxisState.OPERATION_ENABLED, fault=one in faults,
            )
            for one in AxisState
        ),
    )  # fmt: skip


CIA_402: Final = _cia402()


def machine_of(entries: Mapping[Address, Any], own: StateMachine | None) -> StateMachine | None:
    """The machine of a device with these ``entries``: its ``own``, that of CiA 402, or None where it is no axis."""
    if own is not None:
        return own
    has = CIA_402.controlword in entries and CIA_402.statusword in entries
    return CIA_402 if has else None
