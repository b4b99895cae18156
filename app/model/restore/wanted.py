"""What a plan is asked for: the values that are wanted, what a person chose, and the state of the devices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from app.model.address import Address
from app.model.datatypes import Raw
from app.model.saving import Category
from app.model.station import Place


class Values(Protocol):
    """Raw values of one device. A ``ParameterSet`` is one."""

    @property
    def values(self) -> Mapping[Address, Raw]:
        """What the set holds."""

    @property
    def unread(self) -> Mapping[Address, str]:
        """What it does not hold although the device has it, and why."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """Values of one device that come from elsewhere than a set: a motor, or what stood there before a restore."""

    values: Mapping[Address, Raw]
    unread: Mapping[Address, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class DeviceState:
    """What a device does now. None where it is not known, or where the device has no axis.

    ``mode``: what the mode of operation display (6061h) shows. ``enabled``: the output stage drives the motor.
    """

    mode: int | None = None
    enabled: bool | None = None


@dataclass(frozen=True, slots=True)
class PlanOptions:
    """What a person chose.

    ``selected``: objects to restore, None for all. ``same_unit``: devices, by slug, that are proven to be the very ones
    that the set was taken from. ``expert``: factory objects may be written. ``restart``: restarts are agreed to.
    ``accepted``: ids of rules that an expert accepts to stay broken where they are broken already.
    ``returning``: the wanted values stood in these devices before (a rollback, or going on with a restore): nothing
    that is broken at the end forbids it. ``leave_modes``: the mode of operation, by slug, in which a device is left
    where it is not the present one, because a restore was cut off in homing mode. ``save``: devices that are saved,
    None for those that are written to; a rollback saves only where a save was begun. ``categories``: what is saved of
    these, by slug, all where it is not named. ``confirm``: a person confirms before anything is saved. ``network``:
    what decides at which address a device is found goes along.
    """

    selected: frozenset[Place] | None = None
    same_unit: Mapping[str, bool] = field(default_factory=dict)
    expert: bool = False
    restart: bool = False
    accepted: frozenset[str] = frozenset()
    returning: bool = False
    leave_modes: Mapping[str, int] = field(default_factory=dict)
    save: frozenset[str] | None = None
    categories: Mapping[str, tuple[Category, ...]] = field(default_factory=dict)
    confirm: bool = True
    network: bool = False
