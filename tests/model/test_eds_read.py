"""Foreign data sheets: what can be understood is taken, what cannot is a warning with its line."""

from __future__ import annotations

import ast
import logging
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from durand.datatypes import DatatypeEnum
from durand.network import NetworkABC
from durand.node import MinimalNode
from durand.object_dictionary import ObjectDictionary, Record, Variable
from hypothesis import example, given, settings
from hypothesis import strategies as st

from app.errors import DescriptionError
from app.model import eds as eds_package
from app.model.address import Address
from app.model.datatypes import DataType, encode_raw
from app.model.description import Access, Kind, RestoreClass
from app.model.eds import EdsWarning, LoadedEds, load_eds, read_eds
from app.model.eds import file as eds_file
from app.model.eds.ini import MOST_WARNINGS
from app.model.texts import LANGUAGES, load_texts

FIXTURES = Path(__file__).parent / "fixtures" / "eds"
ONE_OBJECT = b"[2000]\nParameterName=x\nDataType=0x0007\nAccessType=rw\n"


def lines_of(loaded: LoadedEds) -> set[tuple[int, str]]:
    return {(warning.line, warning.text_key.removeprefix("eds.")) for warning in loaded.warnings}


def read_one(default: str, data_type: int = 7, node_id: int | None = None) -> LoadedEds:
    text = f"[2000]\nParameterName=x\nDataType={data_type}\nAccessType=rw\nDefaultValue={default}\n"
    return read_eds(text.encode(), "one.eds", node_id)


def default_of(loaded: LoadedEds) -> object:
    return loaded.description.entry(Address(0x2000)).default


# A data sheet in the Windows code page with CR LF and every way to write a number


def test_old_drive_is_read_whole() -> None:
    loaded = load_eds(FIXTURES / "old_drive.eds")
    description = loaded.description
    assert (description.id, description.version) == ("old-drive", "2.7")
    assert (description.vendor, description.name) == ("Müller & Söhne", "Stellantrieb für Blätter")
    assert description.entry(Address(0x2000)).name == "Größe"
    assert (description.match.vendor_id, description.match.product_code) == (0x1A2, 17)
    assert description.groups == ("area_communication", "area_manufacturer", "area_profile")
    defaults = {entry.address.short: entry.default for entry in description if entry.default is not None}
    assert defaults == {
        "1000": 131474,
        "1010": 1,
        "1018": 1,
        "1018:01": 0x1A2,
        "1400": 2,
        "1400:01": 0x200,
        "1400:02": 255,
        "1800": 1,
        "1800:01": 0x180,
        "2000": 1.5,
        "6064": -2,
    }
    assert lines_of(loaded) == {
        (1, "not_ascii"),
        (69, "value_unreadable"),
        (98, "node_id_order"),
        (103, "octal"),
    }


def test_node_id_is_understood_in_either_order() -> None:
    description = load_eds(FIXTURES / "old_drive.eds").description
    assert description.entry(Address(0x1400, 1)).node_id
    assert description.entry(Address(0x1800, 1)).node_id


@pytest.mark.parametrize(
    "text", ["$NODEID+0x200", "0x200+$NODEID", "$nodeid + 512", "512 + $NodeId", "$NODEID+01000", '"$NODEID+0x200"']
)
def test_ways_to_write_the_node_number(text: str) -> None:
    loaded = read_one(text)
    entry = loaded.description.entry(Address(0x2000))
    assert (entry.default, entry.node_id) == (0x200, True)


def test_the_node_number_alone_is_an_offset_of_zero() -> None:
    entry = read_one("$NODEID").description.entry(Address(0x2000))
    assert (entry.default, entry.node_id) == (0, True)


def test_access_kind_and_restore_class() -> None:
    description = load_eds(FIXTURES / "old_drive.eds").description
    assert description.entry(Address(0x1018)).access is Access.CONST
    assert description.entry(Address(0x6064)).access is Access.RW
    assert description.entry(Address(0x6064)).pdo
    assert description.entry(Address(0x1018, 1)).kind is Kind.RECORD
    assert description.entry(Address(0x2001)).type is DataType.DOMAIN
    assert {entry.restore for entry in description} == {RestoreClass.NEVER}
    assert [command.address.short for command in description.save] == ["1010:01"]


# A data sheet with every mistake: each is told with its line


