"""Reads a device description (``od/*.toml``, schema 1) and says file, line and reason where it is wrong.

``load`` raises on the first error; ``problems`` lists all that can be found in one go.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any, Final, TypeVar

from app.errors import DescriptionError, UsageError
from app.model.address import Address, Addressing, parse_address
from app.model.axis_machine import StateMachine
from app.model.bundled import bundled_folder
from app.model.cylinders import Cylinders, read_cylinders
from app.model.datatypes import DataType, Raw, encode_raw
from app.model.description import (
    Access,
    Bit,
    BitTable,
    Bus,
    Condition,
    Description,
    Effect,
    Entry,
    Enumeration,
    EnumValue,
    ErrorCode,
    Fact,
    Kind,
    Limit,
    LimitRef,
    LimitsRule,
    Match,
    Mirror,
    PdoSide,
    Quantity,
    QuantityRule,
    RestoreClass,
    SaveCommand,
    Source,
    TableRule,
    Variant,
    VariantValues,
    Verify,
)
from app.model.description_machine import machine_state, machine_transition, state_machine
from app.model.toml_lines import TomlLines

SCHEMA: Final = 1
BUILTIN: Final = {
    "oat-pmm": "oat_pmm.toml",
    "oat-pmc": "oat_pmc.toml",
    "nanotec-pd4e": "nanotec_pd4e.toml",
    "wandfluh-ed2": "wandfluh_ed2.toml",
}

_TOP_KEYS: Final = frozenset(
    "schema id version name vendor bus addressing manual match save load variant source unit_rule group bit_table "
    "enumeration error object state_machine state transition cylinders".split()
)
_ERROR_KEYS: Final = frozenset(("code", "name", "reaction", "aid", "number", "origin"))
_OWN_KEYS: Final = frozenset(("index", "ind", "pnu", "kind", "subs", "elements"))
_ROW_KEYS: Final = frozenset(
    "name section group type access pdo default saved save_category unit scale hex unit_from min max enumeration bits "
    "restore verify requires mirror by_variant note inferred origin timeout_s node_id motion also counts ipv4 "
    "overwritten_by enumeration_from bits_from limits_from step only signals tool_name effects".split()
)
_NOT_INHERITED_BY_SUB0: Final = _ROW_KEYS - {"section", "group", "saved", "save_category", "inferred", "origin"}
_PDO_SIDES: Final = frozenset(side.value for side in PdoSide)
_E = TypeVar("_E", bound=Enum)


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong in a description file."""

    file: str
    line: int
    reason: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.reason}"


class _WrongError(Exception):
    """A problem found while one table is read; ``line`` is filled in by the caller that knows it."""


def load(path: Path) -> Description:
    """Read the description at ``path``. Raises DescriptionError with file, line and reason."""
    description, found = _read(path)
    if found or description is None:
        first = found[0]
        raise DescriptionError(file=first.file, line=first.line, reason=first.reason)
    return description


def problems(path: Path) -> list[Problem]:
    """Everything that is wrong in the file at ``path``, by line; empty where it is right."""
    return sorted(_read(path)[1], key=lambda problem: problem.line)


def builtin_folder() -> Path:
    """The folder of the descriptions."""
    return bundled_folder("od", "od")


@cache
def load_builtin(description_id: str) -> Description:
    """One of our own descriptions by its id. Raises UsageError where there is none."""
    if description_id not in BUILTIN:
        raise UsageError(reason=f"no description '{description_id}' (there are: {', '.join(BUILTIN)})")
    return load(builtin_folder() / BUILTIN[description_id])


def _read(path: Path) -> tuple[Description | None, list[Problem]]:
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        return None, [Problem(str(path), 0, f"cannot be read: {error}")]
    try:
        data = tomllib.loads(text, parse_float=Decimal)
    except tomllib.TOMLDecodeError as error:
        line = getattr(error, "lineno", None) or TomlLines.line_of_error(str(error))
        return None, [Problem(str(path), line, f"no valid TOML: {error}")]
    reader = _Reader(str(path), data, TomlLines(text))
    return reader.description(), reader.problems


