"""Modbus TCP servers for tests: one that says what it is told to, and one that serves a dictionary and registers."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping
from contextlib import asynccontextmanager

from app.drivers.modbus_config import ModbusPeer
from app.model.address import Address
from app.model.datatypes import DataType, Raw, encode_raw
from app.model.description import Description
from app.model.description_file import load_builtin
from app.wire.modbus.adu import AduSplitter, Message, decode_adu
from app.wire.modbus.answers import (
    AbortAnswer,
    Answer,
    ExceptionAnswer,
    FramesRead,
    ObjectRead,
    ObjectWritten,
    RegistersRead,
    RegistersWritten,
)
from app.wire.modbus.fields import FormatError
from app.wire.modbus.frames import ObjectFrame, batches
from app.wire.modbus.functions import ModbusException, Phase
from app.wire.modbus.image import (
    RX_MAPPING,
    RX_REGISTER,
    TX_MAPPING,
    TX_REGISTER,
    MappingObjects,
    ProcessImage,
    WordOrder,
)
from app.wire.modbus.requests import (
    ReadArray,
    ReadDictionary,
    ReadObject,
    ReadRegisters,
    ReadWriteRegisters,
    Request,
    WriteArray,
    WriteObject,
    WriteRegister,
    WriteRegisters,
    decode_request,
)
from app.wire.sdo import Abort

PD4E = load_builtin("nanotec-pd4e")
Handler = Callable[[Message, asyncio.StreamWriter], Awaitable[None]]


class Server:
    """Hands every whole request to ``handler``, in order; counts connections and ends them on demand."""

    def __init__(self, handler: Handler) -> None:
        self.handler = handler
        self.requests: list[Message] = []
        self.connections = 0
        self.port = 0
        self._writers: set[asyncio.StreamWriter] = set()
        self._server: asyncio.Server | None = None
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def peer(self) -> ModbusPeer:
        return ModbusPeer(1, "127.0.0.1", self.port)

    @property
    def open_connections(self) -> int:
        return len(self._writers)

    async def start(self, port: int = 0) -> None:
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", port)
        self.port = self._server.sockets[0].getsockname()[1]

    async def stop(self) -> None:
        assert self._server is not None
        self._server.close()
        self.drop()
        for task in tuple(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self._server.wait_closed()

    def drop(self) -> None:
        """End all connections."""
        for writer in tuple(self._writers):
            writer.transport.abort()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        self._writers.add(writer)
        self.connections += 1
        splitter = AduSplitter()
        try:
            while data := await reader.read(4096):
                for adu in splitter.feed(data):
                    message = decode_adu(adu)
                    self.requests.append(message)
                    await self.handler(message, writer)
        except (FormatError, OSError, asyncio.CancelledError):
            pass
        finally:
            self._writers.discard(writer)
            self._tasks.discard(task)
            writer.transport.abort()


@asynccontextmanager
async def serving(handler: Handler) -> AsyncIterator[Server]:
    server = Server(handler)
    await server.start()
    try:
        yield server
    finally:
        await server.stop()


def reply(message: Message, answer: Answer) -> bytes:
    """The ADU of ``answer`` to ``message``."""
    return message._replace(pdu=answer.pdu()).encode()


class Dictionary:
    """A device as small as can be: objects of a description, FC 43, 101 and 102, registers by its mapping objects.

    It has no physics; what is written stands there. ``latency_s`` is added to each transaction.
    """

    def __init__(
        self, description: Description = PD4E, values: Mapping[Address, Raw] | None = None,
        order: WordOrder = WordOrder.HIGH_FIRST, latency_s: float = 0.0,
    ) -> None:  # fmt: skip
        self.description = description
        self.order = order
        self.latency_s = latency_s
        self.objects = {entry.address: _default(entry.default, entry.type) for entry in description}
        for address, raw in (values or {}).items():
            self.objects[address] = encode_raw(description.entry(address).type, raw)
        self.written: list[tuple[Address, bytes]] = []
        self._batches: list[tuple[ObjectFrame, ...]] = []

    async def handle(self, message: Message, writer: asyncio.StreamWriter) -> None:
        if self.latency_s:
            await asyncio.sleep(self.latency_s)
        writer.write(reply(message, self.answer(message)))

    def answer(self, message: Message) -> Answer:
        try:
            return self._do(decode_request(message.pdu))
        except FormatError:
            return ExceptionAnswer(message.function & 0x7F, ModbusException.ILLEGAL_FUNCTION)
        except _AbortedError as error:
            return AbortAnswer(error.code)

    def _do(self, request: Request) -> Answer:
        match request:
            case ReadObject():
                return ObjectRead(request.address, self._read(request), request.start, request.node)
            case WriteObject():
                self._write(request.address, request.data)
                return ObjectWritten(request.address, request.start, request.node)
            case ReadDictionary(phase):
                if phase is Phase.START:
                    self._batches = self._cut(self.objects)
                return FramesRead(phase, self._next())
            case ReadArray(phase, index):
                if phase is Phase.START:
                    self._batches = self._cut(a for a in self.objects if a.major == index)
                return FramesRead(phase, self._next(), request.function)
            case WriteArray():
                raise _AbortedError(Abort.UNSUPPORTED_ACCESS)
            case ReadRegisters(start, quantity, function):
                found = self._registers(start, quantity)
                return _no_register(request) if found is None else found._replace(function=function)
            case WriteRegister(start, value):
                return request if self._put(start, (value,)) else _no_register(request)
            case WriteRegisters(start, registers):
                written = self._put(start, registers)
                return RegistersWritten(start, len(registers)) if written else _no_register(request)
            case ReadWriteRegisters():
                if not self._put(request.write_start, request.registers):
                    return _no_register(request)
                read = self._registers(request.start, request.quantity)
                return _no_register(request) if read is None else read._replace(function=request.function)

    def _read(self, request: ReadObject) -> bytes:
        data = self.objects.get(request.address)
        if data is None:
            raise _AbortedError(Abort.NO_OBJECT)
        entry = self.description.entries[request.address]
        if entry.type.size is not None and request.size != len(data):
            raise _AbortedError(Abort.LENGTH_TOO_HIGH if request.size > len(data) else Abort.LENGTH_TOO_LOW)
        return data[request.start : request.start + request.size]

    def _write(self, address: Address, data: bytes) -> None:
        if address not in self.objects:
            raise _AbortedError(Abort.NO_OBJECT)
        if not self.description.entries[address].access.writable:
            raise _AbortedError(Abort.READ_ONLY)
        if len(data) != len(self.objects[address]):
            raise _AbortedError(Abort.LENGTH)
        self.written.append((address, data))
        self.objects[address] = data

    def _cut(self, addresses: Iterable[Address]) -> list[tuple[ObjectFrame, ...]]:
        wanted = set(addresses)
        frames = [ObjectFrame(a, self.objects[a]) for a in sorted(self.objects, key=lambda a: a[:2]) if a in wanted]
        if not frames:
            raise _AbortedError(Abort.NO_OBJECT)
        return [tuple(batch) for batch in batches(frames)]

    def _next(self) -> tuple[ObjectFrame, ...]:
        if not self._batches:
            raise _AbortedError(Abort.NO_DATA)
        return self._batches.pop(0)

    def image(self, index: int, start: int) -> ProcessImage | None:
        mapping = MappingObjects(index, start)
        mapping.order = self.order
        for address, data in self.objects.items():
            mapping.learn(address, data)
        return mapping.image

    def _registers(self, start: int, quantity: int) -> RegistersRead | None:
        for image in (self.image(TX_MAPPING, TX_REGISTER), self.image(RX_MAPPING, RX_REGISTER)):
            if image is not None and image.start <= start and start + quantity <= image.start + image.span.quantity:
                registers = image.registers(self.objects)
                return RegistersRead(registers[start - image.start :][:quantity])
        return None

    def _put(self, start: int, registers: tuple[int, ...]) -> bool:
        image = self.image(RX_MAPPING, RX_REGISTER)
        if image is None or start < image.start or start + len(registers) > image.start + image.span.quantity:
            return False
        whole = list(image.registers(self.objects))
        whole[start - image.start : start - image.start + len(registers)] = registers
        self.objects.update(image.values(image.start, whole))
        return True


class _AbortedError(Exception):
    def __init__(self, code: Abort) -> None:
        self.code = code


def _no_register(request: Request) -> ExceptionAnswer:
    return ExceptionAnswer(request.function, ModbusException.ILLEGAL_ADDRESS)


def _default(default: Raw | None, data_type: DataType) -> bytes:
    size = data_type.size
    if default is None:
        return b"" if size is None else bytes(size)
    return encode_raw(data_type, default)


@asynccontextmanager
async def dictionary_server(dictionary: Dictionary) -> AsyncIterator[Server]:
    async with serving(dictionary.handle) as server:
        yield server
