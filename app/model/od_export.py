"""Descriptions for others: a CSV table for spreadsheets and a JSON document for web clients and scripts."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from decimal import Decimal
from typing import Any, Final

from app.model.address import Address, Addressing
from app.model.axis_machine import StateMachine
from app.model.datatypes import Raw
from app.model.description import (
    Access,
    BitTable,
    Condition,
    Description,
    Entry,
    Enumeration,
    ErrorCode,
    Limit,
    LimitRef,
    LimitsRule,
    Quantity,
    QuantityRule,
    SaveCommand,
    TableRule,
    Variant,
    VariantValues,
)
from app.model.texts import load_texts

CSV_COLUMNS: Final = (
    "index",
    "sub",
    "name",
    "type",
    "access",
    "pdo",
    "default",
    "unit",
    "scale",
    "saved",
    "class",
)
JSON_SCHEMA: Final = 1


def to_csv(description: Description) -> str:
    """One row for every sub-index, sub 0 included, under the header ``CSV_COLUMNS``.

    ``index`` has four hexadecimal digits (of IND where the device has IND and PNU; ``sub`` is the PNU then), ``sub`` is
    decimal, ``default`` is the raw value (with node 0 where it depends on the node), ``scale`` a decimal factor.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(CSV_COLUMNS)
    writer.writerows(_csv_row(entry) for entry in description)
    return out.getvalue()


def _csv_row(entry: Entry) -> tuple[str, ...]:
    # The table knows four kinds of access; a constant is read-only to whoever reads the table.
    access = Access.RO if entry.access is Access.CONST else entry.access
    return (
        f"{entry.address.major:04X}",
        str(entry.address.minor),
        entry.name,
        entry.type.name,
        access.value,
        _yes(entry.pdo),
        _csv_default(entry.default),
        entry.quantity.unit,
        _plain(entry.quantity.scale),
        _yes(entry.saved),
        entry.restore.value,
    )


def _yes(flag: bool) -> str:
    return "yes" if flag else "no"


def _csv_default(raw: Raw | None) -> str:
    if raw is None:
        return ""
    return raw.hex().upper() if isinstance(raw, bytes) else str(raw)


def _plain(number: Decimal) -> str:
    """A decimal without exponent and without zeros at its end: 0.1, 1, 10."""
    return f"{number.normalize():f}"


def to_json(description: Description) -> str:
    """Everything of the description as canonical JSON: keys sorted, two blanks, a line feed at the end."""
    document = description_dict(description)
    return json.dumps(document, ensure_ascii=False, sort_keys=True, indent=2, allow_nan=False) + "\n"


def description_dict(description: Description) -> dict[str, Any]:
    """Everything of the description in plain JSON types, made for a web client.

    Every key is always there; what is not given is null. Addresses are texts (``6065``, ``3110:01``, ``12/221``), also
    as the values of references. Bytes are ``{"hex": "0A0B"}``. Texts for people are keys of the locale catalogue,
    except names of objects, which are English and are translated by the catalogue's ``name.<English name>``. The texts
    of an error's cause and of first aid are null where there are none; ``number`` fills their placeholder.
    """
    return {
        "schema": JSON_SCHEMA,
        "id": description.id,
        "version": description.version,
        "name": description.name,
        "vendor": description.vendor,
        "bus": description.bus.value,
        "addressing": description.addressing.value,
        "manual": description.manual,
        "match": {
            "device_type": description.match.device_type,
            "device_name": description.match.device_name,
            "vendor_id": description.match.vendor_id,
            "product_code": description.match.product_code,
        },
        "variants": list(description.variants),
        "variant_names": {one.id: one.name for one in description.variant_details.values()},
        "variant_matches": [_variant_match(one) for one in description.variant_details.values()],
        "sources": {source.id: source.title for source in description.sources.values()},
        "groups": [{"id": group, "text_key": f"group.{group}"} for group in description.groups],
        "bit_tables": {name: _bit_table(table) for name, table in description.bit_tables.items()},
        "enumerations": {name: _enumeration(table) for name, table in description.enumerations.items()},
        "errors": [_error_code(error) for error in description.errors.values()],
        "save": _commands(description.save),
        "load": _commands(description.load),
        "state_machine": _machine(description.state_machine),
        "entries": [entry_dict(entry) for entry in description],
    }


def _machine(machine: StateMachine | None) -> dict[str, Any] | None:
    """Null for a device whose states are those of CiA 402, and for one that is no axis."""
    if machine is None:
        return None
    return {
        "profile": machine.profile,
        "controlword": machine.controlword.short,
        "statusword": machine.statusword.short,
        "stop_word": machine.stop_word,
        "states": [{**asdict(state), "place": list(state.place)} for state in machine.states],
        "transitions": [asdict(transition) for transition in machine.transitions],
    }