class _Reader:
    """Turns the parsed tables into a Description, collecting problems with their lines."""

    def __init__(self, file: str, data: Mapping[str, Any], lines: TomlLines) -> None:
        self._file = file
        self._data = data
        self._lines = lines
        self.problems: list[Problem] = []
        self._addressing = Addressing.OD
        self._unit_rules: Mapping[str, QuantityRule] = {}

    def _say(self, line: int, reason: str) -> None:
        self.problems.append(Problem(self._file, line, reason))

    def description(self) -> Description | None:
        """The whole file; None where its head is unusable."""
        data = self._data
        if data.get("schema") != SCHEMA:
            self._say(self._lines.key("schema"), f"schema is {data.get('schema')!r}, this version reads {SCHEMA}")
            return None
        for key in data.keys() - _TOP_KEYS:
            self._say(self._lines.key(key), f"unknown key '{key}'")
        try:
            self._addressing = _enum(Addressing, data.get("addressing", "od"), "addressing")
            bus = _enum(Bus, data.get("bus"), "bus")
            head = {key: _text(data, key) for key in ("id", "version", "name", "vendor", "manual")}
        except _WrongError as error:
            self._say(1, str(error))
            return None
        self._unit_rules = dict(self._tables("unit_rule", _named_rule))
        description = Description(
            **head,
            bus=bus,
            addressing=self._addressing,
            match=Match(**data.get("match", {})),
            entries=self._entries(),
            groups=tuple(str(group.get("id")) for group in data.get("group", ())),
            bit_tables={table.id: table for table in self._tables("bit_table", _bit_table)},
            enumerations={table.id: table for table in self._tables("enumeration", _enumeration)},
            errors={code.code: code for code in self._tables("error", _error_code)},
            save=tuple(self._tables("save", _save_command)),
            load=tuple(self._tables("load", _save_command)),
            variants=tuple(str(variant.get("id")) for variant in data.get("variant", ())),
            variant_details={one.id: one for one in self._tables("variant", _variant_detail)},
            sources={one.id: one for one in self._tables("source", _source)},
            cylinders=self._cylinders(),
            state_machine=self._state_machine(),
        )
        self._cross_check(description)
        return description

    def _tables(self, key: str, read: Any) -> Iterator[Any]:
        for number, table in enumerate(self._data.get(key, ())):
            try:
                yield read(table)
            except (_WrongError, UsageError, KeyError, TypeError, ValueError) as error:
                self._say(self._lines.table(key, number), f"[[{key}]]: {_reason(error)}")

    def _cylinders(self) -> Cylinders | None:
        if "cylinders" not in self._data:
            return None
        try:
            return read_cylinders(self._data["cylinders"])
        except (UsageError, KeyError, TypeError, ValueError) as error:
            self._say(self._lines.key("cylinders"), f"[cylinders]: {_reason(error)}")
            return None

    def _state_machine(self) -> StateMachine | None:
        head = self._data.get("state_machine")
        if head is None:
            return None
        profile = str(head.get("profile"))
        states = tuple(self._tables("state", lambda table: machine_state(table, profile)))
        transitions = tuple(self._tables("transition", lambda table: machine_transition(table, profile, states)))
        try:
            return state_machine(head, profile, states, transitions)
        except (UsageError, KeyError, TypeError, ValueError) as error:
            self._say(self._lines.key("state_machine"), f"[state_machine]: {_reason(error)}")
            return None

    def _entries(self) -> dict[Address, Entry]:
        found: dict[Address, Entry] = {}
        for number, table in enumerate(self._data.get("object", ())):
            line = self._lines.table("object", number)
            try:
                rows = list(self._rows(table, number, line))
            except (_WrongError, UsageError, KeyError, TypeError, ValueError) as error:
                self._say(line, f"[[object]]: {_reason(error)}")
                continue
            for entry in rows:
                if entry.address in found:
                    first = found[entry.address].line
                    self._say(entry.line, f"{entry.address.short} stands twice (first in line {first})")
                found[entry.address] = entry
        return dict(sorted(found.items()))

    def _rows(self, table: Mapping[str, Any], number: int, line: int) -> Iterator[Entry]:
        for key in table.keys() - _ROW_KEYS - _OWN_KEYS:
            self._say(self._lines.key_in("object", number, key), f"unknown key '{key}'")
        kind = _enum(Kind, table.get("kind", "var"), "kind")
        inherited = {key: value for key, value in table.items() if key in _ROW_KEYS}
        if self._addressing is Addressing.PKW:
            address = Address(_int(table, "ind"), _int(table, "pnu"), Addressing.PKW)
            yield self._row(address, inherited, table, kind, line)
            return
        index = _int(table, "index")
        if kind is Kind.VAR:
            yield self._row(Address(index), inherited, table, kind, line)
            return
        subs = list(_subs(table))
        lines = self._lines.subs("object", number, len(table.get("subs", ())))
        if not any(sub["sub"] == 0 for sub, _ in subs):
            subs.insert(0, ({"sub": 0}, None))
        highest = max(sub["sub"] for sub, _ in subs)
        for sub, position in subs:
            sub_line = lines[position] if position is not None else line
            for key in sub.keys() - _ROW_KEYS - {"sub"}:
                self._say(sub_line, f"unknown key '{key}'")
            row = _sub_zero(inherited, sub, highest) if sub["sub"] == 0 else inherited | sub
            try:
                yield self._row(Address(index, sub["sub"]), row, table, kind, sub_line)
            except (_WrongError, UsageError, KeyError, TypeError, ValueError) as error:
                self._say(sub_line, f"{index:04X}:{sub['sub']:02X}: {_reason(error)}")

    def _row(self, address: Address, row: Mapping[str, Any], table: Mapping[str, Any], kind: Kind, line: int) -> Entry:
        data_type = _enum(DataType, row.get("type"), "type", by_name=True)
        default = row.get("default")
        if default is not None:
            default = _raw(default)
            try:
                encode_raw(data_type, default)
            except ValueError as error:
                raise _WrongError(f"default {default!r} does not fit {data_type.name}: {error}") from error
        note = row.get("note")
        timeout = row.get("timeout_s")
        return Entry(
            address=address,
            name=_text(row, "name"),
            object_name=_text(table, "name"),
            kind=kind,
            type=data_type,
            access=_enum(Access, row.get("access"), "access"),
            pdo=row.get("pdo") in _PDO_SIDES or _bool(row, "pdo"),
            default=default,
            saved=_bool(row, "saved"),
            group=_text(row, "group"),
            section=_text(row, "section"),
            quantity=_quantity(row),
            quantity_rule=self._rule(row.get("unit_from")),
            minimum=_limit(row.get("min")),
            maximum=_limit(row.get("max")),
            also=tuple(row.get("also", ())),
            enumeration=row.get("enumeration"),
            bits=row.get("bits"),
            restore=_enum(RestoreClass, row.get("restore", "never"), "restore"),
            verify=_enum(Verify, row.get("verify", "equal"), "verify"),
            save_category=row.get("save_category"),
            requires=tuple(
                Condition(parse_address(one["address"]), tuple(one["values"]), tuple(one.get("writing", ())))
                for one in row.get("requires", ())
            ),
            mirror=_mirror(row.get("mirror")),
            variants={name: _variant(values) for name, values in row.get("by_variant", {}).items()},
            note=f"note.{self._data['id']}.{note}" if note else None,
            inferred=bool(row.get("inferred")),
            unproven=_unproven(row.get("inferred", False)),
            origin=_text(row, "origin") if "origin" in row else None,
            pdo_side=PdoSide(row["pdo"]) if row.get("pdo") in _PDO_SIDES else None,
            timeout_s=None if timeout is None else float(timeout),
            hexadecimal=_bool(row, "hex"),
            ipv4=_bool(row, "ipv4"),
            node_id=_bool(row, "node_id"),
            motion=_bool(row, "motion"),
            counts=_bool(row, "counts"),
            overwritten_by=parse_address(row["overwritten_by"]) if "overwritten_by" in row else None,
            enumeration_rule=_table_rule(row.get("enumeration_from")),
            bits_rule=_table_rule(row.get("bits_from")),
            limits_rule=_limits_rule(row.get("limits_from")),
            step=_step(row),
            only=tuple(row.get("only", ())),
            signals=tuple(row.get("signals", ())),
            tool_name=_text(row, "tool_name") if "tool_name" in row else None,
            effects=tuple(
                Effect(parse_address(one["address"]), _int(one, "value"), tuple(one["writing"]))
                for one in row.get("effects", ())
            ),
            line=line,
        )

    def _rule(self, value: Mapping[str, Any] | str | None) -> QuantityRule | None:
        """``unit_from``: a rule of its own, or the name of one that several objects share."""
        if not isinstance(value, str):
            return _quantity_rule(value)
        if value not in self._unit_rules:
            raise _WrongError(f"unit rule '{value}' does not exist")
        return self._unit_rules[value]

    def _cross_check(self, description: Description) -> None:
        machine = description.state_machine
        for address in () if machine is None else (machine.controlword, machine.statusword):
            if address not in description.entries:
                self._say(self._lines.key("state_machine"), f"{address.short} of the state machine is no object")
        for entry in description:
            for reason in _contradictions(description, entry):
                self._say(entry.line, f"{entry.address.short}: {reason}")
        for key, commands in (("save", description.save), ("load", description.load)):
            for number, command in enumerate(commands):
                if command.address not in description.entries:
                    self._say(self._lines.table(key, number), f"{key} address {command.address} is no object")
        for address in () if description.cylinders is None else description.cylinders.references():
            if address not in description.entries:
                self._say(self._lines.key("cylinders"), f"[cylinders]: {address.short} is no object here")
        for key, origins in (
            ("bit_table", [table.origin for table in description.bit_tables.values()]),
            ("enumeration", [table.origin for table in description.enumerations.values()]),
            ("error", [code.origin for code in description.errors.values()]),
        ):
            for number, origin in enumerate(origins):
                if origin is not None and origin not in description.sources:
                    self._say(self._lines.table(key, number), f"source '{origin}' does not exist")


