"""The EDS files made of our descriptions: complete, accepted by independent checkers, and up to date."""

from __future__ import annotations

import dataclasses
import io
import logging
import subprocess
import sys
import warnings
from decimal import Decimal
from pathlib import Path

import canopen
import pytest
from canopen.objectdictionary import ObjectDictionary, ODVariable

from app.errors import UsageError
from app.model.address import Address, Addressing
from app.model.datatypes import DataType
from app.model.description import Access, Bus, Description, Entry, Kind, LimitRef
from app.model.description_file import builtin_folder, load_builtin
from app.model.eds import read_eds
from app.model.eds_write import builtin_canopen, eds_name, to_eds, write_all
from app.model.variant import as_variant

COMMITTED = builtin_folder() / "eds"
DCFCHK = Path(sys.executable).parent / ("dcfchk.exe" if sys.platform == "win32" else "dcfchk")
DEVICES = ["oat-pmm", "oat-pmc"]


def import_silently(text: str, node_id: int | None, caplog: pytest.LogCaptureFixture) -> ObjectDictionary:
    """Load with canopen; fails on any Python warning or log record from WARNING on."""
    with warnings.catch_warnings(), caplog.at_level(logging.WARNING):
        warnings.simplefilter("error")
        source = io.StringIO(text)
        source.name = "device.eds"
        dictionary = canopen.import_od(source, node_id)
    assert not caplog.records
    return dictionary


