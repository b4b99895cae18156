"""Cyclic synchronous position (mode 8): a test signal is sent to an axis as targets at a steady rate while it is held.

Targets come every 50 ms from the same event loop that looks after the dead man: what holds up the one holds up the
other, and a drive that hears no other target stands at the last one. Faster would be no smoother: a target is a whole
number of 0.01 degrees, which every 10 ms would be steps of 1 degree/s. 60C2h gets 56 ms, so that a target that is a
little late finds the axis still on its way.

By a PDO where one can bring targets (``borrowed``), else by SDO: at this rate a busy bus carries that too. A tick that
is late is counted, and those after it move on with it: targets are never bunched, and the signal never jumps.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Final

from app.drivers.contract import Driver
from app.errors import AxisStateError, HubsideError, OvertakenError, PreconditionError
from app.model.address import Address, parse_address
from app.model.axis_state import AxisState
from app.model.checks import Allow
from app.model.description import Verify
from app.model.values import quantity_of
from app.service.devices import Target, decode
from app.service.journal import Journal
from app.service.motion.borrowed import TARGET, Borrowed, PdoFound
from app.service.motion.control import AxisMode, Control, Word, cia402
from app.service.motion.courses import CURRENT, FOLLOWING, POSITION, VELOCITY, Courses
from app.service.motion.desk import MotionDesk
from app.service.motion.moves import come_to_rest
from app.service.motion.running import STOPPING, Doing, Ended, Running
from app.service.motion.signals import MOST_DPS, DriveLimits, Shape, Signal, check
from app.service.stop import CONTROLWORD, STATUSWORD
from app.service.write import know_what_it_rests_on, write_raw
from app.wire import pdo
from app.wire.frame import Can
from app.wire.nmt import NmtState

SEND_S: Final = 0.05
INTERPOLATION_MS: Final = 56
PROFILE_VELOCITY: Final = Address(0x6081)
OFFSETS: Final = (Address(0x60B0), Address(0x60B1))
IN_FORCE: Final = tuple(
    map(
        parse_address,
        (
            *("60FB:01", "60FB:02", "60F9:01", "60F9:02", "60F9:03", "60F9:04", "60F9:05", "607D:01", "607D:02"),
            *("607F", "6080", "6083", "6084", "60C5", "60C6", "6065", "6066", "6067", "6073", "606A", "60B0", "60B1"),
        ),
    )
)
"""What decides how an axis follows; kept with each run."""
_LOOK_S: Final = 0.04
_SAMPLE_S: Final = 0.01
_FOLLOWING_OFF: Final = 0xFFFFFFFF


class Transport(Enum):
    """How targets reach the axis; the value is the end of the text key ``page.signal.transport.…``."""

    PDO = "pdo"
    SDO = "sdo"


@dataclass
class Played:
    """One run as it was made. Times in t_ns; ``raws`` of ``IN_FORCE`` as they were read before."""

    device: str
    signal: Signal
    limits: DriveLimits
    raws: Mapping[Address, int]
    start_deg: float = 0.0
    begun_ns: int | None = None
    transport: Transport = Transport.SDO
    sent: int = 0
    late: int = 0
    why: Ended = Ended.FAILED
    error: str | None = None
    courses: Courses | None = field(default=None, repr=False)


async def play(desk: MotionDesk, slug: str, fence: int, signal: Signal, journal: Journal) -> Played:
    """Send a signal to a prepared axis as long as it is held. Whatever ended it is in the result, where it had begun.

    Raises LimitError before anything is sent, PreconditionError where 60B0h or 60B1h shift the target, and what
    ``MotionDesk.move`` raises where it had not begun.
    """
    desk.lease.check(fence)
    target = desk.connection.target(slug)
    driver = desk.connection.driver(target)
    before = driver.commanded(target.node, CONTROLWORD)
    played = await look(driver, target, signal)
    if driver.commanded(target.node, CONTROLWORD) != before:  # a STOP that was pressed meanwhile
        raise OvertakenError(address=CONTROLWORD.short, node=target.node)

    async def work(running: Running) -> None:
        run = _Run(desk, running, played, journal)
        with Courses(desk.connection.buses[target.device.bus], target) as played.courses:
            await run.run()

    try:
        await desk.move(slug, fence, Doing.SIGNAL, work)
    except HubsideError as error:
        if played.begun_ns is None:
            raise
        played.error = error.code
    last = desk.last
    if last is not None and last.slug == slug:
        played.why = last.why
    return played


async def look(driver: Driver, target: Target, signal: Signal) -> Played:
    """What decides how the axis follows, and whether it may do so. Raises LimitError, PreconditionError."""
    for address in (TARGET, POSITION, PROFILE_VELOCITY):
        await know_what_it_rests_on(driver, target, target.entry(address))
    answers = await driver.read_many(target.node, (*IN_FORCE, POSITION))
    raws: dict[Address, int] = {}
    for address, data in answers.items():
        if isinstance(data, HubsideError):
            raise data
        raw = decode(target.entry(address), data)
        raws[address] = raw if isinstance(raw, int) else 0
    for address in OFFSETS:
        if raws[address]:
            raise PreconditionError(
                address=TARGET.short, name=target.entry(TARGET).title, needs=f"{address.short} = 0", found=raws[address]
            )
    position = raws.pop(POSITION)
    played = Played(target.slug, signal, limits_of(raws, degrees_per_unit(target), signal), raws)
    played.start_deg = position * degrees_per_unit(target)
    check(signal, played.start_deg, played.limits)
    return played


def degrees_per_unit(target: Target) -> float:
    """Degrees of one unit of a position."""
    return float(quantity_of(target.entry(TARGET), target.lookup).scale)


def limits_of(raws: Mapping[Address, int], scale: float, signal: Signal) -> DriveLimits:
    """The limits in force, with 6081h as the run sets it."""

    def of(text: str) -> int:
        return raws[parse_address(text)]

    deceleration = of("6084") or of("6083")
    if of("60C6"):
        deceleration = min(deceleration, of("60C6"))
    return DriveLimits(
        low_deg=of("607D:01") * scale,
        high_deg=of("607D:02") * scale,
        velocity_dps=min(of("607F") * scale, most_dps(signal)),
        acceleration_dps2=min(of("6083"), of("60C5")) * scale,
        deceleration_dps2=deceleration * scale,
        following_deg=None if of("6065") == _FOLLOWING_OFF else of("6065") * scale,
        gain_per_s=float(of("60FB:01")),
        precontrol=of("60FB:02") / 1000,
        window_deg=of("6067") * scale,
    )


def most_dps(signal: Signal) -> float:
    """6081h of the run: the speed of a step, else the fastest by hand, which leaves room to catch up."""
    return min(signal.speed_dps, MOST_DPS) if signal.shape is Shape.STEP else MOST_DPS


class _Run:
    """From the drive without power to the drive without power."""

    def __init__(self, desk: MotionDesk, running: Running, played: Played, journal: Journal) -> None:
        self._desk = desk
        self._running = running
        self._control: Control = cia402(running.control)
        self._target = running.control.target
        self._played = played
        self._journal = journal
        self._borrowed = Borrowed(cia402(running.control), desk.left, journal)
        self._scale = degrees_per_unit(self._target)
        self._pdo: PdoFound | None = None
        self._beside: dict[Address, bytes] = {}
        self._start = 0

    async def run(self) -> None:
        """Borrow, enable where the blade stands, play, come to rest, put back. Raises what any of it raises."""
        try:
            await self._control.switch_off()
            samples = await self._borrow()
            await self._control.set_mode(AxisMode.CYCLIC_POSITION)
            await self._stand_here()
            if self._running.over.is_set():
                return
            await self._control.enable()
            await self._stand_here()
            if self._running.over.is_set():
                return
            self._running.turning = True
            await self._control.say(Word.RUN)
            measuring = asyncio.create_task(self._measure(samples))
            try:
                await self._play()
            finally:
                measuring.cancel()
                await asyncio.gather(measuring, return_exceptions=True)
        finally:
            try:
                await self._come_to_rest()
            finally:
                await self._borrowed.put_back()

    async def _borrow(self) -> PdoFound | None:
        """Settings of the run; the PDO that samples, if there is one."""
        await self._borrowed.number(Address(0x60C2, 2), -3)
        await self._borrowed.number(Address(0x60C2, 1), INTERPOLATION_MS)
        await self._borrowed.number(PROFILE_VELOCITY, round(self._played.limits.velocity_dps / self._scale))
        samples = await self._borrowed.sample_pdo()
        self._pdo = await self._borrowed.target_pdo()
        if self._pdo is not None:
            self._played.transport = Transport.PDO
            beside = self._pdo.carried - {TARGET}
            for address, data in (await self._control.driver.read_many(self._target.node, sorted(beside))).items():
                if isinstance(data, HubsideError):
                    raise data
                self._beside[address] = data
        return samples

    async def _stand_here(self) -> None:
        """The target becomes where the blade is: without halt the axis goes to it without a ramp (manual, 5.12).

        It has moved a little since the limits were looked at, by the brake. Raises LimitError.
        """
        self._control.require_own()
        self._start = await self._control.number(POSITION)
        self._played.start_deg = self._start * self._scale
        check(self._played.signal, self._played.start_deg, self._played.limits)
        control = self._control
        await write_raw(control.driver, self._target, TARGET, self._start, self._journal, allow=Allow.MOTION)

    async def _play(self) -> None:
        loop, signal = asyncio.get_running_loop(), self._played.signal
        self._played.begun_ns = self._desk.now_ns()
        due_s, ticks = loop.time(), round(signal.duration_s / SEND_S)
        for tick in range(ticks + 1):
            if await self._over_before(due_s):
                return
            late_s = loop.time() - due_s
            if late_s > SEND_S / 2:
                self._played.late += 1
                due_s += late_s
            await self._send(self._start + round(signal.offset_deg(tick * SEND_S) / self._scale))
            self._played.sent += 1
            due_s += SEND_S
        if not await self._over_before(due_s):
            self._running.end(Ended.DONE)

    async def _over_before(self, due_s: float) -> bool:
        """Wait until it is time; whether it has ended by then. Raises AxisStateError where the axis has a fault."""
        with suppress(TimeoutError):
            async with asyncio.timeout_at(due_s):
                await self._running.over.wait()
        if self._running.over.is_set():
            return True
        if self._control.overtaken:
            self._running.end(Ended.STOPPED)
            return True
        status = self._target.lookup(STATUSWORD)
        state = AxisState.of(status) if isinstance(status, int) else None
        if state in (AxisState.FAULT, AxisState.FAULT_REACTION_ACTIVE):
            raise AxisStateError(
                device=self._target.slug, state_key=state.text_key, wanted_key=AxisState.OPERATION_ENABLED.text_key
            )
        if state is not AxisState.OPERATION_ENABLED:
            self._running.end(Ended.STOPPED)
            return True
        return False

    async def _send(self, raw: int) -> None:
        """One target. Raises BusLostError, NoAnswerError, DeviceError, AxisStateError, OvertakenError."""
        self._control.require_own()
        data = raw.to_bytes(4, "little", signed=True)
        driver, node = self._control.driver, self._target.node
        if self._pdo is None:
            await driver.write(node, TARGET, data, verify=Verify.ACK, known=driver.commanded(node, TARGET))
            return
        view = self._target.live.node(self._target.device.bus, node)
        if view is None or view.state is not NmtState.OPERATIONAL:
            raise AxisStateError(
                device=self._target.slug, state_key="axis_found.not_operational", wanted_key="axis_needed.operational"
            )
        frame = pdo.pack(self._pdo.mapping, {**self._beside, TARGET: data})
        parameters = self._pdo.parameters
        driver.command_raw(node, TARGET, Can(parameters.can_id, frame, parameters.extended))

    async def _measure(self, samples: PdoFound | None) -> None:
        """Read what no PDO brings; the answers are taken from the wire."""
        carried = frozenset() if samples is None else samples.carried
        wanted: list[Any] = [a for a in (STATUSWORD, FOLLOWING, CURRENT, VELOCITY, POSITION) if a not in carried]
        every_s = _SAMPLE_S if POSITION in wanted else _LOOK_S
        while True:
            with suppress(HubsideError):  # what does not answer leaves a gap in the course
                await self._control.driver.read_many(self._target.node, wanted)
            await asyncio.sleep(every_s)

    async def _come_to_rest(self) -> None:
        """Halt, no power, the brake engaged, and a mode that goes nowhere by itself.

        Where a quick stop is under way, or somebody else has commanded the axis, it is left to that.
        """
        if self._running.why in STOPPING:
            return
        with suppress(OvertakenError):
            await come_to_rest(self._running)
            await self._control.set_mode(AxisMode.PROFILE_POSITION)
