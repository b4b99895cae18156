"""Motors: plate data, and every parameter of a drive that the manual takes from a motor database.

OAT manual, sections 5.2 and 5.3: motor type, motor data, maximum and rated current, maximum speed and the parameter
sets of the current and the velocity controller. A motor holds their raw values. The mounting offset of the encoder
(6410h/2) is kept as it was read and marked: it belongs to one machine (class ``unit``) and is never put into another.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from enum import Enum
from typing import Any, Final

from app.errors import HubsideError, LimitError, MotorFieldError
from app.model.address import Address, parse_address
from app.model.checks import check_write
from app.model.description import Description, Entry, RestoreClass
from app.model.values import parse, quantity_of

DESCRIPTION_ID: Final = "oat-pmc"
INDICES: Final = (0x6402, 0x6410, 0x6073, 0x6076, 0x6080, 0x60F6, 0x60F9)
"""The objects that sections 5.2.1 and 5.3.1 take from the motor database."""
LONGEST_NAME: Final = 80
LONGEST_REMARKS: Final = 2000


class Source(Enum):
    """Where the values of a version come from; the value is the end of its text key ``motor.source.…``."""

    TYPED = "typed"
    DEVICE = "device"
    FILE = "file"
    EXAMPLE = "example"
    """Comes with the program and is invented: no such motor exists."""


@dataclass(frozen=True, slots=True)
class Plate:
    """What the type plate says; None or "" where it says nothing. Units are in the names (``rpm``: 1/min)."""

    power_kw: Decimal | None = None
    torque_nm: Decimal | None = None
    speed_rpm: Decimal | None = None
    current_a: Decimal | None = None
    voltage_v: Decimal | None = None
    pole_pairs: Decimal | None = None
    encoder: str = ""
    brake: str = ""
    temperature_sensor: str = ""


@dataclass(frozen=True, slots=True)
class PlateField:
    """One field of ``Plate``: a number of ``unit`` from ``minimum`` to ``maximum``, or a text where there are none.

    ``decimals`` is how many it may have. ``address``: the parameter that says the same, ``factor`` of its unit.
    """

    name: str
    unit: str = ""
    minimum: Decimal | None = None
    maximum: Decimal | None = None
    decimals: int = 0
    address: Address | None = None
    factor: int = 1

    @property
    def is_text(self) -> bool:
        """True where it holds words."""
        return self.maximum is None


def _number(name: str, unit: str, low: str, high: int, decimals: int, *same: Any) -> PlateField:
    return PlateField(name, unit, Decimal(low), Decimal(high), decimals, *same)


PLATE_FIELDS: Final = (
    _number("power_kw", "kW", "0.01", 1000, 2),
    _number("torque_nm", "Nm", "0.01", 100_000, 2),
    _number("speed_rpm", "1/min", "1", 65_535, 0, Address(0x6410, 4)),
    _number("current_a", "A", "0.01", 4000, 3, Address(0x6076), 1000),
    _number("voltage_v", "V", "1", 6000, 1, Address(0x6410, 3)),
    _number("pole_pairs", "", "1", 100, 0, Address(0x6410, 1)),
    PlateField("encoder"),
    PlateField("brake"),
    PlateField("temperature_sensor"),
)


@dataclass(frozen=True, slots=True)
class Draft:
    """What a person says of a motor: maker, type, plate, raw values of its parameters, remarks."""

    maker: str
    type: str
    plate: Plate = Plate()
    values: Mapping[Address, int] = field(default_factory=dict)
    remarks: str = ""


@dataclass(frozen=True, slots=True)
class Motor:
    """One version of a motor. ``origin`` names what the source was: a device's slug, a file; ``t_ns`` when it was made.

    ``version`` counts from 1; each change makes another one, made by ``person``.
    """

    id: str
    version: int
    draft: Draft
    source: Source
    origin: str
    t_ns: int
    person: str
    description_version: str
    deleted: bool = False

    @property
    def invented(self) -> bool:
        """True for examples: no such motor exists."""
        return self.source is Source.EXAMPLE

    @property
    def title(self) -> str:
        """Maker and type."""
        return f"{self.draft.maker} {self.draft.type}"


def entries_of(description: Description) -> Iterator[Entry]:
    """The parameters of a motor in the order of the manual: all objects of ``INDICES`` that can be set."""
    for index in INDICES:
        for entry in description:
            if entry.address.major == index and entry.access.writable:
                yield entry


def is_of_the_machine(entry: Entry) -> bool:
    """True for what belongs to one machine, and never goes from a motor into a device."""
    return entry.restore is not RestoreClass.COPY


def wanted_values(description: Description, values: Mapping[Address, int]) -> dict[Address, int]:
    """The values of a motor that may be put into a device."""
    return {
        entry.address: values[entry.address]
        for entry in entries_of(description)
        if entry.address in values and not is_of_the_machine(entry)
    }


def checked(description: Description, draft: Draft) -> Draft:
    """The draft with its texts trimmed, or the first reason why it is none.

    Raises MotorFieldError.
    """
    maker, kind = checked_name("maker", draft.maker), checked_name("type", draft.type)
    remarks = "\n".join(draft.remarks.strip().splitlines())
    if len(remarks) > LONGEST_REMARKS or not all(one.isprintable() or one in "\n\t" for one in remarks):
        raise flaw("remarks", "long", maximum=str(LONGEST_REMARKS))
    check_values(description, draft.values)
    return Draft(maker, kind, checked_plate(draft.plate), dict(sorted(draft.values.items())), remarks)


def checked_name(name: str, text: str) -> str:
    """Maker or type, with its blanks put in order. Raises MotorFieldError."""
    text = " ".join(text.split())
    if not text:
        raise flaw(name, "missing")
    if len(text) > LONGEST_NAME or not text.isprintable():
        raise flaw(name, "long", maximum=str(LONGEST_NAME))
    return text


def checked_plate(plate: Plate) -> Plate:
    """The plate with its texts trimmed. Raises MotorFieldError."""
    checked: dict[str, Any] = {}
    for one in PLATE_FIELDS:
        found = getattr(plate, one.name)
        if one.is_text:
            checked[one.name] = checked_name(one.name, found) if found.strip() else ""
        else:
            checked[one.name] = None if found is None else _checked_number(one, found)
    return Plate(**checked)


def _checked_number(one: PlateField, number: Decimal) -> Decimal:
    limits = {"minimum": str(one.minimum), "maximum": str(one.maximum), "unit": one.unit}
    if not number.is_finite() or not (one.minimum or 0) <= number <= (one.maximum or 0):
        raise flaw(one.name, "range", **limits)
    # A float of JSON or a spreadsheet has digits behind that nobody typed.
    rounded = round(number, one.decimals)
    if abs(rounded - number) > Decimal("1e-6"):
        raise flaw(one.name, "decimals", decimals=str(one.decimals))
    return _plain(rounded)


def _plain(number: Decimal) -> Decimal:
    """Without zeros behind, and never with an exponent: 5.50 is 5.5, and 1E+2 is 100."""
    return Decimal(f"{number.normalize():f}")


def check_values(description: Description, values: Mapping[Address, int]) -> None:
    """Type, limits and enumeration of every value, and that it is one of a motor's. Raises MotorFieldError."""
    known = {entry.address: entry for entry in entries_of(description)}
    for address, raw in values.items():
        if address not in known:
            raise flaw(address.short, "no_parameter")
        try:
            check_write(description, known[address], raw, values.get)
        except HubsideError as error:
            raise flaw_of(known[address], error) from error