def test_broken_sheet_gives_every_warning_at_its_line() -> None:
    loaded = load_eds(FIXTURES / "broken.eds")
    assert lines_of(loaded) == {
        (0, "section_missing"),
        (0, "mandatory_missing"),
        (1, "line_before_section"),
        (4, "line_not_understood"),
        (6, "list_count"),
        (8, "listed_not_described"),
        (10, "list_count"),
        (12, "listed_twice"),
        (13, "wrong_list"),
        (14, "list_entry"),
        (15, "listed_not_described"),
        (18, "key_twice"),
        (21, "section_twice"),
        (25, "type_unknown"),
        (26, "access_unknown"),
        (27, "value_unreadable"),
        (28, "described_not_listed"),
        (28, "key_missing"),
        (28, "sub_zero_missing"),
        (30, "sub_count"),
        (31, "key_missing"),
        (34, "value_unreadable"),
        (39, "limits_crossed"),
        (41, "sub_too_large"),
        (43, "described_not_listed"),
        (43, "sub_without_object"),
        (45, "type_by_name"),
        (47, "described_not_listed"),
        (47, "var_with_subs"),
        (56, "described_not_listed"),
        (56, "no_subs"),
        (59, "described_not_listed"),
        (61, "object_type"),
        (64, "negative"),
        (64, "default_outside"),
        (67, "described_not_listed"),
        (71, "octal"),
        (72, "limit_of_node"),
        (73, "no_number"),
        (74, "section_unknown"),
        (76, "section_not_closed"),
        (81, "default_outside"),
    }


def test_broken_sheet_is_still_a_device() -> None:
    description = load_eds(FIXTURES / "broken.eds").description
    assert description.entry(Address(0x1000)).name == "Device Type", "the first of two keys counts"
    assert description.entry(Address(0x1000)).default == 5, "a section that stands twice is one"
    assert description.entry(Address(0x2000)).type is DataType.DOMAIN
    assert description.entry(Address(0x2000)).access is Access.RO
    assert description.entry(Address(0x2001, 0)).default == 2
    assert description.entry(Address(0x2001, 0)).inferred
    assert description.entry(Address(0x2003, 0)).kind is Kind.RECORD
    assert description.entry(Address(0x6000)).name == "bracket forgotten"
    assert not description.has_index(0x2004)


# Compact storage and a configuration file


def test_compact_sub_objects() -> None:
    loaded = load_eds(FIXTURES / "compact.dcf")
    entries = [entry for entry in loaded.description if entry.address.major == 0x2100]
    assert [entry.name for entry in entries] == ["number of elements", "low", "limit2", "high"]
    assert [entry.default for entry in entries] == [3, 7, 7, 7]
    assert entries[1].type is DataType.INTEGER16
    assert (entries[3].minimum, entries[3].maximum, entries[3].pdo) == (-10, 10, True)
    assert {entry.kind for entry in entries} == {Kind.ARRAY}
    assert lines_of(loaded) == {(0, "mandatory_missing")}


def test_compact_pdos_come_from_the_head() -> None:
    description = load_eds(FIXTURES / "compact.dcf").description
    subs = [entry.address.minor for entry in description if entry.address.major == 0x1800]
    assert subs == [0, 1, 2, 5], "the bits of CompactPDO say which sub-indices there are"
    fourth, fifth = description.entry(Address(0x1803, 1)), description.entry(Address(0x1804, 1))
    assert (fourth.default, fourth.node_id) == (0x480, True)
    assert (fifth.default, fifth.node_id) == (0x80000000, False)
    assert description.has_index(0x1805)
    assert not description.has_index(0x1806)
    assert not description.has_index(0x1401)
    assert description.entry(Address(0x1A00, 0)).default == 2, "what is described is not replaced"
    assert description.entry(Address(0x1A01, 0x40)).type is DataType.UNSIGNED32


def test_values_of_a_configuration_are_kept_apart() -> None:
    loaded = load_eds(FIXTURES / "compact.dcf")
    assert loaded.node_id == 11
    assert loaded.values == {
        Address(0x1014): 0x8B,
        Address(0x2100, 2): -5,
        Address(0x2101): "south; east",
        Address(0x2102): 3,
    }
    assert loaded.description.entry(Address(0x2101)).default == "north"
    assert load_eds(FIXTURES / "compact.dcf", node_id=3).values[Address(0x1014)] == 0x83


def test_value_that_needs_an_unknown_node() -> None:
    loaded = read_eds(ONE_OBJECT + b"ParameterValue=$NODEID+1\n", "x.dcf")
    assert loaded.values == {}
    assert (5, "node_id_unknown") in lines_of(loaded)


def test_type_defined_by_the_file_itself() -> None:
    assert load_eds(FIXTURES / "compact.dcf").description.entry(Address(0x2102)).type is DataType.UNSIGNED8


# Numbers