def check_with_dcfchk(path: Path, *arguments: str) -> None:
    done = subprocess.run([DCFCHK, *arguments, path], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def variable(dictionary: ObjectDictionary, address: Address) -> ODVariable:
    found = dictionary[address.major]
    return found if isinstance(found, ODVariable) else found[address.minor]


def with_entry(description: Description, address: str, **changes: object) -> Description:
    entries = {
        key: dataclasses.replace(entry, **changes) if key.short == address else entry  # type: ignore[arg-type]
        for key, entry in description.entries.items()
    }
    return dataclasses.replace(description, entries=entries)


@pytest.mark.parametrize("device", DEVICES)
def test_committed_file_is_up_to_date(device: str) -> None:
    # Made again by: hubside od export, or write_all(Path("od/eds")).
    committed = (COMMITTED / eds_name(device)).read_bytes()
    assert committed.decode("ascii") == to_eds(load_builtin(device))


def test_all_canopen_devices_are_written(tmp_path: Path) -> None:
    written = write_all(tmp_path / "new")
    assert [path.name for path in written] == [eds_name(device) for device in builtin_canopen()]
    assert {path.name for path in written} >= {eds_name(device) for device in DEVICES}
    assert all(path.read_bytes() == (COMMITTED / path.name).read_bytes() for path in written)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("node_id", [None, 3])
def test_canopen_loads_it_without_a_warning(device: str, node_id: int | None, caplog: pytest.LogCaptureFixture) -> None:
    description = load_builtin(device)
    dictionary = import_silently(to_eds(description), node_id, caplog)
    for entry in description:
        seen = variable(dictionary, entry.address)
        assert seen.data_type == entry.type.value, entry.address
        assert seen.pdo_mappable == entry.pdo, entry.address
        assert seen.access_type == ("rw" if entry.access is Access.FACTORY else entry.access.value), entry.address
        if isinstance(entry.default, int):
            expected = entry.default + ((node_id or 1) if entry.node_id else 0)
            assert seen.default == expected, entry.address
        if isinstance(entry.minimum, int) and not entry.also:
            assert seen.min == entry.minimum, entry.address
        if isinstance(entry.maximum, int):
            assert seen.max == entry.maximum, entry.address
    assert len(list(dictionary)) == len(list(description.objects()))


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("arguments", [(), ("-n", "3"), ("-p", "-n", "127")])
def test_dcfchk_finds_nothing(device: str, arguments: tuple[str, ...]) -> None:
    check_with_dcfchk(COMMITTED / eds_name(device), *arguments)


@pytest.mark.parametrize("device", DEVICES)
def test_our_own_reader_gives_back_what_was_written(device: str) -> None:
    description = load_builtin(device)
    loaded = read_eds((COMMITTED / eds_name(device)).read_bytes(), eds_name(device))
    assert loaded.warnings == []
    assert loaded.description.id == device
    assert list(loaded.description.entries) == list(description.entries)
    for entry in description:
        seen = loaded.description.entry(entry.address)
        for key in ("name", "object_name", "kind", "type", "pdo", "node_id"):
            assert getattr(seen, key) == getattr(entry, key), (entry.address, key)
        assert seen.default == entry.default, entry.address
        plain = isinstance(entry.minimum, int) and not entry.also
        assert seen.minimum == (entry.minimum if plain else None), entry.address


@pytest.mark.parametrize("variant", [None, *load_builtin("nanotec-pd4e").variants])
def test_a_device_of_another_bus_has_one_that_all_readers_take(
    variant: str | None, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    description = load_builtin("nanotec-pd4e")
    description = description if variant is None else as_variant(description, variant)
    text = to_eds(description)
    dictionary = import_silently(text, 1, caplog)
    assert len(list(dictionary)) == len(list(description.objects()))
    assert not any(line.startswith("BaudRate") and line.endswith("=1") for line in text.splitlines())
    path = tmp_path / "pd4e.eds"
    path.write_bytes(text.encode("ascii"))
    check_with_dcfchk(path)
    loaded = read_eds(path.read_bytes(), path.name)
    assert loaded.warnings == []
    for entry in description:
        seen = loaded.description.entry(entry.address)
        assert (seen.type, seen.access, seen.pdo) == (entry.type, entry.access, entry.pdo), entry.address
        assert seen.default == entry.default, entry.address


def test_text_is_the_same_each_time_and_plain() -> None:
    text = to_eds(load_builtin("oat-pmc"))
    assert text == to_eds(load_builtin("oat-pmc"))
    assert text.isascii()
    assert text.count("\n") == text.count("\r\n") > 1000


def test_makers_objects_become_rw_with_a_comment(toy: Description) -> None:
    text = to_eds(toy)
    section = text.split("[2004sub1]\r\n")[1].split("\r\n\r\n")[0]
    assert section.splitlines() == [
        "ParameterName=part 1",
        "ObjectType=0x7",
        "DataType=0x0007",
        "; r(w): written by the maker only",
        "AccessType=rw",
        "DefaultValue=1",
        "PDOMapping=0",
    ]
    comments = text.split("[Comments]\r\n")[1].split("\r\n\r\n")[0]
    assert "2004:01 2004:02" in comments


def test_limits_that_are_no_numbers_are_left_out(toy: Description) -> None:
    assert isinstance(toy.entry(Address(0x2000, 1)).maximum, LimitRef)
    text = to_eds(toy)
    assert "HighLimit" not in text.split("[2000sub1]")[1].split("[")[0]
    assert "LowLimit=-400\r\nHighLimit=900\r\n" in text.split("[2000sub2]")[1].split("[")[0]


def test_default_outside_its_limits_passes_the_checkers(toy: Description, caplog: pytest.LogCaptureFixture) -> None:
    text = to_eds(with_entry(toy, "2000:02", default=1000, inferred=True))
    section = text.split("[2000sub2]")[1].split("[")[0]
    assert "; HighLimit 900 is left out" in section
    assert "\nHighLimit" not in section
    import_silently(text, 1, caplog)


@pytest.mark.parametrize(
    ("data_type", "default", "written"),
    [
        (DataType.REAL32, 1.5, "DefaultValue=0x3FC00000"),
        (DataType.OCTET_STRING, b"\x0a\x0b", "DefaultValue=0A0B"),
        (DataType.VISIBLE_STRING, "a;b", "DefaultValue=a;b"),
        (DataType.VISIBLE_STRING, "a ;b", None),
        (DataType.VISIBLE_STRING, " a", None),
        (DataType.VISIBLE_STRING, "", None),
        (DataType.INTEGER16, -5, "DefaultValue=-5"),
    ],
)
def test_defaults_of_every_kind(
    toy: Description,
    data_type: DataType,
    default: object,
    written: str | None,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    text = to_eds(with_entry(whole(toy), "2005", type=data_type, default=default))
    section = text.split("[2005]")[1].split("[")[0].splitlines()
    assert [line for line in section if line.startswith("DefaultValue")] == ([written] if written else [])
    import_silently(text, 1, caplog)
    path = tmp_path / "toy.eds"
    path.write_bytes(text.encode("ascii"))
    check_with_dcfchk(path)
    if written:
        assert read_eds(text.encode(), "toy.eds").description.entry(Address(0x2005)).default == default


def test_names_are_put_into_ascii(toy: Description) -> None:
    text = to_eds(with_entry(toy, "2005", object_name="Größe ; in °C #1", name="Größe"))
    assert "ParameterName=Grosse , in deg C no.1\r\n" in text


def test_a_scaled_decimal_limit_is_left_out(toy: Description) -> None:
    text = to_eds(with_entry(toy, "2002", minimum=Decimal("0.5")))
    assert "LowLimit" not in text.split("[2002]")[1].split("[")[0]


def test_a_device_without_an_object_dictionary_has_no_eds(toy: Description) -> None:
    device = dataclasses.replace(toy, addressing=Addressing.PKW, bus=Bus.PROFIBUS_DP)
    with pytest.raises(UsageError):
        to_eds(device)


def whole(toy: Description) -> Description:
    """The toy with the three objects that every CANopen device has."""
    template = toy.entry(Address(0x2002))
    extra: dict[Address, Entry] = {}
    for index, sub, kind in [
        (0x1000, 0, Kind.VAR),
        (0x1001, 0, Kind.VAR),
        (0x1018, 0, Kind.RECORD),
        (0x1018, 1, Kind.RECORD),
    ]:
        data_type = DataType.UNSIGNED8 if index == 0x1001 or (index, sub) == (0x1018, 0) else DataType.UNSIGNED32
        extra[Address(index, sub)] = dataclasses.replace(
            template,
            address=Address(index, sub),
            kind=kind,
            type=data_type,
            access=Access.RO,
            default=1 if index == 0x1018 else 0,
            enumeration=None,
        )
    return dataclasses.replace(toy, entries=dict(sorted((extra | dict(toy.entries)).items())))
