"""What DCF and CSV files of ours say beside the values, and what is made of files that say nothing of the kind.

A file of ours carries a *head*: hash, description, identity, origin, what was unread. With it the very set comes back;
a value that was changed since is an error, unless the reader asks for the values as they are. A *foreign* file has
values only: they become a set of the device that the reader names, taken at the time of reading.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from app.errors import SetFileError
from app.model.address import Address
from app.model.datatypes import Raw, encode_raw
from app.model.description import Description
from app.model.sets import FORMAT, Origin, ParameterSet, dump_set, identity_of, load_set

NOT_IN_FILE: Final = "not in the file"


@dataclass(frozen=True, slots=True)
class Taking:
    """How a file is taken: ``descriptions`` that are known, by id; the rest is for values without a head.

    ``origin`` tells whose they are (its node is 0 where only the file knows); ``description_id`` None: found out.
    ``as_values``: what the file says of itself does not count.
    """

    descriptions: Mapping[str, Description]
    origin: Origin | None = None
    description_id: str | None = None
    as_values: bool = False


@dataclass(frozen=True, slots=True)
class Value:
    """One value of a file, ``name`` as the file calls the object."""

    raw: Raw
    line: int
    name: str = ""


@dataclass(frozen=True, slots=True)
class Unknown:
    """An object of a file that is not in the set, and why (a text key)."""

    address: Address
    name: str
    line: int
    text_key: str


@dataclass(frozen=True, slots=True)
class Imported:
    """A set that was read; ``foreign`` where the file says nothing of itself, or was not to be asked."""

    parameters: ParameterSet
    unknown: tuple[Unknown, ...] = ()
    foreign: bool = False


def head_of(parameters: ParameterSet, others: Mapping[Address, Raw]) -> str:
    """The head as JSON on one line, ASCII only. ``others`` are values that the file cannot hold."""
    content = json.loads(dump_set(parameters))
    content["values"] = {key: raw for key, raw in content["values"].items() if key in {str(one) for one in others}}
    return json.dumps(content, sort_keys=True, separators=(",", ":"))


def with_head(head: str, values: Mapping[Address, Value], file: str, line: int) -> ParameterSet:
    """The set of a head and the values of the file. Raises SetFileError at ``line``: damaged, newer, or changed."""
    try:
        content: Any = json.loads(head)
        if content["format"] == FORMAT:
            whole = {str(address): _plain(value.raw) for address, value in values.items()}
            content["values"] = {**content["values"], **whole}
        text = json.dumps(content)
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise SetFileError(file=file, line=line, reason="what the file says of itself is damaged") from error
    try:
        return load_set(text, file)
    except SetFileError as error:
        raise SetFileError(file=file, line=line, reason=str(error.details["reason"])) from error


def without_head(
    values: Mapping[Address, Value], taking: Taking, file: str, node: int | None, named: str | None = None
) -> Imported:
    """A set of plain values; objects that the description does not have, or has otherwise, are named.

    ``named`` is the description that the file names. Raises SetFileError where no description fits, or none of the
    values does, or it is not known whose they are.
    """
    if taking.origin is None:
        raise SetFileError(file=file, line=1, reason="the file does not tell whose values these are: name the device")
    description = _description(values, taking, file, named)
    kept: dict[Address, Raw] = {}
    unknown = []
    for address, value in values.items():
        entry = description.entries.get(address)
        if entry is None:
            unknown.append(Unknown(address, value.name, value.line, "set.unknown.no_object"))
        elif not _fits(entry.type, value.raw):
            unknown.append(Unknown(address, value.name, value.line, "set.unknown.misfit"))
        else:
            kept[address] = value.raw
    if not kept:
        raise SetFileError(file=file, line=1, reason=f"none of its objects is one of {description.id}")
    missing = [entry.address for entry in description if entry.access.readable and entry.address not in kept]
    origin = taking.origin
    if not origin.node and node is not None:
        origin = replace(origin, node=node)
    parameters = ParameterSet(
        description.id,
        description.version,
        identity_of(kept),
        origin,
        kept,
        dict.fromkeys(missing, NOT_IN_FILE),
    )
    return Imported(parameters, tuple(unknown), True)


def _description(values: Mapping[Address, Value], taking: Taking, file: str, named: str | None) -> Description:
    """The one that is asked for, that the file names, or that has the most of its objects, but at least half."""
    wanted = taking.description_id or named
    if wanted is not None:
        if wanted not in taking.descriptions:
            raise SetFileError(file=file, line=1, reason=f"there is no description '{wanted}'")
        return taking.descriptions[wanted]
    shares = {name: _share(values, one) for name, one in taking.descriptions.items()}
    best = max(shares, key=lambda name: shares[name], default=None)
    if best is None or shares[best] * 2 < len(values):
        raise SetFileError(file=file, line=1, reason="it fits no device that is known: name its description")
    return taking.descriptions[best]


def _share(values: Mapping[Address, Value], description: Description) -> int:
    entries = description.entries
    return sum(address in entries and _fits(entries[address].type, value.raw) for address, value in values.items())


def _fits(data_type: Any, raw: Raw) -> bool:
    try:
        encode_raw(data_type, raw)
    except (ValueError, OverflowError):
        return False
    return True


def _plain(raw: Raw) -> Any:
    return {"hex": raw.hex()} if isinstance(raw, bytes) else raw
