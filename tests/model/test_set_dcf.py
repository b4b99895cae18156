"""Sets as DCF: read by other people's readers, read back whole, read from other tools, refused where damaged."""

from __future__ import annotations

import io
import subprocess
from dataclasses import replace
from pathlib import Path

import canopen
import pytest
from canopen.objectdictionary import ODVariable
from hypothesis import given, settings

from app.errors import SetFileError
from app.model.address import Address, Addressing
from app.model.set_dcf import dcf_name, dump_dcf, load_dcf
from app.model.set_import import read_set_file
from app.model.sets import ParameterSet
from tests.model.set_rig import DESCRIPTIONS, ORIGIN, any_set, taking, whole_set
from tests.model.test_eds_write import DCFCHK

DEVICES = ["oat-pmm", "oat-pmc"]
FOREIGN = """[FileInfo]
FileName=x.dcf
[DeviceInfo]
ProductName=x
[DeviceComissioning]
NodeID=7
[MandatoryObjects]
SupportedObjects=1
1=0x1000
[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
ParameterValue=0x20192
[OptionalObjects]
SupportedObjects=2
1=0x1017
2=0x6065
[1017]
ParameterName=Heartbeat time
ObjectType=0x7
DataType=0x0006
AccessType=rw
ParameterValue=500
[6065]
ParameterName=Following error window
ObjectType=0x7
DataType=0x0007
AccessType=rw
ParameterValue=1234
[ManufacturerObjects]
SupportedObjects=1
1=0x2FFF
[2FFF]
ParameterName=Of another maker
ObjectType=0x7
DataType=0x0007
AccessType=rw
ParameterValue=1
"""


def text_of(name: str) -> tuple[ParameterSet, str]:
    parameters = whole_set(name)
    return parameters, dump_dcf(parameters, DESCRIPTIONS[name])


@pytest.mark.parametrize("device", DEVICES)
def test_the_very_set_comes_back(device: str) -> None:
    parameters, text = text_of(device)
    read = load_dcf(text.encode("ascii"), "x.dcf", taking(origin=None, descriptions={}))
    assert read.parameters == parameters
    assert (read.unknown, read.foreign) == ((), False)
    assert max(map(len, text.splitlines())) < 256


@settings(max_examples=40, deadline=None)
@given(any_set())
def test_any_set_of_the_device_comes_back(parameters: ParameterSet) -> None:
    """Whatever it says of itself: a name with a line end in it begins no section."""
    own = {address: raw for address, raw in parameters.values.items() if address.addressing is Addressing.OD}
    parameters = replace(parameters, values=own)
    text = dump_dcf(parameters, DESCRIPTIONS["oat-pmc"])
    read = load_dcf(text.encode(), "x.dcf", taking(origin=None, descriptions={})).parameters
    assert read == parameters
    assert read.hash == parameters.hash


def test_a_value_of_another_type_than_its_objects_comes_back_too() -> None:
    parameters, _ = text_of(DEVICES[0])
    parameters = replace(parameters, values={**parameters.values, Address(0x1000): 0.0})
    text = dump_dcf(parameters, DESCRIPTIONS[parameters.description_id])
    read = load_dcf(text.encode(), "x.dcf", taking(origin=None, descriptions={})).parameters
    assert (read.hash, repr(read.values[Address(0x1000)])) == (parameters.hash, "0.0")


@pytest.mark.parametrize("device", DEVICES)
def test_canopen_reads_every_value(device: str) -> None:
    parameters, text = text_of(device)
    source = io.StringIO(text)
    source.name = "device.dcf"
    dictionary = canopen.import_od(source)
    assert dictionary.node_id == ORIGIN.node
    seen = 0
    for address, raw in parameters.values.items():
        found = dictionary[address.major]
        variable = found if isinstance(found, ODVariable) else found[address.minor]
        if isinstance(raw, int):
            assert variable.value == raw, address
            seen += 1
    assert seen > 200


