"""One restore that is cut, what is left of it, and both ways out. What is true is looked up in the twins."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Final

import pytest

from app.drivers.contract import LinkState
from app.errors import HubsideError, RestoreOpenError
from app.model.address import parse_address
from app.model.datatypes import Raw
from app.model.restore.plan import Treatment
from app.model.sets import dump_set
from app.model.station import Place
from app.service.connection import Connection
from app.service.records.check import Verdict, check_file
from app.service.records.restore_record import Outcome, RestoreRecord
from app.service.restore.desk import Desk
from app.service.restore.order import Cause
from app.service.restore.survey import survey, targets_of
from app.service.restore.transaction import End
from app.service.stop import Command, command_all
from app.service.stop import Path as Sent
from app.service.write import write_raw
from app.store.database import FILE
from app.store.restore_rows import RestoreState
from tests.restore_cuts.station import PMC, PMM, STATION, Snapshot, Station
from tests.restore_cuts.tool import Tool, changed, connected, order, tool, tool_on
from tests.restore_cuts.trigger import Manner, Trigger
from tests.web.rig import wait_until

NEW: Final[Mapping[Place, Raw]] = {
    Place(slug, parse_address(address)): raw
    for slug, address, raw in (
        # Both ends of the DC link's ladder move, so that neither device is written without regard to the other.
        (PMM, "30FA:01", 540),
        (PMM, "30FA:02", 760),
        (PMM, "30FB:07", 620),
        (PMM, "30FC:01", 690),
        (PMC, "6510:05", 780),
        (PMC, "6065", 150),
        # Only in homing mode: the mode of operation is changed for it, and put back.
        (PMC, "607C", -300),
    )
}
MODE: Final = Place(PMC, parse_address("6060"))
MODE_BEFORE: Final = 1
HOMING: Final = 6
ATTEMPTS: Final = 5
UNANSWERED: Final = (Cause.NO_ANSWER, Cause.UNVERIFIED, Cause.SAVE_FAILED)
POWER_BACK_S: Final = 0.03
Way = Callable[[Connection, str, str], Awaitable[None]]
_ENDED: Final = {RestoreState.DONE: End.NEW, RestoreState.ROLLED_BACK: End.OLD}


class Kind(Enum):
    """What is cut. ``ANSWER``: nothing but a single answer, which comes when nobody waits for it any more."""

    POWER = "power"
    PROCESS = "process"
    CABLE = "cable"
    ANSWER = "answer"


@dataclass(frozen=True, slots=True)
class Cut:
    """Where and how. ``stays_off``: power comes back only when the tool has given up."""

    kind: Kind
    manner: Manner
    at: int
    stays_off: bool = False

    def __str__(self) -> str:
        off = ", stays off" if self.stays_off else ""
        return f"{self.kind.value}, {self.manner.value}, SDO {self.at}{off}"


@dataclass(frozen=True, slots=True)
class Result:
    """What came of a cut. ``happened``: False where the restore was over before. ``sdos``: how many there were."""

    cut: Cut
    happened: bool
    end: End
    sdos: int


class Zygote:
    """Starts tools in processes of their own."""

    def __init__(self) -> None:
        command = [sys.executable, "-m", "tests.restore_cuts.child"]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def start(self, job: Mapping[str, object]) -> int:
        """Its process id."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(job) + "\n")
        self._process.stdin.flush()
        return int(self._read())

    def wait(self) -> None:
        """Until it has ended."""
        assert self._read() == "gone"

    def _read(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline().strip()

    def close(self) -> None:
        """End it."""
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait(10)
        self._process.stdout.close()


class Bench:
    """A station, its set files, and its state before each restore."""

    def __init__(self, station: Station, folder: Path, whole: bool = False) -> None:
        self.station = station
        self.whole = whole
        self._folder = folder
        self._zygote: Zygote | None = None
        self._site = folder / "site.toml"
        self._sets = [folder / "sets" / "pmm.json", folder / "sets" / "pmc.json"]
        self._data = folder / "data"
        self._copy = folder / "copy"
        self._empty = folder / "empty"
        self._before: Snapshot | None = None
        self._lines = AsyncExitStack()
        self._line: Connection | None = None

    async def prepare(self) -> None:
        """Write the files, and take down what the station holds before."""
        station = self.station
        station.settle()
        self._site.write_text(station.site, encoding="utf-8")
        self._sets[0].parent.mkdir()
        async with tool(self._site, self._empty, self.whole) as one:
            found = await survey(one.connection, targets_of(one.connection, STATION), "tester", "as it is")
        for path, slug in zip(self._sets, (PMM, PMC), strict=True):
            new = {place.address: raw for place, raw in NEW.items() if place.slug == slug}
            path.write_text(dump_set(changed(found.sets[slug], new)), encoding="utf-8")
        store = station.devices[PMC].store
        station.do(lambda: store.assign(store.at(MODE.address), MODE_BEFORE))
        self._before = station.snapshot()
        station.put_back(self._before)  # what the maker delivered is in no file yet
        self._old = station.ram(NEW)
        assert self._old == station.memory(NEW), "RAM and memory agree at the beginning"
        assert not any(self._old[place] == raw for place, raw in NEW.items())

    async def sdos_before(self) -> int:
        """How many SDOs there are before a restore begins."""
        async with tool(self._site, self._empty, self.whole) as one:
            with Trigger(self.station, Manner.PLAIN, None, lambda: None) as trigger:
                await one.desk.prepare(one.connection, order(self._sets))
            return trigger.count

    async def close(self) -> None:
        """End connections and processes."""
        await self._hang_up()
        if self._zygote is not None:
            self._zygote.close()

    async def _connection(self) -> Connection:
        """The one that all cuts share after which the tool lives on: it takes longer to make than a restore."""
        if self._line is None:
            made = connected(self._site, self._folder / "recordings", self.whole)
            self._line = await self._lines.enter_async_context(made)
        await _connected(self._line)
        return self._line

    async def _hang_up(self) -> None:
        await self._lines.aclose()
        self._line = None

    # -- the truth -----------------------------------------------------------------------

    def truth(self) -> End:
        """What really stands in RAM and in the files of the memories."""
        ram, memory = self.station.ram(NEW), self.station.memory(NEW)
        if ram == memory == dict(NEW):
            return End.NEW
        return End.OLD if ram == memory == self._old else End.INCOMPLETE

    def others_are_untouched(self) -> bool:
        """Nothing else was changed for good: in RAM, but for values that the devices change themselves."""
        assert self._before is not None
        now = self.station.snapshot()
        for slug, device in self.station.devices.items():
            for address, raw in self._before.ram[slug].items():
                entry, place = device.description.entries[address], Place(slug, address)
                parameter = entry.saved and entry.access.writable and device.store.at(address).source is None
                if parameter and place not in NEW and now.ram[slug][address] != raw:
                    return False
        return True

    # -- one cut -------------------------------------------------------------------------

    async def run(self, cut: Cut) -> Result:
        """Restore, cut, look, and go both ways out where it is incomplete. Raises AssertionError."""
        assert self._before is not None
        self.station.settle()
        self.station.put_back(self._before)
        assert self.truth() is End.OLD
        for folder in (self._data, self._copy):
            shutil.rmtree(folder, ignore_errors=True)
        self._copy.mkdir()
        shutil.copytree(self._empty, self._data)
        return await (self._killed(cut) if cut.kind is Kind.PROCESS else self._cut_off(cut))

    async def _cut_off(self, cut: Cut) -> Result:
        """Power or cable: the tool lives on."""
        async with tool_on(await self._connection(), self._data) as one:
            with Trigger(self.station, cut.manner, cut.at, self._act_of(cut)) as trigger:
                end = await self._restored(one)
            await self._alive()
            assert end is await self._claimed(one.desk), cut
            await self._judged(one, end, cut)
            return Result(cut, trigger.count >= cut.at, end, trigger.count)

    def _act_of(self, cut: Cut) -> Callable[[], None]:
        station = self.station
        if cut.kind is Kind.CABLE:
            return station.pull_cable
        if cut.kind is Kind.ANSWER:
            return lambda: None

        def power() -> None:
            station.cut_power()
            if not cut.stays_off:
                station.line.call_at(station.line.now_ns + int(POWER_BACK_S * 1e9), lambda _t_ns: station.supply())

        return power

    @asynccontextmanager
    async def left_incomplete(self, at: int) -> AsyncIterator[tuple[Tool, str]]:
        """A tool that takes up a restore whose own was killed at an SDO, and the id of that."""
        await self._kill(Cut(Kind.PROCESS, Manner.PLAIN, at))
        async with tool(self._site, self._data, self.whole) as one:
            (row,) = one.desk.open
            yield one, row.id

    async def _restored(self, one: Tool) -> End:
        """A restore with its end. One that could not begin has changed nothing."""
        try:
            prepared = await one.desk.prepare(one.connection, order(self._sets))
            return await one.desk.wait(await one.desk.begin(one.connection, prepared))
        except HubsideError:
            assert not one.desk.open
            return End.OLD

    async def _killed(self, cut: Cut) -> Result:
        """The process of the tool is killed, and another one takes up what it left."""
        count = await self._kill(cut)
        async with tool(self._site, self._data, self.whole) as one:
            end = await self._claimed(one.desk)
            await self._judged(one, end, cut)
        return Result(cut, count >= cut.at, end, count)

    async def _kill(self, cut: Cut) -> int:
        """Have a process restore, and kill it; gives how many SDOs there were."""
        await self._hang_up()  # a second client would pass for another master
        if self._zygote is None:
            self._zygote = Zygote()
        job = {"site": str(self._site), "data": str(self._data), "whole": self.whole}
        pids: list[int] = []

        def kill() -> None:
            with suppress(ProcessLookupError):  # it ended by itself just before
                os.kill(pids[0], signal.SIGKILL)

        with Trigger(self.station, cut.manner, cut.at, kill) as trigger:
            pids.append(self._zygote.start({**job, "sets": [str(path) for path in self._sets]}))
            await asyncio.to_thread(self._zygote.wait)
            await self._alive()
        return trigger.count

    async def _alive(self) -> None:
        """The devices have power, and have finished what they did; an axis that feathered stands."""
        self.station.do(self.station.supply)
        await asyncio.to_thread(self.station.settle)

    # -- what is left --------------------------------------------------------------------

    async def _claimed(self, desk: Desk) -> End:
        """What the tool says of the station."""
        if desk.open:
            return End.INCOMPLETE
        latest = await desk.latest(limit=1)
        return _ENDED[latest[0].state] if latest else End.OLD

    async def _judged(self, one: Tool, end: End, cut: Cut) -> None:
        if end is not End.INCOMPLETE:
            self._holds(end, cut)
            return
        (row,) = one.desk.open
        await _connected(one.connection)
        await _is_shut(one.connection)
        left = self.station.snapshot()
        await one.office.store.back_up(self._copy / FILE)
        await self._gone(one, row.id, one.desk.resume, End.NEW, cut)
        self.station.settle()
        self.station.put_back(left)
        async with tool_on(one.connection, self._copy) as other:  # as another run finds it
            await self._gone(other, row.id, other.desk.roll_back, End.OLD, cut)

    async def _gone(self, one: Tool, restore_id: str, way: Way, goal: End, cut: Cut) -> None:
        """One way out, to its end. Where this computer was too busy to answer in time, the way is still open."""
        for _ in range(ATTEMPTS):
            await way(one.connection, restore_id, "tester")
            if await one.desk.wait(restore_id) is goal:
                self._holds(goal, cut)
                return _tells(await is_recorded(one.desk, restore_id, Outcome(goal.value)), goal)
            outcome = (await one.desk.get(restore_id)).outcome
            del outcome["events"]
            assert Cause(outcome["cause"]) in UNANSWERED, f"{cut}: to {goal.value}, {outcome}"
        raise AssertionError(f"{cut}: to {goal.value}, {ATTEMPTS} times without an answer")

    def _holds(self, end: End, cut: Cut) -> None:
        """The twins hold what the tool says."""
        ram, memory = self.station.ram(NEW), self.station.memory(NEW)
        assert self.truth() is end, f"{cut}: {end.value}, but RAM {_short(ram)}, memory {_short(memory)}"
        assert self.others_are_untouched(), cut
        assert self.station.ram([MODE])[MODE] != HOMING, f"{cut}: the axis was left in homing mode"


async def is_recorded(desk: Desk, restore_id: str, outcome: Outcome) -> RestoreRecord:
    """Its record says so, and is sealed by this installation."""
    sealed, key = await desk.record(restore_id), desk.key()
    assert sealed is not None and key is not None
    checked = check_file(sealed.json.encode(), {key.public: "ours"})
    assert checked.verdict is Verdict.GOOD
    assert checked.record is not None
    assert checked.record.outcome is outcome
    return checked.record


def _tells(record: RestoreRecord, end: End) -> None:
    """What it says of the values is true."""
    written = [row for row in record.rows if row.treatment is Treatment.WRITE]
    assert {(row.device, row.address) for row in written} == {(one.slug, one.address.short) for one in NEW}
    for row in written:
        assert row.now == (row.wanted if end is End.NEW else row.was), row


async def _connected(connection: Connection) -> None:
    """The cable is plugged in again, and the driver has noticed."""
    await wait_until(lambda: all(link.status.state is LinkState.CONNECTED for link in connection.buses.values()))


async def _is_shut(connection: Connection) -> None:
    """Neither device takes a write of anybody; STOP goes through."""
    for slug, address in ((PMM, "3110:01"), (PMC, "6065")):
        target = connection.target(slug)
        with pytest.raises(RestoreOpenError):
            await write_raw(connection.driver(target), target, parse_address(address), 120, connection.journal)
    (stopped,) = await command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
    assert stopped.how is not Sent.FAILED, stopped.error


def _short(values: Mapping[Place, Raw]) -> dict[str, Raw]:
    return {place.address.short: raw for place, raw in values.items()}
