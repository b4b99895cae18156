"""The tables of a description that tell the state machine of an axis.

    [state_machine]
    profile = "dsp408"
    controlword = "0/37"
    statusword = "0/38"
    stop = 0x0000

    [[state]]
    name = "hold"
    bits = 0x000B
    powered = true
    place = [0, 3]

    [[transition]]
    name = "TR_3"
    from = "disabled"
    to = "hold"
    word = 0x0003
    command = "hold"

A transition without ``word`` is one that the device goes by itself; ``from = "*"`` is from any state.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, Final

from app.model.address import parse_address
from app.model.axis_machine import MachineState, StateMachine, Transition

_MACHINE_KEYS: Final = frozenset(("profile", "controlword", "statusword", "stop"))
_STATE_KEYS: Final = frozenset(("name", "bits", "mask", "powered", "runs", "fault", "place"))
_TRANSITION_KEYS: Final = frozenset(("name", "from", "to", "word", "command"))
_MASK: Final = 0x000F
ANY: Final = "*"


def machine_state(table: Mapping[str, Any], profile: str) -> MachineState:
    """Raises KeyError, TypeError, ValueError."""
    _require_known(table, _STATE_KEYS)
    name, (column, row) = str(table["name"]), table.get("place", (0, 0))
    return MachineState(
        name,
        f"{profile}_state.{name}",
        int(table["bits"]),
        int(table.get("mask", _MASK)),
        bool(table.get("powered", False)),
        bool(table.get("runs", False)),
        bool(table.get("fault", False)),
        (int(column), int(row)),
    )


def machine_transition(table: Mapping[str, Any], profile: str, states: Collection[MachineState]) -> Transition:
    """Raises KeyError, TypeError, ValueError, also where it leads from or to a state that is none."""
    _require_known(table, _TRANSITION_KEYS)
    names = {state.name for state in states}
    source, target = str(table["from"]), str(table["to"])
    for name in (source, target):
        if name not in names and not (name == ANY and name is source):
            raise ValueError(f"'{name}' is no state")
    word, command = table.get("word"), table.get("command")
    if (word is None) is not (command is None):
        raise ValueError("a transition has both word and command, or none of them")
    key = None if command is None else f"{profile}_command.{command}"
    return Transition(str(table["name"]), source, target, None if word is None else int(word), key)


def state_machine(
    head: Mapping[str, Any], profile: str, states: tuple[MachineState, ...], transitions: tuple[Transition, ...]
) -> StateMachine:
    """Raises UsageError (no address), KeyError, TypeError, ValueError, also where two states have the same bits."""
    _require_known(head, _MACHINE_KEYS)
    if not states or len({(one.bits, one.mask) for one in states}) < len(states):
        raise ValueError("states are missing, or two of them have the same bits")
    return StateMachine(
        profile,
        parse_address(str(head["controlword"])),
        parse_address(str(head["statusword"])),
        int(head["stop"]),
        states,
        transitions,
    )


def _require_known(table: Mapping[str, Any], known: Collection[str]) -> None:
    if unknown := table.keys() - set(known):
        raise ValueError(f"unknown key '{min(unknown)}'")
