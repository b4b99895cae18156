"""Which section describes which object, and whether the lists of objects agree with the sections."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Final

from app.model.eds.ini import Ini, Section, Warnings
from app.model.eds.numbers import parse_int

FIRST_OBJECT: Final = 0x1000
"""Below lie the data types (CiA 301, 7.4.1)."""
_OBJECT: Final = re.compile(r"(?:0x)?([0-9a-f]{1,4})(?:(sub)([0-9a-f]{1,4})|(name|value|denotation|objectlinks))?")
_LISTS: Final = ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects")
_KNOWN: Final = frozenset(
    "fileinfo deviceinfo dummyusage comments devicecomissioning devicecommissioning tools dynamicchannels "
    "supportedmodules standarddatatypes".split()
) | {name.lower() for name in _LISTS}
_KNOWN_PATTERN: Final = re.compile(r"tool\d+|m\d+\w*")
_MANDATORY: Final = (0x1000, 0x1001, 0x1018)
_MANUFACTURER: Final = range(0x2000, 0x6000)


@dataclass(slots=True)
class Sections:
    """Sections of the objects by index, of the sub-indices by index and sub-index."""

    objects: dict[int, Section] = field(default_factory=dict)
    subs: dict[int, dict[int, Section]] = field(default_factory=dict)
    names: dict[int, Section] = field(default_factory=dict)
    values: dict[int, Section] = field(default_factory=dict)

    @classmethod
    def of(cls, ini: Ini, warnings: Warnings) -> Sections:
        """Sort the sections of ``ini`` and compare them with the three lists."""
        found = cls()
        for name, section in ini.items():
            match = _OBJECT.fullmatch(name)
            if match:
                found._take(section, match, warnings)
            elif name not in _KNOWN and not _KNOWN_PATTERN.fullmatch(name):
                warnings.add(section.line, "section_unknown", section=section.name)
        for index, subs in found.subs.items():
            if _counts_in_decimal(subs):
                found.subs[index] = {int(f"{sub:x}"): section for sub, section in subs.items()}
                warnings.add(subs[0x10].line, "sub_decimal", index=f"{index:04X}")
        if found.indices():
            _check_lists(ini, found, warnings)
        return found

    def indices(self) -> list[int]:
        """All indices described, from 1000h on, in ascending order."""
        return sorted(index for index in self.objects.keys() | self.subs.keys() if index >= FIRST_OBJECT)

    def _take(self, section: Section, match: re.Match[str], warnings: Warnings) -> None:
        index = int(match[1], 16)
        if match[2]:
            sub = int(match[3], 16)
            if sub > 0xFF:
                warnings.add(section.line, "sub_too_large", section=section.name)
                return
            known = self.subs.setdefault(index, {})
            if sub in known:
                warnings.add(section.line, "section_twice", section=section.name, first=known[sub].line)
            known.setdefault(sub, section)
            return
        target = {None: self.objects, "name": self.names, "value": self.values}.get(match[4])
        if target is None:
            return
        if index in target:
            warnings.add(section.line, "section_twice", section=section.name, first=target[index].line)
        target.setdefault(index, section)


def _counts_in_decimal(subs: dict[int, Section]) -> bool:
    """True where a writer numbered the sub-indices ...sub9, ...sub10 instead of ...sub9, ...subA.

    Read as decimal they have no gap and end with what sub-index 0 says; read as hexadecimal neither is so.
    """
    numbers = [f"{sub:x}" for sub in sorted(subs)]
    if len(numbers) <= 10 or numbers != [str(number) for number in range(len(numbers))]:
        return False
    try:
        return parse_int(subs[0].text("DefaultValue")) == len(numbers) - 1
    except ValueError:
        return False


def _check_lists(ini: Ini, sections: Sections, warnings: Warnings) -> None:
    listed: dict[int, int] = {}
    for name in _LISTS:
        section = ini.get(name)
        if section is None:
            warnings.add(0, "section_missing", section=name)
        else:
            _check_list(section, listed, warnings)
    described = set(sections.indices())
    for index in _MANDATORY:
        if index not in described:
            warnings.add(0, "mandatory_missing", index=f"{index:04X}")
    for index, line in listed.items():
        if index >= FIRST_OBJECT and index not in described:
            warnings.add(line, "listed_not_described", index=f"{index:04X}")
    for index in sorted(described - listed.keys()):
        place = sections.objects.get(index) or next(iter(sections.subs[index].values()))
        warnings.add(place.line, "described_not_listed", index=f"{index:04X}")


def _check_list(section: Section, listed: dict[int, int], warnings: Warnings) -> None:
    """Add the indices of one list to ``listed`` with their lines."""
    count = 0
    for key, (text, line) in section.values.items():
        if key == "supportedobjects" or not text:
            continue
        try:
            parse_int(key)
            index = parse_int(text)
        except ValueError:
            warnings.add(line, "list_entry", section=section.name, text=f"{key}={text}")
            continue
        count += 1
        if index in listed:
            warnings.add(line, "listed_twice", index=f"{index:04X}", first=listed[index])
        elif (section.name.lower() == "manufacturerobjects") != (index in _MANUFACTURER):
            warnings.add(line, "wrong_list", index=f"{index:04X}", section=section.name)
        listed.setdefault(index, line)
    stated = section.get("SupportedObjects")
    line = section.line_of("SupportedObjects")
    try:
        if stated is None or parse_int(stated.text) != count:
            warnings.add(line, "list_count", section=section.name, stated=stated.text if stated else "", found=count)
    except ValueError:
        warnings.add(line, "list_count", section=section.name, stated=stated.text if stated else "", found=count)