def parse_value(description: Description, entry: Entry, text: str) -> int:
    """The raw value of what a person typed for a parameter. Raises MotorFieldError."""
    try:
        return int(parse(description, entry, text, lambda _address: None))
    except HubsideError as error:
        raise flaw_of(entry, error) from error


def flaw(name: str, what: str, **details: str) -> MotorFieldError:
    """Why a field does not fit; ``what`` is the end of the text key ``motor.flaw.…``."""
    named = {"named_key": f"motor.field.{name}"} if name.isidentifier() else {"named": name}
    return MotorFieldError(field=name, reason_key=f"motor.flaw.{what}", **named, **details)


def flaw_of(entry: Entry, error: HubsideError) -> MotorFieldError:
    """What the checks of a write say of a parameter, for one that is only kept."""
    details = {name: str(detail) for name, detail in error.details.items() if name not in ("address", "name", "reason")}
    details["named"] = f"{entry.address.short} {entry.title}"
    if isinstance(error, LimitError):
        return MotorFieldError(field=entry.address.short, reason_key="motor.flaw.range", **details)
    why = str(error.details.get("reason", error))
    return MotorFieldError(field=entry.address.short, reason_key="motor.flaw.misfit", why=why, **details)


def disagreements(description: Description, draft: Draft) -> list[tuple[PlateField, Address]]:
    """Fields of the plate whose parameter says another number."""
    return [
        (one, one.address)
        for one in PLATE_FIELDS
        if one.address is not None
        and (raw := draft.values.get(one.address)) is not None
        and (number := getattr(draft.plate, one.name)) is not None
        and _raw_of(description, one, number) != raw
    ]


def _raw_of(description: Description, one: PlateField, number: Decimal) -> int | None:
    if one.address is None:
        return None
    scale = quantity_of(description.entry(one.address), lambda _address: None).scale
    return int((number * one.factor / scale).to_integral_value())


# -- as JSON -----------------------------------------------------------------------


def dump_draft(draft: Draft) -> str:
    """A draft as canonical JSON, for the store."""
    content = {
        "maker": draft.maker,
        "type": draft.type,
        "plate": {one.name: _to_json(getattr(draft.plate, one.name)) for one in PLATE_FIELDS},
        "values": {address.short: raw for address, raw in draft.values.items()},
        "remarks": draft.remarks,
    }
    return json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False)


def load_draft(text: str) -> Draft:
    """What ``dump_draft`` wrote."""
    content = json.loads(text)
    plate = content["plate"]
    return Draft(
        content["maker"],
        content["type"],
        Plate(**{one.name: _from_json(one, plate[one.name]) for one in PLATE_FIELDS}),
        {parse_address(address): raw for address, raw in content["values"].items()},
        content["remarks"],
    )


def _to_json(found: Decimal | str | None) -> str | None:
    return str(found) if isinstance(found, Decimal) else found


def _from_json(one: PlateField, text: str | None) -> Any:
    return text if one.is_text or text is None else Decimal(text)
