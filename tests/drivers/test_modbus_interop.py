"""Libraries and a dissector of others: pymodbus and pyModbusTCP on either side of the wire, and tshark reading it."""

from __future__ import annotations

import asyncio
import socket
import subprocess
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from pymodbus.client import AsyncModbusTcpClient
from pymodbus.pdu import ModbusPDU
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice
from pyModbusTCP.client import ModbusClient
from pyModbusTCP.server import ModbusServer

from app.drivers.modbus_config import ModbusPeer
from app.drivers.modbus_link import ModbusLink
from app.errors import DeviceError
from app.model.address import Address
from app.wire.frame import Adu, Direction, Frame
from app.wire.modbus.adu import decode_adu
from app.wire.modbus.answers import (
    AbortAnswer,
    Answer,
    ExceptionAnswer,
    FramesRead,
    ObjectRead,
    ObjectWritten,
    RegistersRead,
    RegistersWritten,
    decode_answer,
)
from app.wire.modbus.decoder import ModbusDecoder
from app.wire.modbus.fields import words_of
from app.wire.modbus.functions import MEI_CANOPEN, Function, Phase
from app.wire.modbus.requests import (
    ReadDictionary,
    ReadObject,
    ReadRegisters,
    ReadWriteRegisters,
    Request,
    WriteObject,
    WriteRegister,
    WriteRegisters,
    decode_request,
)
from app.wire.records import Outcome, SdoSeen, TransactionSeen, ValueSeen
from tests.drivers.modbus_rig import VALUES, connected, mapped, twin
from tests.drivers.modbus_server import Dictionary, dictionary_server
from tests.drivers.wire import stamper

STATUSWORD, CONTROLWORD = Address(0x6041), Address(0x6040)
PATIENCE_S = 10.0
HOLDING = Function.READ_HOLDING_REGISTERS


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


# -- their clients, our twin ---------------------------------------------------------------


async def test_pymodbustcp_as_client_of_the_twin() -> None:
    """Registers, and FC 43 and 101 as raw requests, in agreement with our driver."""
    with twin() as peer:
        client = ModbusClient(peer.host, peer.port, unit_id=0, timeout=PATIENCE_S)

        def registers() -> tuple[object, ...]:
            holding, inputs = client.read_holding_registers(5000, 7), client.read_input_registers(5000, 7)
            written = client.write_single_register(6000, 6)
            both = client.write_read_multiple_registers(6000, [7, 1], 6000, 2)
            several = client.write_multiple_registers(6000, [6, 3])
            beyond = client.read_holding_registers(9000, 1), client.last_except
            return holding, inputs, written, both, several, client.read_holding_registers(6000, 2), beyond

        def raw(request: Request) -> Answer:
            pdu = client.custom_request(request.pdu())
            assert pdu is not None, client.last_error_as_txt
            return decode_answer(bytes(pdu))

        holding, inputs, written, both, several, after, beyond = await asyncio.to_thread(registers)
        assert holding == inputs
        assert (written, both, several, after, beyond) == (True, [7, 1], True, [6, 3], (None, 2))
        status = await asyncio.to_thread(raw, ReadObject(STATUSWORD, 2))
        assert isinstance(status, ObjectRead)
        assert await asyncio.to_thread(raw, WriteObject(CONTROLWORD, b"\6\0")) == ObjectWritten(CONTROLWORD)
        first = await asyncio.to_thread(raw, ReadDictionary(Phase.START))
        client.close()
        async with connected(peer) as driver:
            assert await driver.read(1, STATUSWORD) == status.data
            dictionary = await driver.backup(1)
            assert isinstance(first, FramesRead)
            assert [frame.address for frame in first.frames] == list(dictionary)[: len(first.frames)]


class RawDictionary(ModbusPDU):
    """FC 101 as pymodbus wants a function of one's own."""

    function_code = Function.READ_DICTIONARY
    rtu_byte_count_pos = 3
    data = b""

    def encode(self) -> bytes:
        return ReadDictionary(Phase.START).pdu()[1:]

    def decode(self, data: bytes) -> None:
        self.data = data


async def test_pymodbus_as_client_of_the_twin() -> None:
    with twin() as peer:
        client = AsyncModbusTcpClient(peer.host, port=peer.port, retries=0, timeout=PATIENCE_S)
        client.register(RawDictionary)
        assert await client.connect()
        try:
            holding = await client.read_holding_registers(5000, count=7, device_id=0)
            inputs = await client.read_input_registers(5000, count=7, device_id=0)
            assert holding.registers == inputs.registers
            assert not (await client.write_register(6000, 6, device_id=0)).isError()
            assert not (await client.write_registers(6000, [7, 1], device_id=0)).isError()
            both = await client.readwrite_registers(
                read_address=6000, read_count=2, write_address=6000, values=[6, 3], device_id=0
            )
            assert both.registers == [6, 3]
            beyond = await client.read_holding_registers(9000, count=1, device_id=0)
            assert (beyond.isError(), beyond.exception_code) == (True, 2)
            frames = await client.execute(False, RawDictionary())
            assert isinstance(frames, RawDictionary)
            answer = decode_answer(bytes((Function.READ_DICTIONARY,)) + frames.data)
        finally:
            client.close()
        async with connected(peer) as driver:
            dictionary = await driver.backup(1)
            assert isinstance(answer, FramesRead)
            assert [frame.address for frame in answer.frames] == list(dictionary)[: len(answer.frames)]


