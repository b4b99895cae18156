"""Process data by registers, at places that the device's own mapping objects tell (PD4-E manual, 8.5).

The default mapping differs between devices: an assumed register may be that of another object. So 3502h and 3602h are
read before the first exchange on a connection, and again after anybody has written them through it. Which register of a
32-bit value comes first the device shows by one such value, of either image, read both ways. Until it has, those are
read by FC 43, and none is written.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Final, NamedTuple

from app.drivers.modbus_device import DEFAULT_TIMEOUT_S, ModbusDevice
from app.drivers.modbus_link import InterruptedRequest, ModbusLink
from app.errors import PdoChangedError, RefusedError, UnverifiedError
from app.model.address import Address
from app.wire.modbus.answers import Answer, RegistersRead
from app.wire.modbus.functions import MAX_READ
from app.wire.modbus.image import (
    RX_MAPPING,
    RX_REGISTER,
    TX_MAPPING,
    TX_REGISTER,
    MappingObjects,
    ProcessImage,
    Span,
    WordOrder,
    shown_order,
)
from app.wire.modbus.requests import ReadRegisters, ReadWriteRegisters

MAPPINGS: Final = frozenset({RX_MAPPING, TX_MAPPING})
ORDER_TRIES: Final = 3
"""A value that moves may differ between its two readings."""


class Images(NamedTuple):
    """What the device takes and what it gives, and the connection on which that was read."""

    received: ProcessImage
    sent: ProcessImage
    link: ModbusLink


class ProcessData:
    """Process data of one device."""

    def __init__(self, device: ModbusDevice) -> None:
        self._device = device
        self._images: Images | None = None
        self._generation = 0
        self._changing = 0

    def forget(self) -> None:
        """The mapping may be another one."""
        self._images = None
        self._generation += 1

    @contextmanager
    def changing(self) -> Iterator[None]:
        """While the mapping is being written nothing is exchanged: nobody knows which one is in force."""
        self._changing += 1
        self.forget()
        try:
            yield
        finally:
            self._changing -= 1
            self.forget()

    async def images(self) -> Images:
        """The process images in force, read where they are not known.

        Raises RefusedError (PdoChangedError while the mapping is being written), and what reads raise.
        """
        while True:
            self._require_unchanged()
            link, generation = self._device.link, self._generation
            if self._images is not None and self._images.link is link:
                return self._images
            received, sent = await self._mapping(RX_MAPPING, RX_REGISTER), await self._mapping(TX_MAPPING, TX_REGISTER)
            received.order = sent.order = await self._order(self._image(sent)) or await self._order(
                self._image(received)
            )
            if self._generation == generation and self._device.link is link:
                self._images = Images(self._image(received), self._image(sent), link)

    def _require_unchanged(self, generation: int | None = None) -> None:
        """Raises PdoChangedError while the mapping is being written, or where it was since ``generation``."""
        if self._changing or generation not in (None, self._generation):
            raise PdoChangedError(device=self._device.peer.server, pdo="3502h/3602h")

    async def exchange(
        self,
        values: Mapping[Address, bytes] | None = None,
        timeout_s: float = DEFAULT_TIMEOUT_S,
        known: Mapping[Address, int] | None = None,
    ) -> dict[Address, bytes]:
        """Write ``values`` and read all that the device sends, both in one FC 23 (FC 3 where nothing is written).

        What is written must fill the registers that it touches: nobody knows what its neighbours should be. ``known``:
        what ``commanded`` said of written objects; after another urgent command nothing is sent. Values whose order of
        words is not known yet are read by FC 43.

        Raises RefusedError (nothing was sent; OvertakenError and PdoChangedError too), ModbusExceptionError,
        NoAnswerError, BusLostError, UnverifiedError (it had to make room for an urgent command; whether it was carried
        out is not known).
        """
        while True:
            images, generation = await self.images(), self._generation
            start, quantity = images.sent.span
            if values:
                answer = await self._written(images, generation, values, timeout_s, known or {})
                break
            answer = await self._device.ask(ReadRegisters(start, quantity), timeout_s, what=f"registers from {start}")
            if generation == self._generation and self._device.link is images.link:
                break
        if not isinstance(answer, RegistersRead):
            raise self._device.refusal(answer, _what(values or {}))
        found = dict(images.sent.values(start, answer.registers))
        for address in images.sent.places:
            if address not in found:
                found[address] = await self._device.read(address, timeout_s)
        return found

    async def _written(
        self, images: Images, generation: int, values: Mapping[Address, bytes], timeout_s: float,
        known: Mapping[Address, int],
    ) -> Answer:  # fmt: skip
        window = _window(images.received, values)
        registers = _registers(images.received, window, values)
        request = ReadWriteRegisters(*images.sent.span, window.start, registers)
        async with images.link.turn():
            self._require_unchanged(generation)
            for address in values:
                self._device.require_no_save(address, motion=True)
                self._device.require_known(address, known.get(address))
            try:
                return await images.link.finish(images.link.send(request), timeout_s, what=_what(values))
            except InterruptedRequest:
                sent = " ".join(f"{register:04X}" for register in registers)
                reason = "interrupted by an urgent command"
                raise UnverifiedError(address=_what(values), name="", sent=sent, found=None, reason=reason) from None

    # -- the mapping ---------------------------------------------------------------------

    async def _mapping(self, index: int, start: int) -> MappingObjects:
        objects = MappingObjects(index, start)
        count = await self._device.read(Address(index, 0))
        objects.learn(Address(index, 0), count)
        for sub in range(1, int.from_bytes(count, "little") + 1):
            address = Address(index, sub)
            objects.learn(address, await self._device.read(address))
        return objects

    def _image(self, objects: MappingObjects) -> ProcessImage:
        image = objects.image
        if image is None or not 0 < image.span.quantity <= MAX_READ:
            reason = f"{objects.index:04X}h maps nothing, or nothing that can be placed in registers"
            raise RefusedError(device=self._device.peer.server, address=f"{objects.index:04X}", reason=reason)
        return image

    async def _order(self, image: ProcessImage) -> WordOrder | None:
        """The order of words, None where no value of this moment tells, or where these registers cannot be read."""
        long = [address for address, start, stop in image.slots if stop - start >= 4 and start % 2 == 0]
        for _ in range(ORDER_TRIES):
            for address in long:
                place = image.places[address]
                request = ReadRegisters(place.start, place.quantity)
                answer = await self._device.ask(request, DEFAULT_TIMEOUT_S, what=f"registers from {place.start}")
                if not isinstance(answer, RegistersRead):
                    return None
                order = shown_order(await self._device.read(address), answer.registers)
                if order is not None:
                    return order
        return None


def _window(image: ProcessImage, values: Mapping[Address, bytes]) -> Span:
    """The registers that ``values`` fill. Raises RefusedError where they leave others between them in part or whole."""
    missing = [address for address in values if address not in image.places]
    if missing:
        raise RefusedError(device="", address=missing[0].short, reason="the device does not map it")
    spans = [image.places[address] for address in values]
    start = min(span.start for span in spans)
    quantity = max(span.start + span.quantity for span in spans) - start
    between = [address for address in image.touched(start, quantity) if address not in values]
    if between:
        reason = f"it lies in the same registers as what is written ({_what(values)})"
        raise RefusedError(device="", address=between[0].short, reason=reason)
    return Span(start, quantity)


def _registers(image: ProcessImage, window: Span, values: Mapping[Address, bytes]) -> tuple[int, ...]:
    """The registers of ``window``. Raises RefusedError where a value has another width, or its order is not known."""
    others = {address: bytes(stop - start) for address, start, stop in image.slots}
    try:
        registers = image.registers({**others, **values})
    except ValueError as error:
        raise RefusedError(device="", address=_what(values), reason=str(error)) from error
    first = window.start - image.start
    return registers[first : first + window.quantity]


def _what(addresses: Iterable[Address]) -> str:
    return ", ".join(address.short for address in addresses) or "process data"
