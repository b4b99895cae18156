"""Before an axis may move: it must stop by itself when it hears nothing of us any more, and has proven that it does.

Abort connection (6007h) becomes quick stop, and a free entry of the heartbeat consumer (1016h) watches us; both are
read back. Then the axis, enabled and standing, is left without our heartbeat, and the time is taken until it leaves
operation enabled. At the end the old values are written back, and the node gets its NMT state back.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from app.errors import (
    AxisStateError,
    DeviceError,
    HubsideError,
    InterlockError,
    NoAnswerError,
    NotHeldError,
    OvertakenError,
)
from app.model.address import Address
from app.model.axis_state import AxisState
from app.model.checks import Allow
from app.service.devices import decode
from app.service.journal import Journal, Kind
from app.service.motion.commanding import Commanding
from app.service.motion.control import REMOTE, AxisMode, cia402
from app.service.motion.heartbeat import Heartbeat
from app.service.motion.left import Changed, Left
from app.service.write import write_raw
from app.wire.nmt import NmtCommand, NmtState

log = logging.getLogger(__name__)

ABORT_CONNECTION: Final = Address(0x6007)
QUICK_STOP: Final = 3
CONSUMER: Final = 0x1016
CONSUMER_MS: Final = 400
"""The drive misses us after so long. Our heartbeat comes every 80 ms: four may be lost."""
PROOF_S: Final = 1.0
"""An axis that still runs so long after our last heartbeat does not stop by itself."""
FEATHER_TIMEOUT_S: Final = 30.0
"""A fault may send the blade to feather, from the other end of its range."""
OFF_TIMEOUT_S: Final = 20.0
"""A blade may be on its way to feather."""
_EARLY_S: Final = 0.1
"""A drive may look after its clock so coarsely; one that stops earlier does so for another reason."""
_SETTLE_S: Final = 0.25
_LOOK_S: Final = 0.005
_NMT_TIMEOUT_S: Final = 2.0


@dataclass
class Prepared:
    """An axis that is prepared. ``settings``: what must stand there.

    ``proof_s``: so long after our last heartbeat it had left operation enabled by itself; None: not proven yet.
    ``unwatched``: its bus has nothing by which it could, and it may move all the same (``Interlock.SELF_STOP``).
    """

    control: Commanding
    settings: dict[Address, bytes] = field(default_factory=dict)
    proof_s: float | None = None
    unwatched: bool = False

    @property
    def may_move(self) -> bool:
        """What has to be known of it is."""
        return self.unwatched or self.proof_s is not None

    @property
    def proof_ms(self) -> int | None:
        """``proof_s`` in ms."""
        return None if self.proof_s is None else round(1000 * self.proof_s)

    def void(self) -> None:
        """It must not move before it is prepared anew."""
        self.proof_s, self.unwatched = None, False

    @property
    def slug(self) -> str:
        """The axis."""
        return self.control.target.slug


async def set_up(axis: Prepared, heartbeat: Heartbeat, left: Left, journal: Journal) -> None:
    """Write and read back both settings, and make the node operational; ``left`` keeps what stood there.

    Raises what a write raises, StoreError, InterlockError.
    """
    control = axis.control
    entry = await _free_consumer(control, heartbeat.node)
    watch = (heartbeat.node << 16 | CONSUMER_MS).to_bytes(4, "little")
    await left.note_mode(axis.slug, await control.mode())
    await _change(axis, ABORT_CONNECTION, QUICK_STOP.to_bytes(2, "little"), left, journal)
    await _change(axis, entry, watch, left, journal)
    heartbeat.watch(axis.slug)
    view = control.target.live.node(control.target.device.bus, control.target.node)
    state = None if view is None else view.state
    if state is not NmtState.OPERATIONAL:
        # What nobody told is taken for pre-operational: so a node is that no master has started.
        await left.note_nmt(axis.slug, state or NmtState.PRE_OPERATIONAL)
        control.driver.nmt(NmtCommand.START, control.target.node)
        journal.note(Kind.NMT_SENT, axis.slug, command="start", was=_name(state))
        await _until_operational(control)


async def take_unwatched(axis: Prepared, heartbeat: Heartbeat, left: Left) -> None:
    """Have an axis that cannot watch us ready to move: only its mode is noted, for nothing is set.

    Raises InterlockError where it has power: somebody else has it. And what reading raises, StoreError.
    """
    control = axis.control
    await left.note_mode(axis.slug, await control.mode())
    if await control.has_power():
        raise InterlockError(device=axis.slug, interlock="running", reason_key="interlock.reason.has_power")
    control.require_own()
    heartbeat.watch(axis.slug)
    axis.unwatched = True


async def _free_consumer(control: Commanding, node: int) -> Address:
    """An entry of 1016h that watches nobody, or us already. Raises InterlockError where there is none."""
    entries = sorted(a for a in control.target.description.entries if a.major == CONSUMER and a.minor > 0)
    found = await control.driver.read_many(control.target.node, entries)
    free = None
    for address in entries:
        data = found[address]
        if isinstance(data, HubsideError):
            raise data
        raw = int.from_bytes(data, "little")
        if raw >> 16 & 0xFF == node:
            return address
        if free is None and (raw & 0xFFFF == 0 or raw >> 16 & 0xFF == 0):
            free = address
    if free is None:
        raise InterlockError(
            device=control.target.slug, interlock="heartbeat", reason_key="interlock.reason.no_consumer"
        )
    return free


async def _change(axis: Prepared, address: Address, data: bytes, left: Left, journal: Journal) -> None:
    was = await axis.control.driver.read(axis.control.target.node, address)
    if was != data:
        await left.note(axis.slug, address, Changed(was, data))
        await _write(axis.control, address, data, journal)
    axis.settings[address] = data


async def _write(control: Commanding, address: Address, data: bytes, journal: Journal) -> None:
    raw = decode(control.target.entry(address), data)
    # A test signal may have left a PDO switched on (borrowed.py).
    await write_raw(control.driver, control.target, address, raw, journal, allow=Allow.COMMUNICATION)


async def check(axis: Prepared) -> None:
    """Whether the settings still stand: a restart or somebody else may have changed them. Raises InterlockError."""
    control = axis.control
    found = await control.driver.read_many(control.target.node, axis.settings)
    for address, data in axis.settings.items():
        if found[address] != data:
            raise InterlockError(
                device=axis.slug,
                interlock="heartbeat",
                reason_key="interlock.reason.changed",
                address=address.short,
            )


async def prove(axis: Prepared, heartbeat: Heartbeat, held: Callable[[], bool]) -> float:
    """Enable the axis, be silent, and take the time until it has stopped by itself, in s since our last heartbeat.

    Raises InterlockError where it went on, NotHeldError where it was let go meanwhile.
    """
    control = cia402(axis.control)
    axis.void()
    await control.set_mode(AxisMode.PROFILE_VELOCITY)
    try:
        await control.enable()
        await asyncio.sleep(_SETTLE_S)
        last_s = heartbeat.withhold(axis.slug)
        if await control.state() is not AxisState.OPERATION_ENABLED:
            raise _not_proven(axis, "not_enabled")
        while await control.state() is AxisState.OPERATION_ENABLED:
            if not held():
                raise NotHeldError(device=axis.slug)
            if heartbeat.now_s() - last_s > PROOF_S:
                raise _not_proven(axis, "still_enabled", PROOF_S)
            await asyncio.sleep(_LOOK_S)
        took_s = heartbeat.now_s() - last_s
        control.require_own()  # a STOP proves nothing
        if not held():
            raise NotHeldError(device=axis.slug)
        if took_s < CONSUMER_MS / 1000 - _EARLY_S:
            raise _not_proven(axis, "early", round(took_s, 2))
        axis.proof_s = took_s
    finally:
        heartbeat.go_on(axis.slug)
        if axis.proof_s is None and not control.stop():
            await control.stop_by_write()
    return axis.proof_s


def _not_proven(axis: Prepared, reason: str, seconds: float | None = None) -> InterlockError:
    key = f"interlock.reason.{reason}"
    return InterlockError(device=axis.slug, interlock="proof", reason_key=key, seconds=seconds)


async def after_proof(axis: Prepared) -> None:
    """What the missing heartbeat left is reset, and the axis has no power.

    Its fault may have opened the safety chain: then the blades are on their way to feather, and that is waited for.
    Raises InterlockError where the fault stays, OvertakenError where somebody else has commanded the axis meanwhile: a
    FEATHER must not end by what this sends.
    """
    control = cia402(axis.control)
    await control.until({AxisState.FAULT, AxisState.SWITCH_ON_DISABLED, AxisState.READY}, FEATHER_TIMEOUT_S)
    if not await control.status() & REMOTE or await control.state() is AxisState.FAULT:
        state = await control.reset_fault()
        if state is AxisState.FAULT or not await control.status() & REMOTE:
            raise InterlockError(
                device=control.target.slug, interlock="proof", reason_key="interlock.reason.fault_stays"
            )
    await control.switch_off()


async def put_back(control: Commanding, left: Left, journal: Journal) -> None:
    """Write what stood there before, newest first, the mode last. What no longer holds what we wrote is left as it is.

    An axis that has power keeps its watch: it is waited for, then InterlockError. Raises what reading and writing
    raise, StoreError; what is done by then is done.
    """
    if left.of(control.target.slug) and not await control.until_off(OFF_TIMEOUT_S):
        raise InterlockError(device=control.target.slug, interlock="running", reason_key="interlock.reason.has_power")
    slug, node = control.target.slug, control.target.node
    for address, changed in reversed(left.of(slug).items()):
        if await control.driver.read(node, address) == changed.now:
            await _write(control, address, changed.was, journal)
        await left.forget(slug, address)
    await _mode_back(control, left)


async def _mode_back(control: Commanding, left: Left) -> None:
    """The axis gets its mode back; where that cannot be now, it stays noted. Raises StoreError."""
    slug = control.target.slug
    changed = left.mode_of(slug)
    try:
        if changed is not None and await control.mode_back(changed):
            await left.forget_mode(slug)
    except (AxisStateError, DeviceError, NoAnswerError, OvertakenError) as error:
        log.warning("%s: its mode is not put back: %s", slug, error.code)


async def give_nmt_back(control: Commanding, left: Left, journal: Journal) -> None:
    """The node gets the NMT state back that it had. Raises BusLostError, ConsentError, StoreError."""
    slug = control.target.slug
    before = left.nmt_of(slug)
    if before is not None:
        command = NmtCommand.STOP if before is NmtState.STOPPED else NmtCommand.PRE_OPERATIONAL
        control.driver.nmt(command, control.target.node)
        journal.note(Kind.NMT_SENT, slug, command=command.name.lower(), was="operational")
        await left.forget_nmt(slug)


async def _until_operational(control: Commanding) -> None:
    """Wait until the node says that it is operational. Raises InterlockError."""
    target, loop = control.target, asyncio.get_running_loop()
    end_s = loop.time() + _NMT_TIMEOUT_S
    while True:
        view = target.live.node(target.device.bus, target.node)
        if view is not None and view.state is NmtState.OPERATIONAL:
            return
        if loop.time() >= end_s:
            raise InterlockError(device=target.slug, interlock="nmt", reason_key="interlock.reason.not_operational")
        await asyncio.sleep(_LOOK_S)


def _name(state: NmtState | None) -> str:
    return "–" if state is None else state.name.lower()
