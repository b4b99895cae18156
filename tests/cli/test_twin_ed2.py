"""``hubside twin ed2`` as a process: it serves on a pty, keeps what was saved, and ends with its caller."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
import termios
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from app.cli.main import build_parser
from app.cli.output import Output
from app.errors import UsageError
from app.model.texts import load_texts
from app.wire.profibus.dp import FdlStatus
from app.wire.profibus.fdl import AnyTelegram, decode
from app.wire.profibus.splitter import Found, Splitter
from tests.twins.ed2.rig import Master

ANSWER_S = 2.0


class RealWire:
    """The pty of another process, in real time."""

    def __init__(self, path: str) -> None:
        self.handle = os.open(path, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.handle, termios.TCSANOW)
        self._splitter = Splitter()

    def exchange(self, data: bytes) -> list[AnyTelegram]:
        os.write(self.handle, data)
        until_s = time.monotonic() + ANSWER_S
        while (left_s := until_s - time.monotonic()) > 0:
            if select.select([self.handle], (), (), left_s)[0]:
                pieces = self._splitter.feed(os.read(self.handle, 4096))
                told = [decode(piece.data) for piece in pieces if isinstance(piece, Found)]
                if told:
                    return told
        return []

    def wait(self, ms: int) -> None:
        select.select((), (), (), ms / 1_000)


@contextmanager
def served(*more: str) -> Iterator[tuple[dict[str, object], RealWire]]:
    """A twin in a process of its own, and its line."""
    command = [sys.executable, "-m", "app.cli", "twin", "ed2", "--json", "--while-stdin", *more]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        told = json.loads(process.stdout.readline())
        wire = RealWire(told["path"])
        yield told, wire
        os.close(wire.handle)
    finally:
        process.stdin.close()
        process.wait(20)
        process.stdout.close()
    assert process.returncode == 0


def started(wire: RealWire, address: int) -> Master:
    """A master that exchanges, once the twin has passed its self test."""
    master = Master(wire, address)
    for _ in range(20):
        if master.send(FdlStatus()):
            break
    master.start(1)
    master.until(lambda: master.status & 0xF != 0)
    return master


def test_it_runs_in_real_time_for_several_slaves_and_ends_with_its_caller() -> None:
    with served("--address", "6", "--address", "8", "--baud", "1500000") as (told, wire):
        assert told["slaves"] == [6, 8]
        assert told["address"] == f"{told['path']}@1500000"
        for address in (6, 8):
            master = started(wire, address)
            assert master.read("12/219") == 2
        master.set(0x7 | 0x2000, 255_000)
        master.until(lambda: bool(master.status & 0x1000))
        assert master.actual == pytest.approx(255_000, abs=150)


def test_what_was_saved_is_there_in_the_next_process(tmp_path: Path) -> None:
    with served("--state", str(tmp_path)) as (_, wire):
        master = started(wire, 6)
        master.write("12/207", 4_711)
        master.write("0/51", 0x73617665)
    with served("--state", str(tmp_path)) as (_, wire):
        assert started(wire, 6).read("12/207") == 4_711


def test_a_fault_of_the_command_line_happens() -> None:
    with served("--fault", "sensor_wire@0.6s,axis=1", "--transducer", "analog") as (_, wire):
        master = started(wire, 6)
        master.until(lambda: master.read("0/36") == 0x5232)


def test_a_scenario_happens(tmp_path: Path) -> None:
    path = tmp_path / "supply.toml"
    path.write_text('title = "Supply"\nduration_s = 9.0\n[[event]]\nat_s = 0.7\nfault = "supply"\n', encoding="utf-8")
    with served("--scenario", str(path)) as (_, wire):
        master = started(wire, 6)
        master.until(lambda: master.read("0/36") == 0x5100)


@pytest.mark.parametrize(
    "arguments",
    [["--address", "127"], ["--address", "6", "--address", "6"], ["--fault", "fire"], ["--fault", "supply,slave=9"]],
)
def test_what_makes_no_sense_is_refused(arguments: list[str]) -> None:
    parsed = build_parser().parse_args(["twin", "ed2", *arguments])
    with pytest.raises(UsageError):
        parsed.run(parsed, Output(load_texts("en"), False))


def test_linked_cylinders_hold_each_other_back() -> None:
    with served("--bench", "linked", "--baud", "1500000") as (_, wire):
        master = started(wire, 6)
        master.write("0/53", 1)
        master.set(0x7 | 0x2000, 450_000)
        master.until(lambda: master.read("0/36") == 0x8230, 60_000)
        assert 300_000 < master.actual < 400_000, "the other one stands, and pulls with 500 N a millimetre"
