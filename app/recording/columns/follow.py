"""Follows one bus block by block and finds the values of chosen objects, exactly as ``CanOpenDecoder`` sees them.

PDOs and emergency messages change nothing in the decoder, so they are read by columns, by the identifiers and mappings
in force. The decoder itself is fed only with what may change these: NMT commands, boot-ups, heartbeats of the nodes
looked at, and SDO transfers that configure frames. Of the other SDO traffic only transfers of the wanted objects
matter. Most of them are a request with its expedited answer as the next frame of that server, both whole: whatever
was open before, they begin anew and end at once, so they are read by columns too. All others are fed to the decoder,
frame by frame, from their first request to where the server is idle again; what passes between, it need not see:

- An address gets into a record only by the request that opened its transfer.
- A request opens a transfer whatever was open before, except within the data of a block download: so every block
  download is followed, whatever its object.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from heapq import heapify, heappop, heappush
from typing import Final, NamedTuple

import numpy as np

from app.model.address import Address
from app.recording.can_table import Block, Bytes, Flags, Rows, Words
from app.recording.columns.blocks import Prepared
from app.recording.columns.exchanges import Exchanges, Stream, clean_exchanges
from app.recording.columns.listening import EXTENDED, Digest, Field, Kind, Listening, Wanted, key
from app.recording.columns.values import Gathered
from app.wire.decoder import ERROR_REGISTER, CanOpenDecoder
from app.wire.nmt import MAX_NODE, NmtState
from app.wire.records import Source, ValueSeen

_EMCY_BYTES: Final = 8
_REGISTER_BIT: Final = 16
"""Where the error register stands in an emergency message."""
_STATE: Final = 0x7F
_STEP: Final = 1024
"""Rows that are looked at after identifiers changed; twice as many each time they stay."""
_UNKNOWN: Final = 255
_IN_DIGEST: Final = 0
"""Stands in for a node where a frame is of no SDO stream."""
_Found = Mapping[tuple[int, Address], Gathered]


class BusFollower:
    """Finds the values of the ``wanted`` objects on the bus of ``decoder``."""

    def __init__(self, decoder: CanOpenDecoder, wanted: Wanted) -> None:
        self.found: _Found = {each: Gathered() for each in wanted.objects}
        self._decoder = decoder
        self._wanted = wanted
        self._listening = Listening(decoder, wanted)
        self._open = {node for node in range(1, MAX_NODE + 1) if decoder.sdo(node).address is not None}

    def prepare(self, block: Block) -> Block:
        """Look for what matters; called ahead by other threads."""
        return Prepared(block, self._listening.digest(block))

    def take(self, block: Block) -> None:
        """The next block of the bus."""
        note = block.note if isinstance(block, Prepared) else None
        start = 0
        step = size = len(block.t_ns)
        while start < size:
            part = block.part(start, min(start + step, size)) if start else block
            digest = note if not start and note is not None and note.listening is self._listening else None
            piece = _Piece(part, digest or self._listening.digest(part), self._decoder, self._open, self.found)
            start += piece.run()
            step *= 2
            if not self._listening.holds(self._decoder):
                self._listening = Listening(self._decoder, self._wanted)
                step = _STEP  # changes come together: the rest would be looked at in vain


class _Turn(NamedTuple):
    """A frame that the decoder must see: its row, and its position in the stream of ``node``, or in the digest."""

    row: int
    node: int
    position: int


class _Piece:
    """Frames of a block, from where the identifiers have the meaning of ``digest`` to where that may change."""

    def __init__(
        self, block: Block, digest: Digest, decoder: CanOpenDecoder, still_open: set[int], found: _Found
    ) -> None:
        self._block = block
        self._digest = digest
        self._listening = digest.listening
        self._decoder = decoder
        self._open = still_open
        self._found = found
        self._streams: dict[int, Stream] = {}
        self._fed: dict[int, Flags] = {}
        self._exchanges: dict[int, Exchanges] = {}
        self._taking: dict[int, list[tuple[int, bool]]] = {}

    def run(self) -> int:
        """Find the values; how many rows are done."""
        for node in self._listening.wanted.nodes:
            if 1 <= node <= MAX_NODE:
                self._taking[node] = [(-1, self._takes_pdos(node))]
        turns = [*self._services(), *self._openers(), *self._continued()]
        end = self._feed(turns) if turns else len(self._block.t_ns)
        self._read_pdos(end)
        self._read_emcy(end)
        for node in self._exchanges:
            self._read_exchanges(node, end)
        for gathered in self._found.values():
            gathered.next_block()
        return end

    # -- what the decoder must see ---------------------------------------------

    def _services(self) -> Iterator[_Turn]:
        """NMT commands, boot-ups, and all heartbeats of the nodes looked at."""
        digest, columns = self._digest, self._digest.columns
        services = np.flatnonzero(digest.kinds & (Kind.NMT | Kind.HEARTBEAT))
        if not len(services):
            return
        commands = digest.kinds[services] == Kind.NMT
        states = columns.data[services, 0] & _STATE
        nodes = self._listening.nodes[columns.can_id[services]]
        keep = commands | (states == NmtState.BOOT_UP)
        for node in self._taking:
            beats = np.flatnonzero((nodes == node) & ~commands)
            keep[beats] |= True if commands.any() else self._news(node, services[beats], states[beats])
        services = services[keep]
        for row, position in zip(digest.rows[services].tolist(), services.tolist(), strict=True):
            yield _Turn(row, _IN_DIGEST, position)

    def _news(self, node: int, places: Rows, states: Bytes) -> Flags:
        """Which heartbeats may change what is known of a node, as long as nobody commands: those unlike the last."""
        columns = self._digest.columns
        sound = columns.plain[places] & (columns.lengths[places] == 1)
        known = self._decoder.state(node)
        before = np.concatenate(([_UNKNOWN if known is None else int(known)], states[:-1]))
        steady: Flags = sound & (states == before)
        steady[1:] &= sound[:-1]
        return ~steady

    def _openers(self) -> Iterator[_Turn]:
        """Requests of interest that are not answered at once; the others are kept as exchanges."""
        digest = self._digest
        requests = np.flatnonzero((digest.kinds == Kind.REQUEST) & digest.columns.plain)
        if not len(requests):
            return
        nodes = self._listening.nodes[digest.columns.can_id[requests]]
        for node in np.unique(nodes).tolist():
            stream = self._stream(node)
            positions = np.searchsorted(stream.rows, digest.rows[requests[nodes == node]])
            clean = clean_exchanges(stream, positions, self._boots(node), self._listening.wanted)
            self._exchanges[node] = clean
            for position in np.setdiff1d(positions, clean.positions, assume_unique=True).tolist():
                yield _Turn(int(stream.rows[position]), node, position)

    def _continued(self) -> Iterator[_Turn]:
        """Transfers that were open before."""
        for node in self._open:
            stream = self._stream(node)
            if len(stream.rows):
                yield _Turn(int(stream.rows[0]), node, 0)

    def _stream(self, node: int) -> Stream:
        stream = self._streams.get(node)
        if stream is None:
            stream = self._streams[node] = Stream.of(self._block, self._listening, node)
            self._fed[node] = np.zeros(len(stream.rows), dtype=np.bool_)
        return stream

    def _boots(self, node: int) -> Rows:
        """Rows at which the node may have started anew."""
        digest, columns = self._digest, self._digest.columns
        beats = (digest.kinds == Kind.HEARTBEAT) & (self._listening.nodes.take(columns.can_id, mode="clip") == node)
        rows: Rows = digest.rows[beats & (columns.data[:, 0] & _STATE == NmtState.BOOT_UP)]
        return rows

    def _takes_pdos(self, node: int) -> bool:
        return self._decoder.state(node) in (None, NmtState.OPERATIONAL)

    def _feed(self, turns: list[_Turn]) -> int:
        """Feed the decoder in order, each SDO stream until its server is idle. Where identifiers change it ends."""
        end, touched = len(self._block.t_ns), set(self._open)
        heapify(turns)
        while turns:
            turn = heappop(turns)
            if turn.node == _IN_DIGEST:
                self._feed_service(turn)
            elif not self._fed[turn.node][turn.position]:
                touched.add(turn.node)
                if self._feed_sdo(turn) and turn.position + 1 < len(self._fed[turn.node]):
                    row = int(self._streams[turn.node].rows[turn.position + 1])
                    heappush(turns, _Turn(row, turn.node, turn.position + 1))
            if not self._listening.holds(self._decoder):
                end = turn.row + 1
                touched |= self._ask_over(end)
                break
        self._open.clear()
        self._open.update(node for node in touched if self._decoder.sdo(node).address is not None)
        return end

    def _feed_service(self, turn: _Turn) -> None:
        self._decoder.feed(self._digest.columns.frame(turn.position))
        for node, states in self._taking.items():
            takes = self._takes_pdos(node)
            if takes is not states[-1][1]:
                states.append((turn.row, takes))

    def _feed_sdo(self, turn: _Turn) -> bool:
        """Feed one frame of a stream and keep what it tells; whether the transfer goes on."""
        self._fed[turn.node][turn.position] = True
        for record in self._decoder.feed(self._streams[turn.node].columns.frame(turn.position)):
            if isinstance(record, ValueSeen):
                gathered = self._found.get((record.node, record.address))
                if gathered is not None:
                    gathered.add_one(turn.row, record.t_ns, record.data, record.source)
        return self._decoder.sdo(turn.node).address is not None

    def _ask_over(self, end: int) -> set[int]:
        """Of exchanges whose answer comes behind ``end``, let the decoder see the request; the nodes concerned."""
        nodes = set()
        for node, exchanges in self._exchanges.items():
            stream = self._streams[node]
            asks, answers = exchanges.positions, exchanges.positions + 1
            cut = (stream.rows[asks] < end) & (stream.rows[answers] >= end) & ~self._fed[node][asks]
            for position in asks[cut].tolist():
                columns = stream.columns
                can, t_ns = columns.can(position), int(columns.t_ns[position])
                self._decoder.sdo(node).request(t_ns, columns.direction(position), can.can_id, can.data)
                nodes.add(node)
        return nodes

    # -- what is read by columns -----------------------------------------------

    def _read_pdos(self, end: int) -> None:
        digest, columns = self._digest, self._digest.columns
        places = np.flatnonzero((digest.kinds == Kind.PDO) & ~(columns.remote | columns.error) & (digest.rows < end))
        if not len(places):
            return
        ids, extended = columns.can_id[places], columns.extended[places]
        words, lengths = columns.words, columns.lengths
        for can_id, fields in self._listening.fields.items():
            these = places[(ids == can_id & ~EXTENDED) & (extended == bool(can_id & EXTENDED))]
            for field in fields:
                self._read_field(these[lengths[these] >= field.pdo_size], words, field)

    def _read_field(self, places: Rows, words: Words, field: Field) -> None:
        if field.source is Source.PDO_RX:
            places = places[self._taken(field.node, self._digest.rows[places])]
        rows, t_ns = self._digest.rows[places], self._digest.columns.t_ns[places]
        if field.bits:
            raw = words[places] >> np.uint64(field.position) & np.uint64((1 << field.bits) - 1)
        else:
            raw = np.zeros(len(places), dtype=np.uint64)
        self._found[field.node, field.address].add(rows, t_ns, raw, (field.bits + 7) // 8, field.source)

    def _taken(self, node: int, rows: Rows) -> Flags:
        """At which rows the node takes PDOs: when operational, or as long as nothing tells its state."""
        since, takes = zip(*self._taking[node], strict=True)
        flags: Flags = np.array(takes)[np.searchsorted(np.array(since), rows, side="left") - 1]
        return flags

    def _read_emcy(self, end: int) -> None:
        digest, columns = self._digest, self._digest.columns
        for node in self._listening.wanted.nodes:
            gathered = self._found.get((node, ERROR_REGISTER))
            if gathered is None:
                continue
            mine = (digest.kinds == Kind.EMCY) & (self._listening.nodes.take(columns.can_id, mode="clip") == node)
            whole = columns.plain & (columns.lengths == _EMCY_BYTES) & (digest.rows < end)
            places = np.flatnonzero(mine & whole)
            register = columns.words[places] >> np.uint64(_REGISTER_BIT) & np.uint64(0xFF)
            gathered.add(digest.rows[places], columns.t_ns[places], register, 1, Source.EMCY)

    def _read_exchanges(self, node: int, end: int) -> None:
        exchanges, stream = self._exchanges[node], self._streams[node]
        done = (stream.rows[exchanges.positions + 1] < end) & ~self._fed[node][exchanges.positions]
        for mux in np.unique(exchanges.muxes[done]).tolist():
            wanted = self._listening.wanted.by_key.get(key(node, mux))
            for writes, source in ((False, Source.SDO_READ), (True, Source.SDO_WRITE)):
                these = done & (exchanges.muxes == mux) & (exchanges.writes == writes)
                if wanted is not None and these.any():
                    answers = exchanges.positions[these] + 1
                    rows, t_ns = stream.rows[answers], stream.columns.t_ns[answers]
                    self._found[wanted].add(rows, t_ns, exchanges.words[these], exchanges.size[these], source)