@pytest.mark.parametrize(
    ("text", "data_type", "raw"),
    [
        ("0x1F", 0x7, 31),
        ("0X1f", 0x7, 31),
        ("1Fh", 0x7, 31),
        ("Fh", 0x7, None),
        ("10h", 0x7, 16),
        ("31 ; a comment", 0x7, 31),
        ("017", 0x7, 15),
        ("08", 0x7, 8),
        ("-1", 0x3, -1),
        ("0xFFFF", 0x3, -1),
        ("0x10000", 0x3, None),
        ("65536", 0x6, None),
        ("-1", 0x6, 0xFFFF),
        ("true", 0x1, 1),
        ("2", 0x1, None),
        ("1.5", 0x8, 1.5),
        ("0x3FC00000", 0x8, 1.5),
        ("-2e3", 0x11, -2000.0),
        ("nan", 0x8, None),
        ("0x7F800000", 0x8, None),
        ("1e39", 0x8, None),
        ("text ; and more", 0x9, "text ; and more"),
        ("0A 0b", 0xA, b"\x0a\x0b"),
        ("0x0A0B", 0xF, b"\x0a\x0b"),
        ("xyz", 0xA, None),
        ("00 00 00 00 00 01", 0xC, b"\0\0\0\0\0\x01"),
        ("00 01", 0xC, None),
        ("9" * 5000, 0x7, None),
        ("١", 0x7, None),
        ("1_0", 0x7, None),
        ("", 0x7, None),
    ],
)
def test_ways_to_write_a_value(text: str, data_type: int, raw: object) -> None:
    loaded = read_one(text, data_type)
    assert default_of(loaded) == raw
    told = "value_unreadable" in {name for _, name in lines_of(loaded)}
    assert told == (raw is None and text != "")


# Encodings and ends of lines


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_encodings(encoding: str) -> None:
    text = "[2000]\nParameterName=Größe\nDataType=7\nAccessType=rw\n"
    loaded = read_eds(text.encode(encoding), "x.eds")
    assert loaded.description.entry(Address(0x2000)).name == "Größe"


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_ends_of_lines_keep_their_numbers(end: bytes) -> None:
    loaded = read_eds(ONE_OBJECT.replace(b"\n", end) + b"nonsense" + end, "x.eds")
    assert (5, "line_not_understood") in lines_of(loaded)


# Limits and refusals


@pytest.mark.parametrize("data", [b"", b"\0\0\0", b"[FileInfo]\nFileName=x\n", b"[0005]\nParameterName=a type\n"])
def test_a_file_without_an_object_is_refused(data: bytes) -> None:
    with pytest.raises(DescriptionError) as caught:
        read_eds(data, "empty.eds")
    assert caught.value.details["file"] == "empty.eds"


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DescriptionError):
        load_eds(tmp_path / "none.eds")
    with pytest.raises(DescriptionError):
        load_eds(tmp_path)


def test_a_file_too_large_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "large.eds"
    path.write_bytes(ONE_OBJECT)
    monkeypatch.setattr(eds_file, "LARGEST_FILE", 10)
    with pytest.raises(DescriptionError):
        load_eds(path)


def test_warnings_are_bounded() -> None:
    loaded = read_eds(ONE_OBJECT + b"nonsense\n" * 5000, "x.eds")
    assert len(loaded.warnings) < MOST_WARNINGS + 20
    assert loaded.warnings[-1].text_key == "eds.more_warnings"


def test_compact_objects_cannot_fill_the_memory() -> None:
    head = "ParameterName=x\nObjectType=8\nDataType=7\nAccessType=rw\nCompactSubObj=254\n"
    text = "".join(f"[{index:04X}]\n{head}" for index in range(0x2000, 0x2500))
    loaded = read_eds(text.encode(), "x.eds")
    assert "too_many_entries" in {name for _, name in lines_of(loaded)}
    assert len(loaded.description.entries) < 210_000


def test_a_large_file_is_read_in_time_that_grows_with_its_size() -> None:
    text = "".join(
        f"[{index:04X}]\nParameterName={'x ' * 200}\nDataType=7\nAccessType=rw\nDefaultValue=1{' ' * 20_000}2\n"
        for index in range(0x2000, 0x2100)
    )
    started = time.perf_counter()
    loaded = read_eds(text.encode(), "x.eds")
    assert len(loaded.description.entries) == 0x100
    assert time.perf_counter() - started < 20


# Any bytes at all

