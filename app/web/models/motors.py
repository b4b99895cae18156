"""Types of the motor database."""

from __future__ import annotations

from decimal import Decimal
from typing import Annotated, Any, Literal

from pydantic import Base64Bytes, BaseModel, ConfigDict, Field, StrictInt, StrictStr

from app.model.address import parse_address
from app.model.motor import (
    LONGEST_NAME,
    LONGEST_REMARKS,
    PLATE_FIELDS,
    Draft,
    Motor,
    Plate,
    PlateField,
    disagreements,
)
from app.model.motor_diff import PlateRow, ValueRow
from app.service.motors import description
from app.store.motor_rows import Assigned

SourceName = Literal["typed", "device", "file", "example"]
RowStateName = Literal["different", "same", "missing", "unit"]
Number = Annotated[float, Field(allow_inf_nan=False)]
Words = Annotated[str, Field(max_length=LONGEST_NAME)]
Id = Annotated[str, Field(max_length=36)]
_PLATE: dict[str, Any] = {"power_kw": 5.5, "speed_rpm": 2920, "current_a": 11.3, "voltage_v": 400, "pole_pairs": 1}
_DRAFT: dict[str, Any] = {
    "maker": "Lorentz",
    "type": "PM 5.5-2",
    "plate": _PLATE,
    "values": {"6402": 7, "6410:03": 4000, "6076": 11_300},
    "remarks": "measured on the bench",
}


class PlateDoc(BaseModel):
    """What the type plate says; null or "" where it says nothing. Units are in the names."""

    model_config = ConfigDict(from_attributes=True, extra="forbid")

    power_kw: Number | None = None
    torque_nm: Number | None = None
    speed_rpm: Number | None = None
    current_a: Number | None = None
    voltage_v: Number | None = None
    pole_pairs: Number | None = None
    encoder: Words = ""
    brake: Words = ""
    temperature_sensor: Words = ""

    def plate(self) -> Plate:
        """As the model has it."""
        found: dict[str, Any] = self.model_dump()
        exact: dict[str, Any] = {
            name: Decimal(str(one)) if isinstance(one, float) else one for name, one in found.items()
        }
        return Plate(**exact)


class PlateFieldDoc(BaseModel):
    """One field of the plate: a number within limits, or words. ``address``: the parameter that says the same."""

    name: str
    text: bool
    unit: str
    minimum: float | None
    maximum: float | None
    decimals: int
    address: str | None

    @classmethod
    def of(cls, one: PlateField) -> PlateFieldDoc:
        """As the page gets it."""
        return cls(
            name=one.name,
            text=one.is_text,
            unit=one.unit,
            minimum=_float(one.minimum),
            maximum=_float(one.maximum),
            decimals=one.decimals,
            address=None if one.address is None else one.address.short,
        )


class MotorForm(BaseModel):
    """What a form of a motor is drawn from: the fields of the plate, and the description of its parameters alone."""

    plate: list[PlateFieldDoc]
    description: dict[str, Any]


class MotorDoc(BaseModel):
    """One version of a motor; ``values`` are raw, by address. ``origin``: a device's slug, or a file.

    ``disagreements``: fields of the plate whose parameter says another number.
    """

    id: str
    version: int
    maker: str
    type: str
    plate: PlateDoc
    values: dict[str, int]
    remarks: str
    source: SourceName
    origin: str
    t_ns: int
    person: str
    invented: bool
    deleted: bool
    disagreements: list[str]

    @classmethod
    def of(cls, motor: Motor) -> MotorDoc:
        """As the page gets it."""
        draft = motor.draft
        return cls(
            id=motor.id,
            version=motor.version,
            maker=draft.maker,
            type=draft.type,
            plate=PlateDoc.model_validate(draft.plate),
            values={address.short: raw for address, raw in draft.values.items()},
            remarks=draft.remarks,
            source=motor.source.value,
            origin=motor.origin,
            t_ns=motor.t_ns,
            person=motor.person,
            invented=motor.invented,
            deleted=motor.deleted,
            disagreements=[field.name for field, _address in disagreements(description(), draft)],
        )