def _contradictions(description: Description, entry: Entry) -> Iterator[str]:
    """What in one entry does not agree with the rest of the description."""
    if entry.bits is not None and entry.bits not in description.bit_tables:
        yield f"bit table '{entry.bits}' does not exist"
    if entry.enumeration is not None and entry.enumeration not in description.enumerations:
        yield f"enumeration '{entry.enumeration}' does not exist"
    for table in () if entry.enumeration_rule is None else entry.enumeration_rule.choices.values():
        if table not in description.enumerations:
            yield f"enumeration '{table}' does not exist"
    for table in () if entry.bits_rule is None else entry.bits_rule.choices.values():
        if table not in description.bit_tables:
            yield f"bit table '{table}' does not exist"
    if entry.group not in description.groups:
        yield f"group '{entry.group}' does not exist"
    if entry.origin is not None and entry.origin not in description.sources:
        yield f"source '{entry.origin}' does not exist"
    if unknown := entry.variants.keys() - set(description.variants):
        yield f"variant '{min(unknown)}' does not exist"
    for what, address in _references(entry):
        if address not in description.entries:
            yield f"{what} refers to {address.short}, which is no object here"
    if entry.access is not Access.RW and entry.access is not Access.WO and entry.restore in (RestoreClass.COPY,):
        yield f"restore class '{entry.restore.value}' on an object that cannot be written ({entry.access.value})"
    yield from _misfits(entry)
    low, high = entry.minimum, entry.maximum
    if isinstance(entry.default, int) and not entry.inferred and entry.default not in entry.also:
        if isinstance(low, int) and entry.default < low:
            yield f"default {entry.default} is below the minimum {low}"
        if isinstance(high, int) and entry.default > high:
            yield f"default {entry.default} is above the maximum {high}"
    if isinstance(low, int) and isinstance(high, int) and low > high:
        yield f"minimum {low} is above the maximum {high}"


