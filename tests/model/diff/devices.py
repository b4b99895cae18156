"""Columns of a toy device with what comparisons must tell apart: a mask, a scale that depends, classes, a mirror."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from decimal import Decimal

from app.model.address import Address
from app.model.datatypes import DataType, Raw
from app.model.description import (
    Access,
    Bit,
    BitTable,
    Description,
    Entry,
    Enumeration,
    EnumValue,
    Kind,
    Mirror,
    Quantity,
    QuantityRule,
    RestoreClass,
)
from app.model.description_file import load_builtin
from app.model.diff.column import Column

LIMIT = Address(0x2000)
"""In 0.1 °C."""
MASK = Address(0x2001)
"""Bit 0 is the fan at X1.1, bits 4 and 5 are a mode."""
OFFSET = Address(0x2002)
"""Bound to the single unit."""
FEED, SHAFT = Address(0x2003), Address(0x2004)
POSITION = Address(0x2005)
"""In degrees by feed and shaft."""
NAME = Address(0x2006)
KIND = Address(0x2007)
ACCELERATION, MIRROR = Address(0x6083), Address(0x5083)
"""A value of 32 bits, and the object that shows its lower 16."""
ACTUAL = Address(0x6064)
"""A process value."""
PARAMETERS = (LIMIT, MASK, OFFSET, FEED, SHAFT, POSITION, NAME, KIND, ACCELERATION)


def entry(address: Address, kind: DataType = DataType.UNSIGNED16, **more: object) -> Entry:
    """A parameter that is copied, unless said otherwise."""
    usual = Entry(
        address=address,
        name=f"object {address.short}",
        object_name=f"object {address.short}",
        kind=Kind.VAR,
        type=kind,
        access=Access.RW,
        pdo=False,
        default=None,
        saved=True,
        group="all",
        section="",
        restore=RestoreClass.COPY,
    )
    return replace(usual, **more)  # type: ignore[arg-type]


def describe(version: str = "1.2.0", *changed: Entry) -> Description:
    """The toy; ``changed`` entries take the place of those at their addresses."""
    entries = [
        entry(LIMIT, DataType.INTEGER16, quantity=Quantity("°C", Decimal("0.1"))),
        entry(MASK, bits="outputs", group="io"),
        entry(OFFSET, DataType.INTEGER32, restore=RestoreClass.UNIT),
        entry(FEED, DataType.UNSIGNED32),
        entry(SHAFT, DataType.UNSIGNED32),
        entry(POSITION, DataType.INTEGER32, quantity=Quantity("°"), quantity_rule=QuantityRule(FEED, shaft=SHAFT)),
        entry(NAME, DataType.VISIBLE_STRING),
        entry(KIND, enumeration="kind"),
        entry(ACCELERATION, DataType.UNSIGNED32),
        entry(MIRROR, restore=RestoreClass.NEVER, mirror=Mirror(ACCELERATION)),
        entry(ACTUAL, DataType.INTEGER32, saved=False, restore=RestoreClass.NEVER, access=Access.RO),
        *changed,
    ]
    return replace(
        load_builtin("oat-pmc"),
        id="toy",
        version=version,
        entries={one.address: one for one in entries},
        groups=("io", "all"),
        bit_tables={
            "outputs": BitTable("outputs", (Bit(0, "fan", "bit.fan", clamp="X1.1"), Bit(4, "mode", "bit.mode", last=5)))
        },
        enumerations={"kind": Enumeration("kind", (EnumValue(1, "one", "enum.one"),))},
    )


TOY = describe()
VALUES: dict[Address, Raw] = {
    LIMIT: 500,
    MASK: 0x01,
    OFFSET: -17,
    FEED: 3600,
    SHAFT: 1,
    POSITION: 1000,
    NAME: "drive",
    KIND: 1,
    ACCELERATION: 70_000,
    MIRROR: 70_000 - 65_536,
    ACTUAL: 5,
}


def column(
    changes: Mapping[Address, Raw | None] | None = None, description: Description = TOY, **more: object
) -> Column:
    """The toy's values with ``changes``; None takes one out."""
    values = {**VALUES, **(changes or {})}
    kept = {address: raw for address, raw in values.items() if raw is not None}
    usual = Column("wtg-07/blade-1/toy", description, description.version, kept)
    return replace(usual, **more)  # type: ignore[arg-type]