class AssignedDoc(BaseModel):
    """Which motor a device drives, as somebody said or as it was put into the device."""

    model_config = ConfigDict(from_attributes=True)

    device: str
    motor_id: str
    version: int
    t_ns: int
    person: str

    @classmethod
    def of(cls, row: Assigned) -> AssignedDoc:
        """As the page gets it."""
        return cls.model_validate(row)


class MotorList(BaseModel):
    """The newest version of every motor, examples last, and which device drives which."""

    motors: list[MotorDoc]
    assigned: list[AssignedDoc]


class DraftIn(BaseModel):
    """A motor as a person has it; ``values`` are raw, by address."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [_DRAFT]})

    maker: Words
    type: Words
    plate: PlateDoc = PlateDoc()
    values: Annotated[dict[str, StrictInt], Field(max_length=200)] = {}
    remarks: Annotated[str, Field(max_length=LONGEST_REMARKS)] = ""

    def draft(self) -> Draft:
        """As the model has it. Raises UsageError for what is no address."""
        values = {parse_address(address): raw for address, raw in self.values.items()}
        return Draft(self.maker, self.type, self.plate.plate(), values, self.remarks)


class MotorChange(DraftIn):
    """Another version of a motor, made from version ``based_on``."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"based_on": 1, **_DRAFT}]})

    based_on: StrictInt


class MotorFromDevice(BaseModel):
    """What a device does not tell of its motor; the values are read from it."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={"examples": [{"maker": "Lorentz", "type": "PM 5.5-2", "plate": _PLATE, "remarks": ""}]},
    )

    maker: Words
    type: Words
    plate: PlateDoc = PlateDoc()
    remarks: Annotated[str, Field(max_length=LONGEST_REMARKS)] = ""

    def draft(self) -> Draft:
        """As the model has it, without values."""
        return Draft(self.maker, self.type, self.plate.plate(), {}, self.remarks)


class MotorFile(BaseModel):
    """A CSV file of motors: its name, and its bytes in base64."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={"examples": [{"name": "motors.csv", "data": "bWFrZXIsdHlwZQpMb3JlbnR6LFBNCg=="}]},
    )

    name: Annotated[StrictStr, Field(max_length=200)]
    data: Annotated[Base64Bytes, Field(max_length=4_000_000)]


class MotorsTaken(BaseModel):
    """What a file brought: motors that were not known, new versions, and those that say nothing new."""

    added: list[MotorDoc]
    changed: list[MotorDoc]
    unchanged: list[MotorDoc]


class Assignment(BaseModel):
    """``device`` (a slug) drives this version of the motor."""

    model_config = ConfigDict(
        extra="forbid", json_schema_extra={"examples": [{"device": "wtg-07/blade-2/pmc", "version": 1}]}
    )

    device: Annotated[str, Field(max_length=200)]
    version: StrictInt


class SideDoc(BaseModel):
    """One side of a comparison: a version of a motor, or what a device was last seen to hold (``motor`` null)."""

    device: str | None
    motor: MotorDoc | None


class PlateRowDoc(BaseModel):
    """One field of the plate on both sides."""

    field: str
    state: RowStateName
    left: float | str | None
    right: float | str | None

    @classmethod
    def of(cls, row: PlateRow) -> PlateRowDoc:
        """As the page gets it."""
        return cls(field=row.field.name, state=row.state.value, left=_plain(row.left), right=_plain(row.right))


class ValueRowDoc(BaseModel):
    """One parameter on both sides, raw."""

    address: str
    state: RowStateName
    left: int | None
    right: int | None

    @classmethod
    def of(cls, row: ValueRow) -> ValueRowDoc:
        """As the page gets it."""
        return cls(address=row.address.short, state=row.state.value, left=row.left, right=row.right)


class MotorComparison(BaseModel):
    """Two motors, or a motor and a device. The plate is compared between motors only."""

    left: SideDoc
    right: SideDoc
    plate: list[PlateRowDoc]
    values: list[ValueRowDoc]


def plate_fields() -> list[PlateFieldDoc]:
    """All fields of the plate."""
    return [PlateFieldDoc.of(one) for one in PLATE_FIELDS]


def _float(number: Decimal | None) -> float | None:
    return None if number is None else float(number)


def _plain(found: Decimal | str | None) -> float | str | None:
    return float(found) if isinstance(found, Decimal) else found