_LINES = b"""[1000] [2000] [2000sub0] [2000sub1] [2000Name] [2000Value] [A0sub1] [DeviceInfo] [MandatoryObjects]
[ManufacturerObjects] [DeviceComissioning] NodeID=3 CompactPDO=0x3F NrOfRXPDO=3 NrOfEntries=2 1=0x2000 2=x AccessType=rw
0x0008 0x0009 0x000A 0xA0 255 FF""".split()
_STARTS = b"""NrOfTXPDO= CompactSubObj= SupportedObjects= ParameterName= ObjectType= DataType= DefaultValue=
ParameterValue= LowLimit= HighLimit= PDOMapping= SubNumber= $NODEID + - 0x 07 [ ]""".split()
_PIECES = st.sampled_from([line + b"\n" for line in _LINES] + _STARTS + [b"\r\n", b" ; c\n", b"\xff\xfe", b"\xe4"])
_SHEETS = st.lists(st.one_of(_PIECES, st.binary(max_size=8)), max_size=60).map(b"".join)


@settings(max_examples=400, deadline=None)
@given(st.one_of(_SHEETS, st.binary(max_size=300)))
@example(b"\xff\xfe[\x002\x000\x000\x000\x00]")
@example(b"[1000]\nDataType=0x0008\nDefaultValue=1e400\n")
def test_any_bytes_give_a_description_or_a_refusal(data: bytes) -> None:
    try:
        loaded = read_eds(data, "fuzz.eds")
    except DescriptionError:
        return
    lines = data.count(b"\n") + data.count(b"\r") + 2
    assert all(0 <= warning.line <= lines * 2 for warning in loaded.warnings)
    for entry in loaded.description:
        assert entry.group in loaded.description.groups
        if entry.default is not None:
            encode_raw(entry.type, entry.default)


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_a_damaged_sheet_never_crashes(data: st.DataObject) -> None:
    sheet = bytearray((FIXTURES / "compact.dcf").read_bytes())
    for _ in range(data.draw(st.integers(1, 8))):
        at = data.draw(st.integers(0, len(sheet) - 1))
        sheet[at : at + data.draw(st.integers(0, 40))] = data.draw(st.binary(max_size=6))
    try:
        read_eds(bytes(sheet), "damaged.dcf")
    except DescriptionError:
        return


# An independent implementation's data sheet


class _Nowhere(NetworkABC):  # type: ignore[misc]
    """A bus that nobody listens to: the node is only asked for its data sheet."""

    def add_subscription(self, cob_id: int, callback: object) -> None: ...

    def remove_subscription(self, cob_id: int) -> None: ...

    def send(self, cob_id: int, msg: bytes) -> None: ...


def test_the_sheet_of_another_implementation_is_read() -> None:
    node = MinimalNode(_Nowhere(), 5)
    node.object_dictionary[0x2000] = Variable(DatatypeEnum.UNSIGNED16, "rw", 7, name="speed")
    record = Record(name="table")
    for sub in range(1, 13):
        record[sub] = Variable(DatatypeEnum.INTEGER16, "rw", -sub, name=f"row {sub}")
    node.object_dictionary[0x2001] = record
    loaded = read_eds(node.eds.content.encode(), "durand.eds")
    description = loaded.description
    assert set(description.entries) >= {
        Address(index, sub or 0) for index, sub in _addresses(node.object_dictionary) if index >= 0x1000
    }
    assert description.entry(Address(0x2000)).default == 7
    assert description.entry(Address(0x2001, 12)).default == -12, "its sub-indices count in decimal"
    cob_id = description.entry(Address(0x1800, 1))
    assert (cob_id.default, cob_id.node_id) == (0x180, True)
    names = {name for _, name in lines_of(loaded)}
    assert names == {"mandatory_missing", "sub_decimal", "fraction"} - {"mandatory_missing"}


def _addresses(dictionary: ObjectDictionary) -> Iterator[tuple[int, int | None]]:
    for index, thing in dict(dictionary).items():
        if isinstance(thing, Variable):
            yield index, None
        else:
            yield from ((index, sub) for sub, _ in thing)


# Texts


def test_every_warning_has_a_text_in_every_language() -> None:
    names = set(_names_of_warnings())
    assert len(names) > 30
    for language in LANGUAGES:
        texts = load_texts(language).flat
        missing = {name for name in names if f"eds.{name}" not in texts}
        assert not missing, f"{language}: {sorted(missing)}"


def test_a_warning_shows_its_line() -> None:
    assert str(EdsWarning(7, "eds.octal", {"text": "010"})) == "line 7: octal text=010"


def test_reading_logs_nothing(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.DEBUG):
        load_eds(FIXTURES / "broken.eds")
    assert not caplog.records


def _names_of_warnings() -> list[str]:
    """Second argument of every call of ``Warnings.add``, and the oddities of numbers."""
    found = ["more_warnings", "node_id_order", "octal", "negative", "fraction"]
    for path in Path(eds_package.__path__[0]).glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "add":
                name = node.args[1] if len(node.args) > 1 else None
                if isinstance(name, ast.Constant):
                    found.append(str(name.value))
    return found
