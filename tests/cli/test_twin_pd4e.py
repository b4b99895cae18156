"""``hubside twin pd4e`` as a process: it serves, keeps what was saved, and ends with its caller."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from app.cli.main import build_parser
from app.cli.output import Output
from app.errors import BusOpenError, UsageError
from app.model.texts import load_texts
from tests.twins.pd4e.rig import Client, Clock

SAVE, BOOT = 0x65766173, 0x746F6F62


@contextmanager
def served(*more: str) -> Iterator[tuple[subprocess.Popen[str], Client]]:
    """A twin in a process of its own, and a client of it."""
    command = [sys.executable, "-m", "app.cli", "twin", "pd4e", "--modbus", "127.0.0.1:0", "--json", "--while-stdin"]
    process = subprocess.Popen([*command, *more], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        host, _, port = json.loads(process.stdout.readline())["address"].rpartition(":")
        client = Client((host, int(port)), Clock())
        yield process, client
        client.close()
    finally:
        process.stdin.close()
        process.wait(20)
        process.stdout.close()
    assert process.returncode == 0


def test_it_runs_in_real_time_and_ends_with_its_caller() -> None:
    with served("--variant", "pd4-eb59", "--serial", "SN-42") as (_, client):
        assert client.text("1008").startswith("HUBSIDE TWIN PD4-EB59")
        assert client.text("4040") == "SN-42"
        assert client.read("2030") == 3
        client.enable(3)
        client.write("60FF", 60)
        for _ in range(20_000):
            if client.read("606C") > 50:
                break
        assert client.read("606C") == pytest.approx(60, abs=10)


def test_what_was_saved_is_there_in_the_next_process(tmp_path: Path) -> None:
    with served("--state", str(tmp_path)) as (_, client):
        client.write("6083", 777)
        client.write("1010:03", SAVE)
        for _ in range(20_000):
            if client.read("1010:03") == 1:
                break
    with served("--state", str(tmp_path)) as (_, client):
        assert client.read("6083") == 777


def test_the_slide_has_switches() -> None:
    with served("--bench", "slide") as (_, client):
        client.write("3240:01", 7)
        assert client.read("60FD") == 0, "between all switches"
        client.write("6098", 24)
        client.write("6099:01", 300)
        client.write("6099:02", 60)
        client.enable(6)
        client.write("6040", 0x1F)
        for _ in range(100_000):
            if client.has(0x1400):
                break
        assert client.has(0x1400), "homed in real time"
        assert client.read("6063") == pytest.approx(-2 * 320_000, abs=3_200)


def run(*arguments: str) -> int:
    parsed = build_parser(arguments).parse_args(arguments)
    return int(parsed.run(parsed, Output(load_texts("en"), parsed.json)))


def test_a_port_in_use_is_told() -> None:
    with served() as (_, client), pytest.raises(BusOpenError):
        host, port = client.socket.getpeername()
        run("twin", "pd4e", "--modbus", f"{host}:{port}")


@pytest.mark.parametrize("address", ["1502", "127.0.0.1:", "127.0.0.1:70000", "127.0.0.1:x"])
def test_an_address_that_is_none_is_told(address: str) -> None:
    with pytest.raises(UsageError):
        run("twin", "pd4e", "--modbus", address)
