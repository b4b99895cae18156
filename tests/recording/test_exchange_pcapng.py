"""Telegrams exported as pcapng: tshark dissects ADUs as what they are, and gives those of PROFIBUS byte by byte."""

from __future__ import annotations

import json
import shutil
import subprocess
from ipaddress import IPv4Address
from pathlib import Path

import pytest

from app.errors import UsageError
from app.recording.exchange.exporting import Choice, can_buses, export, losses, telegram_buses
from app.recording.exchange.formats import Format, Head, Lost, detect
from app.recording.exchange.importing import ImportOrder, import_file
from app.recording.exchange.pcapng import write_pcapng
from app.recording.reader import open_recording
from app.wire.frame import Adu, Direction, Frame
from app.wire.modbus.adu import decode_adu
from tests.recording.make_pd4e import BUS, MASTER, SAMPLE, SERVER
from tests.recording.rig import frames_of

LINE = SAMPLE.with_name("ed2-bench.mcap")
OAT = SAMPLE.with_name("7-service-visit.mcap")
FIELDS = (
    "frame.time_epoch",
    "frame.interface_name",
    "frame.packet_flags_direction",
    "ip.src",
    "tcp.srcport",
    "ip.dst",
    "tcp.dstport",
    "mbtcp.trans_id",
    "mbtcp.unit_id",
    "modbus.func_code",
    "tcp.payload",
    "tcp.analysis.flags",
    "ip.checksum.status",
    "tcp.checksum.status",
)
GOOD = "1"


def dissected(path: Path) -> list[dict[str, str]]:
    """What tshark says of each packet."""
    assert shutil.which("tshark") is not None, "tshark is missing: make system"
    fields = [part for name in FIELDS for part in ("-e", name)]
    checks = ("-o", "ip.check_checksum:TRUE", "-o", "tcp.check_checksum:TRUE")
    command = ["tshark", "-r", path.name, *checks, "-T", "fields", "-E", "separator=|", *fields]
    done = subprocess.run(command, cwd=path.parent, check=True, timeout=100, capture_output=True, text=True)
    return [dict(zip(FIELDS, line.split("|"), strict=True)) for line in done.stdout.splitlines()]


def test_wireshark_reads_every_adu_as_modbus_tcp(tmp_path: Path) -> None:
    path = tmp_path / "bench.pcapng"
    with open_recording(SAMPLE) as recording:
        assert (telegram_buses(recording), can_buses(recording)) == ((BUS,), ())
        told = losses(recording, Choice(Format.PCAPNG))
        done = export(recording, path, Choice(Format.PCAPNG))
    assert not {loss.what for loss in told} & {Lost.FRAME, Lost.TIME, Lost.BUS, Lost.DIRECTION}
    frames = frames_of(SAMPLE)
    rows = dissected(path)
    assert len(rows) == len(frames) == done.frames
    for frame, row in zip(frames, rows, strict=True):
        assert isinstance(frame.payload, Adu)
        message, asks = decode_adu(frame.payload.data), frame.direction is Direction.TX
        seconds, _, fraction = row["frame.time_epoch"].partition(".")
        assert int(seconds) * 10**9 + int(fraction) == frame.t_ns
        assert row["frame.interface_name"] == BUS
        ends = f"{row['ip.src']}:{row['tcp.srcport']}", f"{row['ip.dst']}:{row['tcp.dstport']}"
        assert ends == ((MASTER, SERVER) if asks else (SERVER, MASTER))
        assert int(row["frame.packet_flags_direction"], 0) == (2 if asks else 1)
        assert [int(row[f"mbtcp.{name}"]) for name in ("trans_id", "unit_id")] == [message.transaction, message.unit]
        assert int(row["modbus.func_code"]) == message.function & 0x7F
        assert row["tcp.payload"].replace(":", "") == frame.payload.data.hex()
        assert row["tcp.analysis.flags"] == "", "no gap, nothing twice"
        assert (row["ip.checksum.status"], row["tcp.checksum.status"]) == (GOOD, GOOD)


def packets(path: Path) -> list[tuple[int, str, int, bytes]]:
    """Time in ns, interface, direction and bytes of each packet, as tshark reads them."""
    command = ["tshark", "-r", path.name, "-T", "json", "-x"]
    done = subprocess.run(command, cwd=path.parent, check=True, timeout=100, capture_output=True, text=True)
    found = []
    for packet in json.loads(done.stdout):
        layers = packet["_source"]["layers"]
        told = layers["frame"]
        seconds, _, fraction = told["frame.time_epoch"].partition(".")
        way = int(told["frame.packet_flags_tree"]["frame.packet_flags_direction"], 0)
        name, data = told["frame.interface_id_tree"]["frame.interface_name"], bytes.fromhex(layers["frame_raw"][0])
        found.append((int(seconds) * 10**9 + int(fraction), name, way, data))
    return found


def test_wireshark_reads_the_bytes_of_every_telegram_of_profibus(tmp_path: Path) -> None:
    path = tmp_path / "line.pcapng"
    with open_recording(LINE) as recording:
        assert (telegram_buses(recording), can_buses(recording)) == (("dp0",), ())
        told = losses(recording, Choice(Format.PCAPNG))
        done = export(recording, path, Choice(Format.PCAPNG))
    assert not {loss.what for loss in told} & {Lost.FRAME, Lost.TIME, Lost.BUS, Lost.DIRECTION}
    frames = frames_of(LINE)
    assert done.frames == len(frames)
    sent = {Direction.TX: 2, Direction.RX: 1}
    assert packets(path) == [(one.t_ns, one.bus, sent[one.direction], one.payload.data) for one in frames]


def test_an_end_without_an_ipv4_address_gets_one_that_the_file_tells(tmp_path: Path) -> None:
    path = tmp_path / "names.pcapng"
    adu = bytes.fromhex("000100000006 00 03 1388 0001")
    links = ("drive.local:502", "10.0.0.1:40000>drive.local:502", "[::1]:40000>drive.local:502")
    frames = [Frame(n * 1000, "lan", Direction.TX, Adu(adu, link)) for n, link in enumerate(links, 1)]
    write_pcapng(path, Head(1, ("lan",)), frames)
    rows = dissected(path)[: len(frames)]
    assert {row["tcp.dstport"] for row in rows} == {"502"}
    assert len({row["ip.dst"] for row in rows}) == 1
    assert all(IPv4Address(row["ip.dst"]).is_private for row in rows)
    assert f"{rows[0]['ip.dst']} stands for drive.local".encode() in path.read_bytes()
    assert rows[1]["ip.src"] == "10.0.0.1"


def test_what_does_not_fit_a_format_is_refused_with_what_does(tmp_path: Path) -> None:
    for source, refused, better in (
        (SAMPLE, [Format.CANDUMP, Format.BLF, Format.CSV], "pcapng"),
        (LINE, [Format.CANDUMP, Format.TRC, Format.ASC], "pcapng"),
        (OAT, [Format.PCAPNG], "candump"),
    ):
        with open_recording(source) as recording:
            for into in refused:
                with pytest.raises(UsageError, match=better):
                    export(recording, tmp_path / "none", Choice(into))
    assert not list(tmp_path.iterdir())


def test_it_is_written_and_not_read(tmp_path: Path) -> None:
    path = tmp_path / "bench.bin"
    with open_recording(SAMPLE) as recording:
        export(recording, path, Choice(Format.PCAPNG))
    assert detect(path) is Format.PCAPNG
    with pytest.raises(UsageError, match="not read"):
        import_file(path, tmp_path / "in", ImportOrder("t", "Anna"))