# -- our transport, their servers -------------------------------------------------------------

EXCHANGES: tuple[tuple[Request, Answer], ...] = (
    (WriteRegister(6000, 0x0006), WriteRegister(6000, 0x0006)),
    (WriteRegisters(6001, (0x0102, 0xFFFE)), RegistersWritten(6001, 2)),
    (ReadRegisters(6000, 3), RegistersRead((0x0006, 0x0102, 0xFFFE), HOLDING)),
    (
        ReadWriteRegisters(6000, 2, 6000, (0x000F,)),
        RegistersRead((0x000F, 0x0102), Function.READ_WRITE_REGISTERS),
    ),
)


async def exchanged(peer: ModbusPeer) -> list[Frame]:
    """Our transport asks all of ``EXCHANGES``; gives what crossed the wire."""
    frames: list[Frame] = []
    link = ModbusLink(peer, "modbus0", stamper(), frames.append, lambda _error: None)
    await link.open(PATIENCE_S)
    try:
        for request, answer in EXCHANGES:
            assert await link.request(request, PATIENCE_S) == answer
        assert isinstance(await link.request(ReadObject(STATUSWORD, 2), PATIENCE_S), ExceptionAnswer)
    finally:
        await link.close()
    return frames


@asynccontextmanager
async def pymodbus_server() -> AsyncIterator[ModbusPeer]:
    port = free_port()
    device = SimDevice(0, simdata=[SimData(6000, values=[0] * 10, datatype=DataType.REGISTERS)])
    server = ModbusTcpServer(device, address=("127.0.0.1", port))
    await server.serve_forever(background=True)
    try:
        yield ModbusPeer(1, "127.0.0.1", port)
    finally:
        await server.shutdown()  # type: ignore[no-untyped-call]


async def test_a_server_of_pymodbus() -> None:
    async with pymodbus_server() as peer:
        frames = await exchanged(peer)
    records = ModbusDecoder("modbus0", {peer.server: 1}).feed_all(frames)
    outcomes = [record.outcome for record in records if isinstance(record, TransactionSeen)]
    assert outcomes == [Outcome.DONE] * len(EXCHANGES) + [Outcome.ABORTED]


async def test_a_server_of_pymodbustcp() -> None:
    port = free_port()
    server = ModbusServer("127.0.0.1", port, no_block=True)
    await asyncio.to_thread(server.start)
    try:
        frames = await exchanged(ModbusPeer(1, "127.0.0.1", port))
    finally:
        await asyncio.to_thread(server.stop)
    assert len(frames) == 2 * len(EXCHANGES) + 2


# -- tshark --------------------------------------------------------------------------------------

FIELDS = (
    "mbtcp.trans_id",
    "mbtcp.len",
    "mbtcp.unit_id",
    "modbus.func_code",
    "modbus.exception_code",
    "modbus.regval_uint16",
    "modbus.data",
    "modbus.reference_num",
    "modbus.word_cnt",
    "modbus.read_reference_num",
    "modbus.read_word_cnt",
    "modbus.write_reference_num",
    "modbus.write_word_cnt",
    "modbus.mei",
    "tcp.dstport",
)
PLACES = FIELDS[7:-2]
REGISTERS = {3, 4, 6, 16, 23}
PORT = 15020


async def recorded() -> list[Frame]:
    """Traffic of our driver with every function, refusals too."""
    frames: list[Frame] = []
    dictionary: Dictionary = mapped().dictionary
    async with dictionary_server(dictionary) as server, connected(server.peer) as driver:
        driver.subscribe(frames.extend)
        await driver.process_data(1).exchange(VALUES)
        await driver.backup(1)
        with pytest.raises(DeviceError):
            await driver.read(1, Address(0x2FFF))
        link = driver._device(1).link
        for request in (
            WriteRegister(6000, 0x0006),
            WriteRegisters(6000, (0x0007, 0x0001)),
            ReadRegisters(5000, 4, Function.READ_INPUT_REGISTERS),
            ReadRegisters(9000, 1),
            ReadWriteRegisters(5000, 1, 9000, (1,)),
        ):
            await link.request(request, PATIENCE_S)
    return frames


