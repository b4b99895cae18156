"""One battery test from the first command to its verdict.

Bit 1 of 3040h rises: the drive arms its test (bit 2 of 3005h). It falls: the test begins (bit 3), or cannot be run (bit
5). Then the drive loads the battery through booster and chopper, and ends by itself with bit 1 and either bit 0 or bit
4. No command of the manual ends it earlier; so whoever cancels only stops watching, and the bit is 0 by then. An armed
test would begin whenever anybody writes 3040h without the bit: between both edges nothing is cancelled, and where the
link is lost just there the bit is taken back as soon as the unit answers again.
"""

from __future__ import annotations

import asyncio
from enum import Enum
from typing import Any, Final

from app.errors import BatteryArmedError, BatteryCommandError, HubsideError, because
from app.service.battery.commands import Edges
from app.service.battery.objects import (
    BATTERY_V,
    BLOCS,
    BOOSTER_A,
    CHARGE_PERCENT,
    CHARGED_TOTAL,
    CHARGER_V,
    CURRENT_MA,
    HEALTH_PERCENT,
    LOWEST_V,
    OFF_LOAD_V,
    RESISTANCE_MOHM,
    TEST_STATUS,
    Command,
    TestStatus,
    bloc_voltages,
    read_number,
    read_numbers,
)
from app.service.battery.records import Figures, Sample, Verdict
from app.service.devices import Target
from app.service.journal import Journal

LONGEST_S: Final = 180.0
"""How long a test takes is not printed; one that goes on for longer has no verdict."""
LOST_S: Final = 10.0
"""A unit that is silent for so long is lost to the test."""
SAMPLE_S: Final = 0.2
MOST_SAMPLES: Final = 1000


class Step(Enum):
    """Where a test stands; the value is the end of its text key ``page.setup.battery.step.…``."""

    ARMING = "arming"
    BEGINNING = "beginning"
    ACTIVE = "active"


async def figures(driver: Any, target: Target) -> Figures:
    """The battery in figures, as the unit says now."""
    wanted = (CHARGED_TOTAL, HEALTH_PERCENT, CHARGE_PERCENT, OFF_LOAD_V, RESISTANCE_MOHM)
    found = await read_numbers(driver, target, wanted)
    return Figures(*(found[one] for one in wanted))


class Sequence:
    """The test of one device. ``begun`` is set once the drive has begun, or has refused to."""

    def __init__(self, driver: Any, target: Target, journal: Journal) -> None:
        self._driver = driver
        self._target = target
        self._edges = Edges(driver, target, journal)
        self._cancelled = asyncio.Event()
        self._began_s = 0.0
        self._blocs = bloc_voltages(0)
        self._seen_active = False
        self.step = Step.ARMING
        self.begun = asyncio.Event()
        self.course: list[Sample] = []

    def cancel(self) -> None:
        """Stop watching. Before anything was sent, nothing is sent any more."""
        self._cancelled.set()

    @property
    def took_ms(self) -> int:
        """Time since it began; 0 before."""
        return 0 if not self._began_s else round(1000 * (asyncio.get_running_loop().time() - self._began_s))

    async def run(self) -> Verdict:
        """Arm, begin, watch. Raises BatteryCommandError, BatteryArmedError, and what a write raises."""
        self._blocs = bloc_voltages(await read_number(self._driver, self._target, BLOCS))
        if self._cancelled.is_set():
            return Verdict.UNWATCHED
        if not await self._status() & TestStatus.STARTED or not await self._edges.is_set(Command.TEST):
            await self._arm()
        self.step = Step.BEGINNING
        await self._begin()
        self.step = Step.ACTIVE
        self._began_s = asyncio.get_running_loop().time()
        self.begun.set()
        return await self._watch()

    async def _arm(self) -> None:
        """Let the bit rise. One without effect is taken back; raises BatteryArmedError where it may stay."""
        try:
            await self._edges.rise(Command.TEST, lambda: self._has(TestStatus.STARTED))
        except BatteryCommandError:
            await self._edges.fall(Command.TEST)
            raise
        except HubsideError as error:
            if self._edges.sent:
                raise BatteryArmedError(**(because(error) | {"device": self._target.slug})) from error
            raise

    async def _begin(self) -> None:
        """Let the bit fall; on a lost link again and again until the unit answers. Raises BatteryArmedError."""
        loop = asyncio.get_running_loop()
        end_s = loop.time() + LOST_S
        while True:
            try:
                await self._edges.fall(Command.TEST, self._has_begun)
                return
            except BatteryCommandError:
                raise
            except HubsideError as error:
                if loop.time() >= end_s:
                    raise BatteryArmedError(**(because(error) | {"device": self._target.slug})) from error
            await asyncio.sleep(SAMPLE_S)

    async def _watch(self) -> Verdict:
        loop = asyncio.get_running_loop()
        heard_s = loop.time()
        while True:
            status = await self._sample()
            now_s = loop.time()
            if status is not None:
                heard_s = now_s
                verdict = _verdict(status, self._seen_active)
                if verdict is not None:
                    return verdict
            if self._cancelled.is_set():
                return Verdict.UNWATCHED
            if now_s - heard_s > LOST_S:
                return Verdict.LOST
            if now_s - self._began_s > LONGEST_S:
                return Verdict.TIMED_OUT
            await self._pause()

    async def _pause(self) -> None:
        try:
            await asyncio.wait_for(self._cancelled.wait(), SAMPLE_S)
        except TimeoutError:
            return

    async def _sample(self) -> int | None:
        """Measure once; the test's status, read last, so that the course holds what led to it."""
        wanted = (BATTERY_V, CHARGER_V, LOWEST_V, CURRENT_MA, BOOSTER_A, *self._blocs, TEST_STATUS)
        found = await read_numbers(self._driver, self._target, wanted)
        if found[BATTERY_V] is not None and len(self.course) < MOST_SAMPLES:
            blocs = tuple(found[one] for one in self._blocs)
            sample = Sample(
                t_ms=self.took_ms,
                battery_v=found[BATTERY_V],
                charger_v=found[CHARGER_V],
                lowest_v=found[LOWEST_V],
                current_ma=found[CURRENT_MA],
                booster_a=found[BOOSTER_A],
                blocs_mv=blocs,
            )
            self.course.append(sample)
        status = found[TEST_STATUS]
        self._see(status)
        return status

    async def _status(self) -> int:
        status = await read_number(self._driver, self._target, TEST_STATUS)
        self._see(status)
        return status

    def _see(self, status: int | None) -> None:
        """A test that ran before the one that is begun here does not count."""
        if self.step is not Step.ARMING and status is not None and status & TestStatus.ACTIVE:
            self._seen_active = True

    async def _has(self, bit: TestStatus) -> bool:
        return bool(await self._status() & bit)

    async def _has_begun(self) -> bool:
        """Any bit but ``STARTED`` alone: it runs, has ended, or cannot be run."""
        status = await self._status()
        return bool(status & ~TestStatus.STARTED) and not status & TestStatus.STARTED


def _verdict(status: int, seen_active: bool) -> Verdict | None:
    """What 3005h says of a test that was begun; None while it runs."""
    if status & TestStatus.ACTIVE:
        return None
    if status & TestStatus.IMPOSSIBLE:
        return Verdict.BROKEN_OFF if seen_active else Verdict.REFUSED
    if not status & TestStatus.FINISHED:
        return None
    if status & TestStatus.ERROR:
        return Verdict.FAILED
    return Verdict.PASSED if status & TestStatus.OK else None