def _misfits(entry: Entry) -> Iterator[str]:
    """Defaults of variants that their type cannot hold, and defaults that are none of the values allowed."""
    if isinstance(entry.default, int) and (
        entry.default % entry.step or (entry.only and entry.default not in entry.only)
    ):
        yield f"default {entry.default} is none of the values that step and only allow"
    for variant, values in entry.variants.items():
        if values.default is not None:
            try:
                encode_raw(entry.type, values.default)
            except ValueError as error:
                yield f"default {values.default!r} of variant '{variant}' does not fit {entry.type.name}: {error}"


def _references(entry: Entry) -> Iterator[tuple[str, Address]]:
    if entry.quantity_rule is not None:
        yield "unit_from", entry.quantity_rule.address
        if entry.quantity_rule.shaft is not None:
            yield "unit_from shaft", entry.quantity_rule.shaft
        for address in entry.quantity_rule.after:
            yield "unit_from after", address
    for what, limit in (("min", entry.minimum), ("max", entry.maximum)):
        if isinstance(limit, LimitRef):
            yield what, limit.address
    for key, rule in (
        ("enumeration_from", entry.enumeration_rule),
        ("bits_from", entry.bits_rule),
        ("limits_from", entry.limits_rule),
    ):
        if rule is not None:
            yield key, rule.address
    for condition in entry.requires:
        yield "requires", condition.address
    for effect in entry.effects:
        yield "effects", effect.address
    if entry.mirror is not None:
        yield "mirror", entry.mirror.of


