"""Parameter sets: all raw values of one device at one instant, and the file format ``hubside-set/1``.

The file is canonical JSON: keys sorted, one value a line, so that two sets read and diff well. The hash covers the
description's version, the device's identity and the raw values, nothing else: the same state has the same hash.
What a set does not have (a nameplate, a work order) is left out, so that files of earlier versions keep text and hash.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from datetime import UTC, datetime, timedelta
from typing import Any, Final

from app.errors import SetFileError, UsageError
from app.model.address import Address, parse_address
from app.model.datatypes import Raw
from app.model.strict_json import JsonError, line_of, read_json

FORMAT: Final = "hubside-set/1"
MAX_NODE: Final = 0xFFFF
INTEGERS: Final = range(-(1 << 63), 1 << 64)
"""What the types of CANopen hold, UNSIGNED64 the largest."""
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_PARTS: Final = frozenset(
    ("format", "hash", "complete", "description", "empty", "identity", "origin", "unread", "values")
)


@dataclass(frozen=True, slots=True)
class Identity:
    """What the device says of itself (1000h, 1008h to 100Ah, 1018h); None where it did not answer.

    ``drive_serial`` is a serial number as text (4040h), where a device has one. ``nameplate`` is the serial number on
    its plate, typed by a person; None where nobody did.
    """

    device_type: int | None = None
    device_name: str | None = None
    hardware: str | None = None
    software: str | None = None
    vendor_id: int | None = None
    product_code: int | None = None
    revision: int | None = None
    serial: int | None = None
    nameplate: str | None = None
    drive_serial: str | None = None

    @property
    def mark(self) -> int | str | None:
        """The serial number that the device tells: 1018h, else that of the drive; 0 and an empty text are none."""
        return self.serial or self.drive_serial or None

    def has_other_serial(self, other: Identity) -> bool:
        """True where both tell a serial number of the same kind, and they differ."""
        pairs = ((self.serial, other.serial), (self.drive_serial, other.drive_serial))
        return any(None not in pair and pair[0] != pair[1] for pair in pairs)

    def has_serial_of(self, other: Identity) -> bool:
        """The same serial number, of no other maker and product as far as both are known. 0 is none (CiA 301)."""
        makers = ((self.vendor_id, other.vendor_id), (self.product_code, other.product_code))
        known_to_differ = any(None not in pair and pair[0] != pair[1] for pair in makers)
        return self.mark is not None and self.mark == other.mark and not known_to_differ

    def as_json(self) -> dict[str, Any]:
        """For files and hashes."""
        content = asdict(self)
        for name in ("nameplate", "drive_serial"):
            if content[name] is None:
                del content[name]
        return content


IDENTITY: Final = {
    "device_type": Address(0x1000),
    "device_name": Address(0x1008),
    "hardware": Address(0x1009),
    "software": Address(0x100A),
    "vendor_id": Address(0x1018, 1),
    "product_code": Address(0x1018, 2),
    "revision": Address(0x1018, 3),
    "serial": Address(0x1018, 4),
    "drive_serial": Address(0x4040),
}
"""Where a device says who it is: CiA 301, and the serial number of a drive of Nanotec."""


def identity_of(values: Mapping[Address, Raw], nameplate: str | None = None) -> Identity:
    """What the values of a device say of its identity; what is of another type than it should be says nothing."""
    texts = ("device_name", "hardware", "software", "drive_serial")
    found = {name: values.get(address) for name, address in IDENTITY.items()}
    kept: dict[str, Any] = {name: raw for name, raw in found.items() if isinstance(raw, str if name in texts else int)}
    return Identity(**kept, nameplate=nameplate)


@dataclass(frozen=True, slots=True)
class Origin:
    """Where, when and by whom a set was made. ``time`` is ISO 8601 with its offset from UTC; we write UTC."""

    turbine: str
    device: str
    node: int
    time: str
    person: str
    reason: str
    tool: str
    work_order: str = ""

    @property
    def t_ns(self) -> int:
        """``time`` in ns since 1970. Raises ValueError where it is none."""
        moment = datetime.fromisoformat(self.time)
        if moment.tzinfo is None:
            raise ValueError("without an offset from UTC, Z or +01:00, it is another instant in every place")
        since = moment.astimezone(UTC) - _EPOCH
        return since // timedelta(microseconds=1) * 1000

    def as_json(self) -> dict[str, Any]:
        """For files."""
        content = asdict(self)
        if not self.work_order:
            del content["work_order"]
        return content


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
    def content(self) -> str:
        """What the hash covers, as canonical JSON on one line."""
        content = {
            "description": {"id": self.description_id, "version": self.description_version},
            "identity": self.identity.as_json(),
            "values": {str(address): _to_json(raw) for address, raw in self.values.items()},
        }
        return json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False)

    @property
    def hash(self) -> str:
        """SHA-256 over description version, identity and raw values, in hexadecimal."""
        return hashlib.sha256(self.content.encode()).hexdigest()


def iso_time(t_ns: int) -> str:
    """An instant as files have it: ISO 8601, UTC, no finer than microseconds."""
    moment = _EPOCH + timedelta(microseconds=t_ns // 1000)
    return moment.isoformat(timespec="microseconds" if moment.microsecond else "seconds").replace("+00:00", "Z")


def dump_set(parameters: ParameterSet) -> str:
    """Text of a set file."""
    content = {
        "format": FORMAT,
        "hash": f"sha256:{parameters.hash}",
        "complete": parameters.complete,
        "description": {"id": parameters.description_id, "version": parameters.description_version},
        "empty": [str(address) for address in parameters.empty],
        "identity": parameters.identity.as_json(),
        "origin": parameters.origin.as_json(),
        "unread": {str(address): reason for address, reason in parameters.unread.items()},
        "values": {str(address): _to_json(raw) for address, raw in parameters.values.items()},
    }
    return json.dumps(content, sort_keys=True, indent=1, ensure_ascii=False) + "\n"


def load_set(text: str, file: str) -> ParameterSet:
    """Read a set file. Raises SetFileError with file, line and reason; a wrong hash is an error too."""
    try:
        content = read_json(text)
        if not isinstance(content, dict) or not str(content.get("format", "")).startswith("hubside-set/"):
            raise JsonError(1, "no parameter set of Hubside")
        if content["format"] != FORMAT:
            reason = f"format {content['format']}, this version reads {FORMAT}"
            raise JsonError(line_of(text, '"format"'), reason)
        return _Reader(text).read(content)
    except JsonError as error:
        raise SetFileError(file=file, line=error.line, reason=error.reason) from error


def parse_content(text: str, origin: Origin) -> ParameterSet:
    """The set with that ``content``, as taken at ``origin``. Raises SetFileError where it is none."""
    try:
        content = read_json(text)
        reader = _Reader(text)
        name, version = reader.description(content)
        values = reader.values(content)
        return ParameterSet(name, version, reader.identity(content), origin, values)
    except (JsonError, KeyError, TypeError) as error:
        raise SetFileError(file="content", line=1, reason=str(error)) from error


class _Reader:
    """Takes a file's parts; everything must be there, of its shape, and nothing else. Raises JsonError."""

    def __init__(self, text: str) -> None:
        self._text = text

    def read(self, content: dict[str, Any]) -> ParameterSet:
        for key in content:
            if key not in _PARTS:
                raise JsonError(self._line(key), f"there is no part '{key}' in a set")
        name, version = self.description(content)
        unread = self._part(content, "unread", dict) if "unread" in content else {}
        parameters = ParameterSet(
            description_id=name,
            description_version=version,
            identity=self.identity(content),
            origin=self._origin(content),
            values=self.values(content),
            unread={self._address("unread", key): self._text_of("unread", key, why) for key, why in unread.items()},
            empty=self._empty(content),
        )
        self._check_integers(parameters)
        self._check(content, parameters)
        return parameters

    def description(self, content: dict[str, Any]) -> tuple[str, str]:
        part = self._part(content, "description", dict)
        name, version = (self._text_of("description", key, part.get(key)) for key in ("id", "version"))
        return name, version

    def identity(self, content: dict[str, Any]) -> Identity:
        part = self._part(content, "identity", dict)
        self._known("identity", part, Identity)
        texts = ("device_name", "hardware", "software", "nameplate", "drive_serial")
        for key, value in part.items():
            kind: type = str if key in texts else int
            if value is not None and (isinstance(value, bool) or not isinstance(value, kind)):
                raise JsonError(self._line("identity", key), f"{key} is of another shape")
        return Identity(**part)

    def values(self, content: dict[str, Any]) -> dict[Address, Raw]:
        part = self._part(content, "values", dict)
        return {self._address("values", key): self._raw(key, value) for key, value in part.items()}

    def _origin(self, content: dict[str, Any]) -> Origin:
        part = self._part(content, "origin", dict)
        self._known("origin", part, Origin)
        for one in fields(Origin):
            if one.name == "node":
                node = part.get("node")
                if isinstance(node, bool) or not isinstance(node, int) or not 0 <= node <= MAX_NODE:
                    raise JsonError(self._line("origin", "node"), f"node is no number from 0 to {MAX_NODE}")
            elif one.name in part or one.name != "work_order":
                self._text_of("origin", one.name, part.get(one.name))
        origin = Origin(**part)
        try:
            known = 0 <= origin.t_ns < 1 << 63
        except (ValueError, OverflowError) as error:
            raise JsonError(self._line("origin", "time"), f"'{origin.time}' is no time: {error}") from error
        if not known:
            raise JsonError(self._line("origin", "time"), f"'{origin.time}' is no time from 1970 to 2262")
        return origin

    def _empty(self, content: dict[str, Any]) -> tuple[Address, ...]:
        part = self._part(content, "empty", list) if "empty" in content else []
        return tuple(self._address("empty", self._text_of("empty", str(key), key)) for key in part)

    def _check_integers(self, parameters: ParameterSet) -> None:
        for address, raw in parameters.values.items():
            if isinstance(raw, int) and raw not in INTEGERS:
                raise JsonError(
                    self._line("values", str(address)), f"{raw} is no raw value: it takes more than 64 bits"
                )

    def _check(self, content: dict[str, Any], parameters: ParameterSet) -> None:
        """What the parts say of each other."""
        doubled = set(parameters.values) & {*parameters.unread, *parameters.empty}
        if doubled:
            raise JsonError(
                self._line("values", str(min(doubled))), f"{min(doubled)} has a value and is said to have none"
            )
        try:
            fits = content.get("hash") == f"sha256:{parameters.hash}"
        except UnicodeEncodeError as error:
            raise JsonError(1, f"a text that is none: {error.reason}") from error
        if not fits:
            raise JsonError(self._line("hash"), "the hash does not fit the values: the file was changed")
        if content.get("complete", parameters.complete) is not parameters.complete:
            raise JsonError(self._line("complete"), "'complete' does not fit what is named as unread")

    def _part(self, content: dict[str, Any], key: str, kind: type) -> Any:
        if key not in content:
            raise JsonError(1, f"the part '{key}' is missing")
        if not isinstance(content[key], kind):
            raise JsonError(self._line(key), f"'{key}' is of another shape")
        return content[key]

    def _known(self, part: str, given: dict[str, Any], shape: type[Identity] | type[Origin]) -> None:
        names = {one.name for one in fields(shape)}
        for key in given:
            if key not in names:
                raise JsonError(self._line(part, key), f"there is no '{key}' in '{part}'")

    def _text_of(self, part: str, key: str, value: Any) -> str:
        if not isinstance(value, str):
            raise JsonError(self._line(part, key), f"'{key}' in '{part}' is missing or no text")
        if not value.isprintable() and any(0xD800 <= ord(one) < 0xE000 for one in value):
            raise JsonError(self._line(part, key), f"'{key}' in '{part}' is a text that is none: half a character")
        return value

    def _address(self, part: str, key: str) -> Address:
        try:
            address = parse_address(key)
        except UsageError as error:
            raise JsonError(self._line(part, key), str(error.details["reason"])) from error
        if str(address) != key:
            raise JsonError(self._line(part, key), f"'{key}' is written as {address}")
        return address

    def _raw(self, key: str, value: Any) -> Raw:
        if isinstance(value, dict) and list(value) == ["hex"] and isinstance(value["hex"], str):
            try:
                return bytes.fromhex(value["hex"])
            except ValueError as error:
                raise JsonError(self._line("values", key), f"'{value['hex']}' are no bytes") from error
        if isinstance(value, int | float | str) and not isinstance(value, bool):
            return value
        raise JsonError(self._line("values", key), f"{json.dumps(value)[:60]} is no raw value")

    def _line(self, *keys: str) -> int:
        return line_of(self._text, *(json.dumps(key, ensure_ascii=False) for key in keys))


def _to_json(raw: Raw) -> Any:
    return {"hex": raw.hex()} if isinstance(raw, bytes) else raw