def entry_dict(entry: Entry) -> dict[str, Any]:
    """One entry in plain JSON types, see ``description_dict``.

    ``decimals`` says how many decimals a scaled value has; ``bit_count`` and ``range`` are those of the data type.
    """
    return {
        "address": entry.address.short,
        "index": entry.address.major if entry.address.addressing is Addressing.OD else None,
        "sub": entry.address.minor if entry.address.addressing is Addressing.OD else None,
        "ind": entry.address.major if entry.address.addressing is Addressing.PKW else None,
        "pnu": entry.address.minor if entry.address.addressing is Addressing.PKW else None,
        "name": entry.name,
        "object_name": entry.object_name,
        "title": entry.title,
        "kind": entry.kind.value,
        "type": entry.type.name,
        "bit_count": entry.type.bits,
        "range": list(entry.type.range) if entry.type.range else None,
        "access": entry.access.value,
        "readable": entry.access.readable,
        "writable": entry.access.writable,
        "pdo": entry.pdo,
        "pdo_side": entry.pdo_side.value if entry.pdo_side else None,
        "default": _raw(entry.default),
        "node_id": entry.node_id,
        "saved": entry.saved,
        "save_category": entry.save_category,
        "group": entry.group,
        "section": entry.section,
        **_quantity(entry.quantity),
        "unit_from": _quantity_rule(entry.quantity_rule),
        "minimum": _limit(entry.minimum),
        "maximum": _limit(entry.maximum),
        "also": list(entry.also),
        "enumeration": entry.enumeration,
        "bits": entry.bits,
        "restore": entry.restore.value,
        "verify": entry.verify.value,
        "requires": [_condition(one) for one in entry.requires],
        "mirror": {"of": entry.mirror.of.short, "divisor": entry.mirror.divisor} if entry.mirror else None,
        "by_variant": {name: _variant(values) for name, values in entry.variants.items()},
        "note": entry.note,
        "inferred": entry.inferred,
        "unproven": sorted(fact.value for fact in entry.unproven),
        "origin": entry.origin,
        "motion": entry.motion,
        "timeout_s": entry.timeout_s,
        "hexadecimal": entry.hexadecimal,
        "ipv4": entry.ipv4,
        "enumeration_from": _table_rule(entry.enumeration_rule),
        "bits_from": _table_rule(entry.bits_rule),
        "limits_from": _limits_rule(entry.limits_rule),
        "step": entry.step,
        "only": list(entry.only),
        "signals": list(entry.signals),
        "tool_name": entry.tool_name,
    }


def _variant_match(variant: Variant) -> dict[str, Any]:
    """By what a device says of itself it is known to be this one."""
    match = variant.match
    named = {"id": variant.id, "name": variant.name}
    return named | {"device_name": match.device_name, "product_code": match.product_code}


def _condition(condition: Condition) -> dict[str, Any]:
    return {
        "address": condition.address.short,
        "values": list(condition.values),
        "writing": list(condition.writing),
    }


def _table_rule(rule: TableRule | None) -> dict[str, Any] | None:
    if rule is None:
        return None
    return {"address": rule.address.short, "choices": {str(value): name for value, name in rule.choices.items()}}


def _limits_rule(rule: LimitsRule | None) -> dict[str, Any] | None:
    if rule is None:
        return None
    choices = {
        str(value): {"minimum": _limit(low), "maximum": _limit(high)} for value, (low, high) in rule.choices.items()
    }
    return {"address": rule.address.short, "choices": choices}


def _bit_table(table: BitTable) -> list[dict[str, Any]]:
    return [
        {
            "bit": bit.bit,
            "last": bit.bit if bit.last is None else bit.last,
            "name": bit.name,
            "text_key": bit.text_key,
            "clamp": bit.clamp or None,
            "error_code": bit.error_code,
        }
        for bit in table.bits
    ]


def _enumeration(table: Enumeration) -> dict[str, Any]:
    values = [{"value": one.value, "name": one.name, "text_key": one.text_key} for one in table.values]
    return {"exclusive": table.exclusive, "values": values}


def _error_code(error: ErrorCode) -> dict[str, Any]:
    has = load_texts("en").has
    return {
        "code": error.code,
        "name": error.name,
        "text_key": error.text_key,
        "reaction": error.reaction or None,
        "cause_key": error.cause_key if has(error.cause_key) else None,
        "first_aid_key": error.first_aid_key if has(error.first_aid_key) else None,
        "number": error.number,
    }


def _commands(commands: Iterable[SaveCommand]) -> list[dict[str, Any]]:
    return [
        {
            "address": command.address.short,
            "signature": command.signature,
            "category": command.category,
            "timeout_s": command.timeout_s,
        }
        for command in commands
    ]


def _quantity(quantity: Quantity) -> dict[str, Any]:
    exponent = quantity.scale.normalize().as_tuple().exponent
    decimals = max(0, -exponent) if isinstance(exponent, int) else 0
    return {"unit": quantity.unit, "scale": _number(quantity.scale), "decimals": decimals}


def _quantity_rule(rule: QuantityRule | None) -> dict[str, Any] | None:
    if rule is None:
        return None
    choices: Mapping[str, Any] = {str(value): _quantity(quantity) for value, quantity in rule.choices.items()}
    return {"address": rule.address.short, "shaft": _address(rule.shaft), "choices": choices}


def _limit(limit: Limit | None) -> Any:
    if isinstance(limit, LimitRef):
        return {"address": limit.address.short, "factor": _number(limit.factor)}
    return None if limit is None else _number(limit)


def _variant(values: VariantValues) -> dict[str, Any]:
    return {
        "default": _raw(values.default),
        "minimum": _limit(values.minimum),
        "maximum": _limit(values.maximum),
    }


def _number(number: Decimal | int) -> int | float:
    """An integer where it is one, so that 1 stays 1 and 0.1 stays 0.1."""
    return int(number) if number == int(number) else float(number)


def _raw(raw: Raw | None) -> Any:
    return {"hex": raw.hex().upper()} if isinstance(raw, bytes) else raw


def _address(address: Address | None) -> str | None:
    return None if address is None else address.short
