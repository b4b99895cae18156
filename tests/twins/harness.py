"""A CANopen master on a simulated line with a virtual clock: speaks SDO, NMT, SYNC and PDO, and keeps what it hears."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from app.model.address import Address, Addressing, parse_address
from app.model.datatypes import DataType, Raw
from app.model.description import Access, Bus, Description, Entry, Kind, Match, SaveCommand
from app.twins import sdo_block
from app.twins.line import CanLine
from app.wire import sdo
from app.wire.frame import Can
from app.wire.nmt import NmtCommand, nmt_message

MS = 1_000_000
SECOND = 1_000_000_000


class AbortedError(Exception):
    """The device aborted a transfer."""

    def __init__(self, code: int) -> None:
        super().__init__(f"{code:08X}h")
        self.code = code


@dataclass(frozen=True)
class Heard:
    """A frame on the line and when it was complete."""

    t_ns: int
    can: Can


class Master:
    """Hangs on the line and waits in virtual time."""

    def __init__(self, line: CanLine) -> None:
        self.line = line
        self.heard: list[Heard] = []
        self.port = line.attach(lambda can, t_ns: self.heard.append(Heard(t_ns, can)))

    def run(self, duration_ns: int) -> None:
        self.line.run_until(self.line.now_ns + duration_ns)

    def wait(self, wanted: Callable[[Can], bool], timeout_ns: int = 5 * SECOND, since: int | None = None) -> Heard:
        """The first frame that is wanted, among those from place ``since`` on, or later ones."""
        place = len(self.heard) if since is None else since
        end_ns = self.line.now_ns + timeout_ns
        while True:
            while place < len(self.heard):
                if wanted(self.heard[place].can):
                    return self.heard[place]
                place += 1
            if self.line.now_ns >= end_ns:
                raise TimeoutError
            self.line.run_until(min(self.line.now_ns + MS, end_ns))

    def until(self, condition: Callable[[], bool], timeout_ns: int = 60 * SECOND, step_ns: int = 5 * MS) -> None:
        """Let time pass until a condition holds."""
        end_ns = self.line.now_ns + timeout_ns
        while not condition():
            if self.line.now_ns >= end_ns:
                raise TimeoutError
            self.run(step_ns)

    def wait_id(self, can_id: int, timeout_ns: int = 5 * SECOND, since: int | None = None) -> Heard:
        return self.wait(lambda can: can.can_id == can_id, timeout_ns, since)

    def send(self, can_id: int, data: bytes = b"", *, remote: bool = False, dlc: int = -1) -> None:
        self.port.send(Can(can_id, data, remote=remote, dlc=dlc))

    def nmt(self, command: NmtCommand, node: int) -> None:
        self.send(0, nmt_message(command, node))

    def all_of(self, can_id: int, since_ns: int = 0) -> list[Heard]:
        return [heard for heard in self.heard if heard.can.can_id == can_id and heard.t_ns >= since_ns]

    # -- SDO --------------------------------------------------------------------

    def exchange(self, node: int, data: bytes, timeout_ns: int = 5 * SECOND) -> bytes:
        """One request frame and its answer; an abort is raised."""
        place = len(self.heard)
        self.send(sdo.REQUEST_BASE + node, data)
        answer = self.wait_id(sdo.RESPONSE_BASE + node, timeout_ns, place).can.data
        if answer[0] == 0x80:
            raise AbortedError(int.from_bytes(answer[4:], "little"))
        return answer

    def read(self, node: int, where: str) -> bytes:
        address = parse_address(where)
        first = sdo.multiplexed(self.exchange(node, sdo.upload_request(address)))
        assert first.address == address
        data = sdo.expedited_data(first)
        if data is not None:
            return data
        collected, toggle = b"", False
        while True:
            piece = sdo.segment(self.exchange(node, sdo.upload_segment_request(toggle)))
            assert piece.toggle == toggle
            collected += piece.data
            toggle = not toggle
            if piece.last:
                assert len(collected) == sdo.announced_size(first)
                return collected

    def number(self, node: int, where: str, *, signed: bool = False) -> int:
        return int.from_bytes(self.read(node, where), "little", signed=signed)

    def write(self, node: int, where: str, data: bytes, timeout_ns: int = 5 * SECOND) -> None:
        address = parse_address(where)
        self.exchange(node, sdo.download_request(address, data), timeout_ns)
        if 0 < len(data) <= 4:
            return
        toggle = False
        for start in range(0, max(len(data), 1), 7):
            last = start + 7 >= len(data)
            answer = self.exchange(node, sdo.download_segment_request(data[start : start + 7], toggle, last))
            assert answer[0] == 0x20 | toggle << 4
            toggle = not toggle

    def put(self, node: int, where: str, number: int, size: int, *, signed: bool = False) -> None:
        self.write(node, where, number.to_bytes(size, "little", signed=signed))

    def refused(self, action: Callable[[], object]) -> int:
        """The abort code of what must be refused."""
        try:
            action()
        except AbortedError as error:
            return error.code
        raise AssertionError("it was not refused")

    def block_read(self, node: int, where: str, block_size: int = 127) -> bytes:
        address = parse_address(where)
        head = bytes([0xA4, address.major & 0xFF, address.major >> 8, address.minor, block_size, 0, 0, 0])
        first = self.exchange(node, head)
        size = int.from_bytes(first[4:], "little")
        collected = b""
        place = len(self.heard)
        self.send(sdo.REQUEST_BASE + node, bytes([0xA3]) + bytes(7))
        while True:
            sequence = 0
            while sequence < block_size:
                answer = self.wait_id(sdo.RESPONSE_BASE + node, since=place)
                place = self.heard.index(answer, place) + 1
                sequence += 1
                assert answer.can.data[0] & 0x7F == sequence
                collected += answer.can.data[1:]
                if answer.can.data[0] & 0x80:
                    break
            place = len(self.heard)
            self.send(sdo.REQUEST_BASE + node, bytes([0xA2, sequence, block_size]) + bytes(5))
            if answer.can.data[0] & 0x80:
                break
        end = self.wait_id(sdo.RESPONSE_BASE + node, since=place).can.data
        assert end[0] & 0xE3 == 0xC1
        collected = collected[: len(collected) - (end[0] >> 2 & 7)]
        assert len(collected) == size
        assert int.from_bytes(end[1:3], "little") == sdo.crc(collected)
        self.send(sdo.REQUEST_BASE + node, bytes([0xA1]) + bytes(7))
        self.run(2 * MS)
        return collected

    def block_write(self, node: int, where: str, data: bytes, *, crc: int | None = None, lose: int = 0) -> None:
        """Block download; segment number ``lose`` of the first block is left out once."""
        address = parse_address(where)
        head = bytes([0xC6, address.major & 0xFF, address.major >> 8, address.minor]) + len(data).to_bytes(4, "little")
        self.exchange(node, head)
        pieces = [data[start : start + 7] for start in range(0, len(data), 7)]
        done = 0
        while done < len(pieces):
            block = pieces[done : done + sdo_block.MAX_BLOCK]
            place = len(self.heard)
            for number, piece in enumerate(block, 1):
                last = done + number == len(pieces)
                if number != lose:
                    self.send(sdo.REQUEST_BASE + node, sdo_block.segment(number, piece, last))
            lose = 0
            answer = self.wait_id(sdo.RESPONSE_BASE + node, since=place).can.data
            if answer[0] == 0x80:
                raise AbortedError(int.from_bytes(answer[4:], "little"))
            assert answer[0] == 0xA2
            done += answer[1]
        unused = -len(data) % 7
        check = sdo.crc(data) if crc is None else crc
        self.exchange(node, bytes([0xC1 | unused << 2]) + check.to_bytes(2, "little") + bytes(5))


def entry(where: str, data_type: DataType, access: Access = Access.RW, **more: object) -> Entry:
    """An entry for a small description of its own."""
    address = parse_address(where)
    made = Entry(
        address=address,
        name=f"object {where}",
        object_name=f"object {where}",
        kind=Kind.VAR if ":" not in where else Kind.RECORD,
        type=data_type,
        access=access,
        pdo=False,
        default=None,
        saved=False,
        group="test",
        section="",
    )
    return replace(made, **more)  # type: ignore[arg-type]


def description(*entries: Entry, save: tuple[SaveCommand, ...] = ()) -> Description:
    """A small description of the given entries."""
    return Description(
        id="test-device",
        version="1",
        name="Test device",
        vendor="",
        bus=Bus.CANOPEN,
        addressing=Addressing.OD,
        manual="",
        match=Match(),
        entries={made.address: made for made in sorted(entries, key=lambda made: made.address)},
        groups=("test",),
        bit_tables={},
        enumerations={},
        errors={},
        save=save,
        load=(),
    )


def raw_of(values: dict[Address, Raw], where: str) -> Raw:
    return values[parse_address(where)]