@pytest.mark.parametrize("device", DEVICES)
def test_dcfchk_finds_nothing(device: str, tmp_path: Path) -> None:
    parameters, text = text_of(device)
    path = tmp_path / dcf_name(parameters)
    path.write_bytes(text.encode("ascii"))
    for arguments in ((), ("-n", str(ORIGIN.node))):
        command = [DCFCHK, *arguments, path]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_foreign_file_gives_a_set_and_names_what_is_unknown() -> None:
    origin = replace(ORIGIN, node=0)
    read = load_dcf(FOREIGN.encode(), "x.dcf", taking(origin=origin))
    found = read.parameters
    assert read.foreign
    assert found.description_id == "oat-pmc"
    assert found.values == {Address(0x1000): 0x20192, Address(0x1017): 500, Address(0x6065): 1234}
    assert found.identity.device_type == 0x20192
    assert found.origin.node == 7
    assert not found.complete
    assert found.unread[Address(0x1008)] == "not in the file"
    (unknown,) = read.unknown
    assert (unknown.address, unknown.name) == (Address(0x2FFF), "Of another maker")
    assert FOREIGN.splitlines()[unknown.line - 1] == "[2FFF]"
    assert load_dcf(FOREIGN.encode(), "x.dcf", taking(description_id="oat-pmm")).parameters.description_id == "oat-pmm"


def test_a_changed_value_is_refused_unless_the_values_are_wanted_as_they_are() -> None:
    parameters, text = text_of("oat-pmc")
    changed = text.replace("ParameterValue=36000", "ParameterValue=36001", 1)
    assert changed != text
    with pytest.raises(SetFileError) as refused:
        load_dcf(changed.encode(), "x.dcf", taking())
    assert "was changed" in refused.value.details["reason"]
    line = refused.value.details["line"]
    assert "hubside-set" in changed.splitlines()[line - 1]
    read = load_dcf(changed.encode(), "x.dcf", taking(as_values=True))
    assert read.foreign
    differ = {key for key, raw in read.parameters.values.items() if raw != parameters.values[key]}
    assert {parameters.values[key] for key in differ} == {36000}


@pytest.mark.parametrize(
    ("old", "new", "at", "reason"),
    [
        ("ParameterValue=500", "ParameterValue=many", "ParameterValue=many", "many"),
        ("ParameterValue=500", "ParameterValue=70000", "ParameterValue=70000", "70000"),
        ("ParameterValue=500", "ParameterValue=500\nParameterValue=501", "ParameterValue=501", "twice"),
        ("[6065]", "[6065", "[6065", "bracket"),
        ("2=0x6065", "2=0x6066", "2=0x6066", "no section"),
        ("ParameterValue", "OtherValue", "[FileInfo]", "no values"),
        (FOREIGN, "[FileInfo]\nFileName=x", "[FileInfo]", "no object"),
    ],
)
def test_a_damaged_file_names_line_and_reason(old: str, new: str, at: str, reason: str) -> None:
    text = FOREIGN.replace(old, new)
    with pytest.raises(SetFileError) as refused:
        load_dcf(text.encode(), "x.dcf", taking())
    assert reason in refused.value.details["reason"]
    assert text.splitlines()[refused.value.details["line"] - 1] == at


def test_a_file_cut_anywhere_is_refused() -> None:
    """Of our own a piece is missing: the hash tells it, or the head does, wherever it was cut."""
    parameters, text = text_of("oat-pmm")
    end = text.index("ParameterValue")
    for cut in (*range(end, len(text) - 40, 997), text.index("|", text.index("hubside-set |") + 13)):
        try:
            read = load_dcf(text[:cut].encode(), "x.dcf", taking(origin=None))
        except SetFileError as error:
            assert error.details["line"] >= 1
        else:
            assert read.parameters == parameters


def test_a_newer_head_is_refused() -> None:
    _parameters, text = text_of("oat-pmm")
    newer = text.replace("hubside-set/1", "hubside-set/2")
    with pytest.raises(SetFileError, match="this version reads hubside-set/1"):
        load_dcf(newer.encode(), "x.dcf", taking())


def test_whose_values_they_are_must_be_known() -> None:
    with pytest.raises(SetFileError, match="name the device"):
        load_dcf(FOREIGN.encode(), "x.dcf", taking(origin=None))
    with pytest.raises(SetFileError, match="no description 'other'"):
        load_dcf(FOREIGN.encode(), "x.dcf", taking(description_id="other"))
    with pytest.raises(SetFileError, match="fits no device"):
        load_dcf(FOREIGN.encode(), "x.dcf", taking(descriptions={}))


@pytest.mark.parametrize("data", [b"", b" \n", b"[" + b"x" * 9_000_000, b"\x89PNG\r\n\x1a\n\0\0", b"[[[[\xff\xfe"])
def test_what_is_no_file_of_parameters_is_refused(data: bytes) -> None:
    with pytest.raises(SetFileError) as refused:
        read_set_file(data, "x.bin", taking())
    assert refused.value.details["line"] >= 1
    assert refused.value.details["reason"]
