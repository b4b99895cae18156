"""Parameter sets: all raw values of one device at one instant, and the file format ``hubside-set/1``.

The file is canonical JSON: keys sorted, one value a line, so that two sets read and diff well. The hash covers the
description's version, the device's identity and the raw values, nothing else: the same state has the same hash.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Final

from app.errors import SetFileError, UsageError
from app.model.address import Address, parse_address
from app.model.datatypes import Raw

FORMAT: Final = "hubside-set/1"


@dataclass(frozen=True, slots=True)
class Identity:
    """What the device says of itself (1000h, 1008h to 100Ah, 1018h); None where it did not answer."""

    device_type: int | None = None
    device_name: str | None = None
    hardware: str | None = None
    software: str | None = None
    vendor_id: int | None = None
    product_code: int | None = None
    revision: int | None = None
    serial: int | None = None


@dataclass(frozen=True, slots=True)
class Origin:
    """Where, when and by whom a set was made. ``time`` is ISO 8601, UTC."""

    turbine: str
    device: str
    node: int
    time: str
    person: str
    reason: str
    tool: str


@dataclass(frozen=True, slots=True)
class ParameterSet:
    """The raw values of one device; ``unread`` names every readable object that did not answer, and why.

    ``empty`` names those that hold no data, as an empty error history does: they are read, there is nothing in them.
    """

    description_id: str
    description_version: str
    identity: Identity
    origin: Origin
    values: Mapping[Address, Raw]
    unread: Mapping[Address, str] = field(default_factory=dict)
    empty: tuple[Address, ...] = ()

    @property
    def complete(self) -> bool:
        """True where every readable object was read."""
        return not self.unread

    @property
    def hash(self) -> str:
        """SHA-256 over description version, identity and raw values, in hexadecimal."""
        content = {
            "description": {"id": self.description_id, "version": self.description_version},
            "identity": asdict(self.identity),
            "values": {str(address): _to_json(raw) for address, raw in self.values.items()},
        }
        compact = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
        return hashlib.sha256(compact.encode()).hexdigest()


def dump_set(parameters: ParameterSet) -> str:
    """Text of a set file."""
    content = {
        "format": FORMAT,
        "hash": f"sha256:{parameters.hash}",
        "complete": parameters.complete,
        "description": {"id": parameters.description_id, "version": parameters.description_version},
        "empty": [str(address) for address in parameters.empty],
        "identity": asdict(parameters.identity),
        "origin": asdict(parameters.origin),
        "unread": {str(address): reason for address, reason in parameters.unread.items()},
        "values": {str(address): _to_json(raw) for address, raw in parameters.values.items()},
    }
    return json.dumps(content, sort_keys=True, indent=1, ensure_ascii=False) + "\n"


def load_set(text: str, file: str) -> ParameterSet:
    """Read a set file. Raises SetFileError with file, line and reason; a wrong hash is an error too."""
    try:
        content = json.loads(text)
    except json.JSONDecodeError as error:
        raise SetFileError(file=file, line=error.lineno, reason=f"no valid JSON: {error.msg}") from error
    if not isinstance(content, dict) or not str(content.get("format", "")).startswith("hubside-set/"):
        raise SetFileError(file=file, line=1, reason="no parameter set of Hubside")
    if content["format"] != FORMAT:
        raise SetFileError(
            file=file, line=_line(text, '"format"'), reason=f"format {content['format']}, this version reads {FORMAT}"
        )
    try:
        parameters = ParameterSet(
            description_id=content["description"]["id"],
            description_version=content["description"]["version"],
            identity=Identity(**content["identity"]),
            origin=Origin(**content["origin"]),
            values={_address(text, file, key): _from_json(raw) for key, raw in content["values"].items()},
            unread={_address(text, file, key): str(why) for key, why in content.get("unread", {}).items()},
            empty=tuple(_address(text, file, key) for key in content.get("empty", ())),
        )
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise SetFileError(file=file, line=1, reason=f"a part is missing or of another shape: {error}") from error
    if content.get("hash") != f"sha256:{parameters.hash}":
        raise SetFileError(
            file=file, line=_line(text, '"hash"'), reason="the hash does not fit the values: the file was changed"
        )
    return parameters


def _address(text: str, file: str, key: str) -> Address:
    try:
        return parse_address(key)
    except UsageError as error:
        reason = str(error.details["reason"])
        raise SetFileError(file=file, line=_line(text, json.dumps(key)), reason=reason) from error


def _line(text: str, piece: str) -> int:
    position = text.find(piece)
    return 1 if position < 0 else text.count("\n", 0, position) + 1


def _to_json(raw: Raw) -> Any:
    return {"hex": raw.hex()} if isinstance(raw, bytes) else raw


def _from_json(value: Any) -> Raw:
    if isinstance(value, dict):
        return bytes.fromhex(value["hex"])
    if isinstance(value, int | float | str) and not isinstance(value, bool):
        return value
    raise TypeError(f"{value!r} is no raw value")