def _subs(table: Mapping[str, Any]) -> Iterator[tuple[dict[str, Any], int | None]]:
    """The subs of an object with the position of their line in ``subs`` (None for ``elements``)."""
    elements = table.get("elements")
    if elements is not None:
        own = {key: value for key, value in elements.items() if key not in ("count", "first", "name")}
        first = int(elements.get("first", 1))
        for number in range(int(elements["count"])):
            yield own | {"sub": first + number, "name": elements["name"].replace("{n}", str(number + 1))}, None
    for position, sub in enumerate(table.get("subs", ())):
        if not isinstance(sub.get("sub"), int) or not 0 <= sub["sub"] <= 255:
            raise _WrongError(f"sub {sub.get('sub')!r} is no sub-index")
        yield dict(sub), position
    if elements is None and not table.get("subs"):
        raise _WrongError("an array or record needs subs or elements")


def _sub_zero(inherited: Mapping[str, Any], own: Mapping[str, Any], highest: int) -> dict[str, Any]:
    """Sub-index 0: the number of elements (CiA 301, 7.4.3); single keys of it may be overridden."""
    kept = {key: value for key, value in inherited.items() if key not in _NOT_INHERITED_BY_SUB0}
    implied = {"name": "number of elements", "type": "unsigned8", "access": "ro", "default": highest}
    return kept | implied | dict(own)


def _bit_table(table: Mapping[str, Any]) -> BitTable:
    name = _text(table, "id")
    bits = tuple(
        Bit(
            bit=_int(row, "bit"),
            name=_text(row, "name"),
            text_key=f"bit.{name}.{row['name']}",
            last=row.get("last"),
            clamp=row.get("clamp", ""),
            error_code=row.get("error"),
        )
        for row in table["bits"]
    )
    covered = 0
    for bit in bits:
        if covered & bit.mask:
            raise _WrongError(f"bit {bit.bit} of table '{name}' stands twice")
        covered |= bit.mask
    return BitTable(name, bits, table.get("origin"))


def _enumeration(table: Mapping[str, Any]) -> Enumeration:
    name = _text(table, "id")
    values = tuple(
        EnumValue(_int(row, "value"), _text(row, "name"), f"enum.{name}.{row['name']}") for row in table["values"]
    )
    numbers = [value.value for value in values]
    if len(set(numbers)) != len(numbers):
        raise _WrongError(f"a value of enumeration '{name}' stands twice")
    return Enumeration(name, values, bool(table.get("exclusive", True)), table.get("origin"))


def _error_code(table: Mapping[str, Any]) -> ErrorCode:
    if unknown := table.keys() - _ERROR_KEYS:
        raise _WrongError(f"unknown key '{min(unknown)}'")
    name = _text(table, "name")
    return ErrorCode(
        code=_int(table, "code"),
        name=name,
        text_key=f"error_code.{name}",
        reaction=str(table.get("reaction", "")),
        aid=_text(table, "aid") if "aid" in table else "",
        number=_int(table, "number") if "number" in table else None,
        origin=_text(table, "origin") if "origin" in table else None,
    )


def _save_command(table: Mapping[str, Any]) -> SaveCommand:
    return SaveCommand(
        parse_address(_text(table, "address")),
        _int(table, "signature"),
        table.get("category"),
        float(table.get("timeout_s", 10.0)),
    )


def _quantity(row: Mapping[str, Any]) -> Quantity:
    return Quantity(str(row.get("unit", "")), Decimal(str(row.get("scale", 1))))


