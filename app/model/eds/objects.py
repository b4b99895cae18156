"""Objects and sub-indices of an EDS: sections to entries of a description."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

from app.model.address import Address
from app.model.datatypes import DataType, Raw
from app.model.description import Access, Entry, Kind, Limit, PdoWay
from app.model.eds.compact_pdo import implicit_pdos
from app.model.eds.ini import Ini, Section, Value, Warnings, shorten
from app.model.eds.numbers import Parsed, bare, parse_int, parse_value
from app.model.eds.sections import Sections

MOST_ENTRIES: Final = 200_000
"""Sub-indices kept of one file: compact objects make millions of a few lines."""
_MOST_SUBS: Final = 254
_LONGEST_NAME: Final = 241


class Area(NamedTuple):
    """A range of indices (CiA 301, 7.4.1) that makes a group of the page."""

    first: int
    last: int
    group: str


AREAS: Final = (
    Area(0x1000, 0x1FFF, "area_communication"),
    Area(0x2000, 0x5FFF, "area_manufacturer"),
    Area(0x6000, 0x9FFF, "area_profile"),
    Area(0xA000, 0xAFFF, "area_network_variables"),
    Area(0xB000, 0xFFFF, "area_system"),
)


def area_of(index: int) -> Area:
    """The area of ``index``, which is 1000h or more."""
    return next(area for area in AREAS if area.first <= index <= area.last)


_KINDS: Final = {0x2: Kind.VAR, 0x5: Kind.VAR, 0x6: Kind.RECORD, 0x7: Kind.VAR, 0x8: Kind.ARRAY, 0x9: Kind.RECORD}
"""Object codes of CiA 301 (7.4.3): DOMAIN, DEFTYPE, DEFSTRUCT, VAR, ARRAY, RECORD."""
_OBJECT_CODE_DOMAIN: Final = 0x2
_ACCESS: Final = {
    "ro": Access.RO,
    "wo": Access.WO,
    "rw": Access.RW,
    "rwr": Access.RW,
    "rww": Access.RW,
    "const": Access.CONST,
}
_TYPES: Final = {data_type.value: data_type for data_type in DataType}


def _pdo_way(section: Section) -> PdoWay:
    value = section.get("AccessType")
    text = "" if value is None else bare(value.text).lower()
    return next((way for way in PdoWay if way.value == text), PdoWay.BOTH)


@dataclass(frozen=True, slots=True)
class _Object:
    """What the entries of one object have in common."""

    index: int
    name: str
    kind: Kind
    line: int


class ObjectReader:
    """Reads all objects into ``entries`` (in the order of their addresses) and ``values`` (of a DCF)."""

    def __init__(self, ini: Ini, sections: Sections, warnings: Warnings, node_id: int | None) -> None:
        self._ini = ini
        self._sections = sections
        self._warnings = warnings
        self._node_id = node_id
        self.entries: dict[Address, Entry] = {}
        self.values: dict[Address, Raw] = {}

    def read_all(self) -> None:
        """Read every object; what cannot be understood becomes a warning."""
        for index in self._sections.indices():
            if len(self.entries) > MOST_ENTRIES:
                self._warnings.add(0, "too_many_entries", most=MOST_ENTRIES)
                break
            for entry in self._object(index):
                self.entries[entry.address] = entry
        for entry in implicit_pdos(self._ini.section("DeviceInfo"), self.entries, self._warnings):
            self.entries[entry.address] = entry
        self.entries = dict(sorted(self.entries.items()))

    def _object(self, index: int) -> list[Entry]:
        section = self._sections.objects.get(index)
        subs = self._sections.subs.get(index, {})
        if section is None:
            first = next(iter(subs.values()))
            self._warnings.add(first.line, "sub_without_object", section=first.name)
            section = Section(f"{index:04X}", first.line)
            head = _Object(index, f"{index:04X}h", Kind.RECORD, first.line)
            entries = {}
        else:
            count = self._compact_count(section)
            head = self._head(index, section, bool(subs), bool(count))
            if head.kind is Kind.VAR:
                return [self._entry(Address(index), head.name, head, section)]
            entries = {entry.address.minor: entry for entry in self._compact(head, section, count)}
        self._check_sub_number(section, len(subs))
        entries |= {sub: self._sub(head, sub, subs[sub]) for sub in sorted(subs)}
        if entries and 0 not in entries:
            self._warnings.add(head.line, "sub_zero_missing", index=f"{index:04X}")
            entries[0] = self._sub_zero(head, max(entries))
        if not entries:
            self._warnings.add(head.line, "no_subs", index=f"{index:04X}")
        return list(entries.values())

    def _head(self, index: int, section: Section, has_subs: bool, compact: bool) -> _Object:
        """Name and kind of an object; the kind follows the sub-indices where the two do not agree."""
        code = self._int(section, "ObjectType")
        kind = Kind.VAR if code is None else _KINDS.get(code)
        if kind is None:
            self._warnings.add(section.line_of("ObjectType"), "object_type", section=section.name, code=code)
        if (has_subs or compact) and kind in (None, Kind.VAR):
            if kind is Kind.VAR:
                self._warnings.add(section.line, "var_with_subs", section=section.name)
            kind = Kind.ARRAY if compact else Kind.RECORD
        name = self._name(section, f"{index:04X}h")
        return _Object(index, name, kind or Kind.VAR, section.line)

    def _sub(self, head: _Object, sub: int, section: Section) -> Entry:
        name = self._name(section, "number of elements" if sub == 0 else str(sub))
        return self._entry(Address(head.index, sub), name, head, section)

    def _sub_zero(self, head: _Object, highest: int) -> Entry:
        """The number of elements that every array and record has (CiA 301, 7.4.3), where the file leaves it out."""
        return Entry(
            address=Address(head.index, 0),
            name="number of elements",
            object_name=head.name,
            kind=head.kind,
            type=DataType.UNSIGNED8,
            access=Access.RO,
            pdo=False,
            default=highest,
            saved=False,
            group=area_of(head.index).group,
            section="",
            inferred=True,
            line=head.line,
        )

    # Compact storage (CiA 306, 4.6.3.5): one section stands for all elements of an array.

    def _compact_count(self, section: Section) -> int:
        count = self._int(section, "CompactSubObj") or 0
        if not 0 <= count <= _MOST_SUBS:
            self._warnings.add(section.line_of("CompactSubObj"), "compact_count", section=section.name, count=count)
        return max(0, min(count, _MOST_SUBS))

    def _compact(self, head: _Object, section: Section, count: int) -> Iterator[Entry]:
        if not count:
            return
        yield replace(self._sub_zero(head, count), inferred=False)
        pattern = self._entry(Address(head.index, 1), head.name, head, section)
        names = self._numbered(self._sections.names.get(head.index), count)
        for sub in range(1, count + 1):
            name = shorten(names[sub].text, _LONGEST_NAME) if sub in names else f"{head.name}{sub}"
            yield replace(pattern, address=Address(head.index, sub), name=name)
        for sub, (text, line) in self._numbered(self._sections.values.get(head.index), count).items():
            self._keep_value(Address(head.index, sub), pattern.type, text, line)

    def _numbered(self, section: Section | None, count: int) -> dict[int, Value]:
        """Keys of an ``...Name`` or ``...Value`` section by sub-index."""
        found: dict[int, Value] = {}
        if section is None:
            return found
        for key, value in section.values.items():
            if key == "nrofentries" or not value.text:
                continue
            try:
                sub = parse_int(key)
            except ValueError:
                sub = 0
            if 1 <= sub <= count:
                found[sub] = value
            else:
                self._warnings.add(value.line, "list_entry", section=section.name, text=f"{key}={value.text}")
        stated = self._int(section, "NrOfEntries")
        if stated is not None and stated != len(found):
            line = section.line_of("NrOfEntries")
            self._warnings.add(line, "list_count", section=section.name, stated=stated, found=len(found))
        return found

    # One entry

    def _entry(self, address: Address, name: str, head: _Object, section: Section) -> Entry:
        data_type = self._type(section, address, head.kind)
        default = self._default(section, data_type)
        entry = Entry(
            address=address,
            name=name,
            object_name=head.name,
            kind=head.kind,
            type=data_type,
            access=self._access(section),
            pdo=bool(self._int(section, "PDOMapping") or 0),
            default=None if default is None else default.raw,
            saved=False,
            group=area_of(address.major).group,
            section="",
            minimum=self._limit(section, "LowLimit", data_type),
            maximum=self._limit(section, "HighLimit", data_type),
            node_id=default is not None and default.node_id,
            pdo_way=_pdo_way(section),
            line=section.line,
        )
        value = section.get("ParameterValue")
        if value is not None:
            self._keep_value(address, data_type, value.text, value.line)
        return self._checked(entry, section)

    def _checked(self, entry: Entry, section: Section) -> Entry:
        low, high = entry.minimum, entry.maximum
        if isinstance(low, int) and isinstance(high, int) and low > high:
            self._warnings.add(section.line_of("LowLimit"), "limits_crossed", section=section.name, low=low, high=high)
            return replace(entry, minimum=None, maximum=None)
        default = entry.default
        if isinstance(default, int) and not entry.node_id:
            below = isinstance(low, int) and default < low
            if below or (isinstance(high, int) and default > high):
                line = section.line_of("DefaultValue")
                self._warnings.add(line, "default_outside", section=section.name, value=default)
        return entry

    def _name(self, section: Section, otherwise: str) -> str:
        name = shorten(section.text("ParameterName"), _LONGEST_NAME)
        if not name:
            self._warnings.add(section.line, "key_missing", section=section.name, key="ParameterName")
        return name or otherwise

    def _type(self, section: Section, address: Address, kind: Kind) -> DataType:
        value = section.get("DataType")
        if value is None:
            if self._int_silent(section, "ObjectType") == _OBJECT_CODE_DOMAIN:
                return DataType.DOMAIN
            self._warnings.add(section.line, "key_missing", section=section.name, key="DataType")
            return DataType.UNSIGNED8 if kind is not Kind.VAR and address.minor == 0 else DataType.DOMAIN
        text = bare(value.text)
        if text.upper() in DataType.__members__:
            self._warnings.add(value.line, "type_by_name", section=section.name, text=text)
            return DataType[text.upper()]
        code = self._int(section, "DataType")
        found = None if code is None else _TYPES.get(code) or self._derived_type(code)
        if found is None:
            self._warnings.add(value.line, "type_unknown", section=section.name, text=value.text)
        return found or DataType.DOMAIN

    def _derived_type(self, code: int) -> DataType | None:
        """A type that the file itself defines: its sub-index 1 holds the type it stands for (an editor's habit)."""
        section = self._sections.subs.get(code, {}).get(1)
        return None if section is None else _TYPES.get(self._int_silent(section, "DefaultValue") or 0)

    def _access(self, section: Section) -> Access:
        value = section.get("AccessType")
        if value is None:
            self._warnings.add(section.line, "key_missing", section=section.name, key="AccessType")
            return Access.RO
        access = _ACCESS.get(bare(value.text).lower())
        if access is None:
            self._warnings.add(value.line, "access_unknown", section=section.name, text=value.text)
        return access or Access.RO

    def _default(self, section: Section, data_type: DataType) -> Parsed | None:
        value = section.get("DefaultValue")
        return None if value is None else self._value(value.text, data_type, value.line)

    def _value(self, text: str, data_type: DataType, line: int) -> Parsed | None:
        if data_type.is_integer and not bare(text):
            return None
        try:
            parsed = parse_value(text, data_type)
        except ValueError:
            self._warnings.add(line, "value_unreadable", text=text, type=data_type.name)
            return None
        for oddity in parsed.oddities:
            self._warnings.add(line, oddity, text=text, value=parsed.raw)
        return parsed

    def _keep_value(self, address: Address, data_type: DataType, text: str, line: int) -> None:
        """A value of a DCF, with the node's number put in."""
        parsed = self._value(text, data_type, line)
        if parsed is None:
            return
        if not parsed.node_id or not isinstance(parsed.raw, int):
            self.values[address] = parsed.raw
        elif self._node_id is None:
            self._warnings.add(line, "node_id_unknown", text=text)
        else:
            self.values[address] = parsed.raw + self._node_id

    def _limit(self, section: Section, key: str, data_type: DataType) -> Limit | None:
        value = section.get(key)
        if value is None or not data_type.is_integer:
            return None
        parsed = self._value(value.text, data_type, value.line)
        if parsed is None or not isinstance(parsed.raw, int):
            return None
        if parsed.node_id:
            self._warnings.add(value.line, "limit_of_node", section=section.name, text=value.text)
            return None
        return parsed.raw

    def _check_sub_number(self, section: Section, found: int) -> None:
        stated = self._int(section, "SubNumber")
        if stated is not None and stated != found:
            line = section.line_of("SubNumber")
            self._warnings.add(line, "sub_count", section=section.name, stated=stated, found=found)

    def _int(self, section: Section, key: str) -> int | None:
        """The number of ``key``; None where it is missing or, with a warning, no number."""
        value = section.get(key)
        if value is None or not bare(value.text):
            return None
        try:
            return parse_int(value.text)
        except ValueError:
            self._warnings.add(value.line, "no_number", section=section.name, key=key, text=value.text)
            return None

    def _int_silent(self, section: Section, key: str) -> int | None:
        try:
            return parse_int(section.text(key))
        except ValueError:
            return None