def dissected(frames: list[Frame], folder: Path) -> list[dict[str, list[str]]]:
    """What tshark says of each frame, in order."""
    lines = []
    for frame in frames:
        assert isinstance(frame.payload, Adu)
        way = "I" if frame.direction is Direction.TX else "O"  # as the server sees it
        lines += [f"{way} {frame.t_ns // 10**9}.{frame.t_ns % 10**9:09d}", f"0000 {frame.payload.data.hex(' ')}", ""]
    text, capture = folder / "adus.txt", folder / "adus.pcap"
    text.write_text("\n".join(lines), encoding="ascii")
    made = ["text2pcap", "-q", "-D", "-t", "%s.%f", "-T", f"40000,{PORT}", text.name, capture.name]
    subprocess.run(made, cwd=folder, check=True, timeout=60, capture_output=True)
    fields = [part for name in FIELDS for part in ("-e", name)]
    read = ["tshark", "-r", capture.name, "-o", f"mbtcp.tcp.port:{PORT}", "-T", "fields", "-E", "separator=|", *fields]
    out = subprocess.run(read, cwd=folder, check=True, timeout=60, capture_output=True, text=True).stdout
    rows = [line.split("|") for line in out.splitlines()]
    return [
        {name: [each for each in cell.split(",") if each] for name, cell in zip(FIELDS, row, strict=True)}
        for row in rows
    ]


def told(row: dict[str, list[str]]) -> dict[str, tuple[int, ...]]:
    """What tshark says of registers; those of FC 6 and 23 it leaves as bytes."""
    numbers = {name.removeprefix("modbus."): tuple(int(each, 0) for each in row[name]) for name in PLACES}
    data = bytes.fromhex("".join(row["modbus.data"]))
    return {"registers": tuple(int(each, 0) for each in row["modbus.regval_uint16"]) or words_of(data), **numbers}


def expected(message: Request | Answer) -> dict[str, tuple[int, ...]]:
    """The same of what our codec reads."""
    found: dict[str, tuple[int, ...]] = {}
    match message:
        case ReadRegisters():
            found = {"reference_num": (message.start,), "word_cnt": (message.quantity,)}
        case WriteRegister():
            found = {"reference_num": (message.start,), "registers": (message.value,)}
        case WriteRegisters():
            count = len(message.registers)
            found = {"reference_num": (message.start,), "word_cnt": (count,), "registers": message.registers}
        case RegistersWritten():
            found = {"reference_num": (message.start,), "word_cnt": (message.quantity,)}
        case ReadWriteRegisters():
            found = {"read_reference_num": (message.start,), "read_word_cnt": (message.quantity,)}
            found |= {"write_reference_num": (message.write_start,), "registers": message.registers}
            found |= {"write_word_cnt": (len(message.registers),)}
        case RegistersRead():
            found = {"registers": message.registers}
    return {"registers": (), **{name.removeprefix("modbus."): () for name in PLACES}, **found}


async def test_tshark_reads_what_our_decoder_reads(tmp_path: Path) -> None:
    frames = await recorded()
    rows = await asyncio.to_thread(dissected, frames, tmp_path)
    assert len(rows) == len(frames)
    functions, values = set(), 0
    for frame, row in zip(frames, rows, strict=True):
        assert isinstance(frame.payload, Adu)
        message = decode_adu(frame.payload.data)
        asks = frame.direction is Direction.TX
        assert [int(each, 0) for each in row["mbtcp.trans_id"]] == [message.transaction]
        assert [int(each, 0) for each in row["mbtcp.len"]] == [len(message.pdu) + 1]
        assert [int(each, 0) for each in row["mbtcp.unit_id"]] == [message.unit]
        assert [int(each, 0) for each in row["modbus.func_code"]] == [message.function & 0x7F]
        assert (int(row["tcp.dstport"][0]) == PORT) is asks
        decoded = decode_request(message.pdu) if asks else decode_answer(message.pdu)
        if isinstance(decoded, ExceptionAnswer):
            assert [int(each, 0) for each in row["modbus.exception_code"]] == [decoded.exception]
        if message.function & 0x7F in REGISTERS:
            assert told(row) == expected(decoded)
            values += len(told(row)["registers"])
        if message.function == Function.OBJECT:
            assert [int(each, 0) for each in row["modbus.mei"]] == [MEI_CANOPEN]
        functions.add(message.function)
    assert functions == {3, 4, 6, 16, 23, 43, 101, 0x83, 0x97, 0xAB}
    assert values >= 15


async def test_the_passive_decoder_reads_the_same_recording() -> None:
    frames = await recorded()
    server = next(frame.payload.link for frame in frames if isinstance(frame.payload, Adu)).partition(">")[2]
    records = ModbusDecoder("modbus0", {server: 1}).feed_all(frames)
    aborts = [record.abort_code for record in records if isinstance(record, SdoSeen | TransactionSeen)]
    refusals = sum(
        isinstance(decode_answer(decode_adu(frame.payload.data).pdu), AbortAnswer)
        for frame in frames
        if isinstance(frame.payload, Adu) and frame.direction is Direction.RX
    )
    assert len([code for code in aborts if code is not None]) == refusals
    latest = {record.address: record.data for record in records if isinstance(record, ValueSeen)}
    assert latest[CONTROLWORD] == b"\7\0"
    assert latest[Address(0x6060)] == b"\1"