def _named_rule(table: Mapping[str, Any]) -> tuple[str, QuantityRule]:
    rule = _quantity_rule(table)
    assert rule is not None  # there is a table
    return _text(table, "id"), rule


def _quantity_rule(row: Mapping[str, Any] | None) -> QuantityRule | None:
    if row is None:
        return None
    choices = {int(value, 0): _quantity(choice) for value, choice in row.get("choices", {}).items()}
    shaft = row.get("shaft")
    return QuantityRule(
        parse_address(row["address"]),
        choices,
        None if shaft is None else parse_address(shaft),
        tuple(map(parse_address, row.get("after", ()))),
    )


def _table_rule(row: Mapping[str, Any] | None) -> TableRule | None:
    if row is None:
        return None
    choices = {int(value, 0): str(table) for value, table in row["choices"].items()}
    return TableRule(parse_address(row["address"]), choices)


def _limits_rule(row: Mapping[str, Any] | None) -> LimitsRule | None:
    if row is None:
        return None
    choices = {
        int(value, 0): (_limit(limits.get("min")), _limit(limits.get("max")))
        for value, limits in row["choices"].items()
    }
    return LimitsRule(parse_address(row["address"]), choices)


def _step(row: Mapping[str, Any]) -> int:
    step = _int(row, "step") if "step" in row else 1
    if step < 1:
        raise _WrongError(f"step is {step}, not 1 or more")
    return step


def _limit(value: Any) -> Limit | None:
    if isinstance(value, Mapping):
        return LimitRef(parse_address(value["address"]), Decimal(str(value.get("factor", 1))))
    if value is None or (isinstance(value, int | Decimal) and not isinstance(value, bool)):
        return value
    raise _WrongError(f"limit {value!r} is neither a number nor a reference")


def _mirror(row: Mapping[str, Any] | None) -> Mirror | None:
    return None if row is None else Mirror(parse_address(row["of"]), int(row.get("divisor", 1)))


def _variant_detail(table: Mapping[str, Any]) -> Variant:
    name = _text(table, "id")
    return Variant(name, str(table.get("name", name)), Match(**table.get("match", {})))


def _source(table: Mapping[str, Any]) -> Source:
    return Source(_text(table, "id"), _text(table, "title"))


def _unproven(value: Any) -> frozenset[Fact]:
    """``inferred`` is true or false for the row, or the list of the facts that are not printed."""
    if isinstance(value, bool):
        return frozenset()
    if not isinstance(value, list):
        raise _WrongError(f"key 'inferred' is {value!r}, neither true nor false nor a list of facts")
    return frozenset(_enum(Fact, one, "inferred") for one in value)


def _variant(row: Mapping[str, Any]) -> VariantValues:
    default = row.get("default")
    return VariantValues(None if default is None else _raw(default), _limit(row.get("min")), _limit(row.get("max")))


def _raw(value: Any) -> Raw:
    if isinstance(value, Decimal):
        return float(value)
    if isinstance(value, int | str) and not isinstance(value, bool):
        return value
    raise _WrongError(f"{value!r} is no raw value")


def _enum(kind: type[_E], value: Any, key: str, by_name: bool = False) -> _E:
    try:
        return kind[str(value).upper()] if by_name else kind(value)
    except (KeyError, ValueError):
        allowed: Sequence[str] = [m.name.lower() if by_name else str(m.value) for m in kind]
        raise _WrongError(f"{key} is {value!r}, not one of: {', '.join(allowed)}") from None


def _text(row: Mapping[str, Any], key: str) -> str:
    value = row.get(key)
    if not isinstance(value, str) or not value:
        raise _WrongError(f"key '{key}' is missing or no text")
    return value


def _int(row: Mapping[str, Any], key: str) -> int:
    value = row.get(key)
    if not isinstance(value, int) or isinstance(value, bool):
        raise _WrongError(f"key '{key}' is missing or no integer")
    return value


def _bool(row: Mapping[str, Any], key: str) -> bool:
    value = row.get(key, False)
    if not isinstance(value, bool):
        raise _WrongError(f"key '{key}' is {value!r}, neither true nor false")
    return value


def _reason(error: Exception) -> str:
    if isinstance(error, KeyError):
        return f"key {error} is missing"
    if isinstance(error, UsageError):
        return str(error.details.get("reason", error))
    return str(error)
