"""Strict SDO client for all nodes of one bus: one transfer a node at a time, the nodes in parallel.

It lives on the receive thread of its port: an answer's callback sends the next request. Nothing here blocks, locks or
knows asyncio. Three rules beyond CiA 301 keep a late answer from being taken for a later request's:

* A request without an answer is aborted and remembered (``sdo_unanswered``). Its answer, should it come, is booked to
  it and to nothing else.
* A request that a remembered one could be taken for (same kind, same address) waits for a *fence*: another object is
  read first. Its answer proves that whatever was asked before has been answered or never will be.
* Should a late acknowledge come after the fence all the same, the write that it seems to answer is doubtful, and is
  read back.
"""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Final, Generic, Protocol, TypeVar

from app.drivers.sdo_jobs import Counters, End, Steps, WriteStep
from app.drivers.sdo_transfer import Kind, Step, Transfer, Upload
from app.drivers.sdo_unanswered import Claim, Unanswered
from app.drivers.urgent import UrgentCommands
from app.errors import BusLostError, HubsideError, NoAnswerError, RefusedError
from app.model.address import Address
from app.wire import sdo
from app.wire.frame import Can, Direction, Frame

log = logging.getLogger(__name__)

T = TypeVar("T")

DEFAULT_TIMEOUT_NS: Final = 500_000_000
FENCE_TRIES: Final = 2
FENCES: Final = (Address(0x1000), Address(0x1001), Address(0x1018, 1), Address(0x1018, 0))
"""Objects that every CANopen device has (CiA 301, 7.5.2): device type, error register, identity."""

_BOOT_BASE: Final = 0x700


class Port(Protocol):
    """What the client needs of a bus; ``call_at`` runs ``callback`` on the receive thread at a monotonic time in ns."""

    def send(self, can: Can) -> None:
        """Queue one frame. Raises BusLostError."""

    def call_at(self, at_ns: int, callback: Callable[[], None]) -> object:
        """Run ``callback`` on the receive thread at ``at_ns``."""


class Job(Generic[T]):
    """Steps for one node and who is told of the result. ``on_done`` gets a result or an exception, never both.

    ``urgent``: interrupts what runs at the node and goes first; its write is never held back by a fence.
    ``fenced`` False: a late answer of an earlier request is as good as a fresh one (only for scans).
    ``bulk``: lets whatever else waits for the node go first after each of its transfers.
    """

    __slots__ = ("ask", "bulk", "fenced", "on_done", "resume", "steps", "urgent")

    def __init__(
        self,
        steps: Steps[T],
        on_done: Callable[[T | None, Exception | None], None],
        urgent: bool = False,
        fenced: bool = True,
        bulk: bool = False,
    ) -> None:
        self.steps = steps
        self.bulk = bulk
        self.on_done = on_done
        self.urgent = urgent
        self.fenced = fenced
        self.ask: Transfer | None = None
        """A transfer asked for and not sent yet, because something else went first."""
        self.resume: End | None = None


class _Channel:
    """The SDO channel of one node: its queue, its running transfer, its unanswered requests."""

    __slots__ = (
        "client",
        "deadline_ns",
        "fence_fails",
        "job",
        "node",
        "queue",
        "request_id",
        "sure",
        "transfer",
        "unanswered",
        "wanted",
    )

    def __init__(self, client: SdoClient, node: int) -> None:
        self.client = client
        self.node = node
        self.request_id = sdo.REQUEST_BASE + node
        self.queue: deque[Job[Any]] = deque()
        self.job: Job[Any] | None = None
        self.transfer: Transfer | None = None
        """What is on the wire now: the job's transfer or the fence before it."""
        self.fence_fails = 0
        self.wanted: Transfer | None = None
        """The job's transfer while a fence runs before it."""
        self.deadline_ns = 0
        self.unanswered = Unanswered()
        self.sure = True
        """No unanswered request could be taken for the transfer on the wire."""

    # -- jobs ---------------------------------------------------------------

    def submit(self, job: Job[Any]) -> None:
        if not job.urgent:
            self.queue.append(job)
        else:
            ahead = sum(1 for other in self.queue if other.urgent)
            self.queue.insert(ahead, job)
            if self.job is not None and not self.job.urgent:
                self._interrupt(self.job)
        if self.job is None:
            self._next_job()

    def cancel(self, job: Job[Any]) -> None:
        if job is self.job:
            self._give_up(sdo.Abort.GENERAL)
            self.job = None
            job.steps.close()
            self._next_job()
        elif job in self.queue:
            self.queue.remove(job)
            job.steps.close()

    def abort_current(self) -> None:
        job, transfer = self.job, self.transfer
        if job is None or transfer is None:
            return
        self._give_up(sdo.Abort.GENERAL)
        self.job = None
        job.steps.close()
        error = NoAnswerError(node=self.node, address=str(transfer.address), timeout_s=0, reason="interrupted")
        self._deliver(job, None, error)
        self._next_job()

    def lose(self, error: HubsideError) -> None:
        job, self.job = self.job, None
        queued = list(self.queue)
        self.queue.clear()
        if self.transfer is not None:
            self.unanswered.remember(self.transfer, self.client.now_ns())
        self.transfer = self.wanted = None
        if job is not None:
            self._lose_running(job, error)
        for other in queued:
            other.steps.close()
            self._deliver(other, None, error)

    def _lose_running(self, job: Job[Any], error: HubsideError) -> None:
        try:
            job.steps.send(End.LOST)
        except StopIteration as stop:
            self._deliver(job, stop.value, None)
        except Exception as raised:  # noqa: BLE001 - handed to whoever asked, the receive thread goes on
            self._deliver(job, None, raised)
        else:
            job.steps.close()
            self._deliver(job, None, error)

    def _interrupt(self, job: Job[Any]) -> None:
        """Put the running job back into the queue; a transfer on the wire is aborted and its outcome left open."""
        self.client.counters.interrupted += 1
        if self.wanted is not None:
            job.ask = self.wanted
        else:
            job.resume = End.INTERRUPTED
        self._give_up(sdo.Abort.GENERAL)
        self.job = None
        ahead = sum(1 for other in self.queue if other.urgent)
        self.queue.insert(ahead, job)

    def _next_job(self) -> None:
        while self.job is None and self.queue:
            job = self.job = self.queue.popleft()
            if job.ask is not None:
                ask, job.ask = job.ask, None
                self._begin(ask)
            else:
                resume, job.resume = job.resume, None
                self._advance(job, resume)

    def _advance(self, job: Job[Any], end: End | None) -> None:
        """Tell the job how its transfer ended and begin the next; ``end`` None starts it, or resumes it as it was."""
        try:
            ask = job.steps.send(end) if end is not None else next(job.steps)
        except StopIteration as stop:
            self.job = None
            self._deliver(job, stop.value, None)
        except Exception as raised:  # noqa: BLE001 - handed to whoever asked, the receive thread goes on
            self.job = None
            self._deliver(job, None, raised)
        else:
            if job.bulk and any(not other.bulk for other in self.queue):
                job.ask, self.job = ask, None
                self.queue.append(job)
            else:
                self._begin(ask)

    def _deliver(self, job: Job[Any], result: Any, error: Exception | None) -> None:
        try:
            job.on_done(result, error)
        except Exception:
            log.exception("the receiver of an SDO result failed")

    # -- the running transfer -----------------------------------------------

    def _begin(self, ask: Transfer) -> None:
        alike = self.unanswered.alike(ask, self.client.now_ns()) if self.unanswered else None
        if alike is not None:
            if isinstance(ask, WriteStep):
                ask.doubtful = True
            job = self.job
            hurried = job is not None and job.urgent and isinstance(ask, WriteStep)
            if not alike.flushed and job is not None and job.fenced and not hurried:
                self.fence_fails = 0
                self._send_fence(ask)
                return
        self._send(ask)

    def _send_fence(self, ask: Transfer) -> None:
        self.client.counters.fences += 1
        self.wanted = ask
        usable = [a for a in FENCES if a != ask.address]
        free = [a for a in usable if not self.unanswered.has(sdo.upload_request(a)[1:4], Kind.UPLOAD)]
        self._send(Upload((free or usable)[0], max(DEFAULT_TIMEOUT_NS, ask.timeout_ns)))

    def _send(self, transfer: Transfer) -> None:
        self.transfer = transfer
        self.sure = True
        if self.unanswered:
            alike = self.unanswered.alike(transfer, self.client.now_ns())
            self.sure = alike is None or alike.flushed
        known = transfer.known if isinstance(transfer, WriteStep) else None
        commands = self.client.commands
        if known is None:
            self._transmit(transfer)
        elif not commands.send_unless(self.node, transfer.address, known, lambda: self._transmit(transfer)):
            self._overtaken()
            return
        self.client.counters.transfers += 1

    def _overtaken(self) -> None:
        """What was about to be sent would undo an urgent command: its job is told, and nothing is sent."""
        self.transfer = None
        if self.job is not None:
            self._continue(self.job, End.OVERTAKEN)

    def _transmit(self, transfer: Transfer) -> None:
        client = self.client
        self.deadline_ns = client.now_ns() + transfer.timeout_ns
        client.arm(self.deadline_ns)
        client.port.send(Can(self.request_id, transfer.request))

    def on_response(self, data: bytes) -> None:
        if self.unanswered and not self._is_for_running(data):
            return
        transfer = self.transfer
        step = Step.IGNORED if transfer is None else transfer.feed(data)
        if transfer is None or step is Step.IGNORED:
            self.client.counters.ignored += 1
        elif step is Step.SEND:
            self._transmit(transfer)
        elif step is Step.DONE:
            self._end(transfer, End.DONE)
        elif step is Step.REFUSED:
            self.client.counters.aborts_received += 1
            self._end(transfer, End.REFUSED)
        else:
            self.client.port.send(Can(self.request_id, transfer.request))
            self._end(transfer, End.BROKEN)

    def _is_for_running(self, data: bytes) -> bool:
        claim = self.unanswered.claim(data, self.transfer, self.sure)
        if claim is Claim.RUNNING:
            return True
        self.client.counters.late += 1
        if claim is Claim.UNCLEAR and self.transfer is not None:
            transfer, self.transfer = self.transfer, None
            self.unanswered.still_owed(transfer)
            self._without_answer()
        return False

    def _end(self, transfer: Transfer, end: End) -> None:
        self.transfer = None
        if self.unanswered:
            if self.sure:
                self.unanswered.flush()
            if end is End.DONE and isinstance(transfer, WriteStep) and transfer.doubtful:
                self.unanswered.still_owed(transfer)
        if self.wanted is not None and not self.sure:
            self._without_answer()  # the answer may be that of an older fence, which proves nothing
        elif self.wanted is not None:
            wanted, self.wanted = self.wanted, None
            self._send(wanted)
        elif self.job is not None:
            self._continue(self.job, end)

    def _continue(self, job: Job[Any], end: End) -> None:
        self._advance(job, end)
        if self.job is None:
            self._next_job()

    def check_deadline(self, now_ns: int) -> None:
        transfer = self.transfer
        if transfer is None or now_ns < self.deadline_ns:
            return
        self.client.counters.timeouts += 1
        wanted = self.wanted
        self._give_up(sdo.Abort.TIMED_OUT)
        self.wanted = wanted
        self._without_answer()

    def _without_answer(self) -> None:
        """The transfer on the wire is over without an answer; where it was a fence, another one is tried."""
        job, wanted = self.job, self.wanted
        self.wanted = None
        if job is None:
            return
        if wanted is None:
            self._continue(job, End.TIMED_OUT)
            return
        self.fence_fails += 1
        if self.fence_fails < FENCE_TRIES:
            self._send_fence(wanted)
        else:
            self._continue(job, End.SILENT)

    def on_boot_up(self) -> None:
        """The node has restarted: what was asked before will not be answered any more."""
        self.unanswered.clear()
        if self.transfer is not None:
            self.deadline_ns = 0
            self.check_deadline(self.client.now_ns())

    def _give_up(self, code: int) -> None:
        transfer = self.transfer
        if transfer is not None:
            self.unanswered.remember(transfer, self.client.now_ns())  # first: it is on its way until it stands there
        self.transfer = self.wanted = None
        if transfer is not None:
            self.client.port.send(Can(self.request_id, transfer.abort(code)))


class SdoClient:
    """SDO client of one bus. All methods run on the receive thread of ``port``; ``now_ns`` is its monotonic clock.

    ``commands`` are those that a write must not follow (``WriteStep.known``).
    """

    def __init__(self, port: Port, now_ns: Callable[[], int], commands: UrgentCommands | None = None) -> None:
        self.port = port
        self.now_ns = now_ns
        self.commands = commands or UrgentCommands()
        self.counters = Counters()
        self._channels = {node: _Channel(self, node) for node in range(1, 128)}
        self._by_response = {sdo.RESPONSE_BASE + node: channel for node, channel in self._channels.items()}
        self._armed_ns: int | None = None

    def submit(self, node: int, job: Job[Any]) -> None:
        """Queue ``job`` for ``node`` (1..127) and begin it if nothing runs there. BusLostError goes to the job."""
        self._guarded(self._channels[node].submit, job)

    def cancel(self, node: int, job: Job[Any]) -> None:
        """Drop ``job``; a transfer of it that is on the wire is aborted. Its ``on_done`` is not called."""
        self._guarded(self._channels[node].cancel, job)

    def may_still_write(self, node: int, address: Address) -> bool:
        """Whether a write of ours is on its way to the object, or was given up without an answer. From any thread."""
        channel, wanted = self._channels[node], (sdo.upload_request(address)[1:4], Kind.DOWNLOAD)
        transfer = channel.transfer
        on_its_way = transfer is not None and (transfer.mux, transfer.kind) == wanted
        return on_its_way or channel.unanswered.owes(*wanted)

    def abort_current(self, node: int) -> None:
        """Abort the transfer that runs at ``node``, if any; its job ends with NoAnswerError."""
        self._guarded(_Channel.abort_current, self._channels[node])

    def lose(self, error: HubsideError) -> None:
        """Nothing can be sent any more: every job ends, with ``error`` or with one that says what was lost."""
        for channel in self._channels.values():
            channel.lose(error)

    def on_frames(self, frames: Sequence[Frame]) -> None:
        """Take what the bus received."""
        by_response = self._by_response
        for _, _, direction, can, _ in frames:
            if direction is not Direction.RX or type(can) is not Can:
                continue
            can_id, data, extended, remote, error, _ = can
            if extended or remote or error:
                continue
            channel = by_response.get(can_id)
            if channel is not None:
                self._guarded(channel.on_response, data)
            elif can_id > _BOOT_BASE and data == b"\0":
                booted = self._channels.get(can_id - _BOOT_BASE)
                if booted is not None:
                    self._guarded(_Channel.on_boot_up, booted)

    def arm(self, deadline_ns: int) -> None:
        """Make sure that deadlines are looked at no later than ``deadline_ns``."""
        if self._armed_ns is None or deadline_ns < self._armed_ns:
            self._armed_ns = deadline_ns
            self.port.call_at(deadline_ns, self._on_timer)

    def _on_timer(self) -> None:
        now_ns = self.now_ns()
        if self._armed_ns is None or now_ns < self._armed_ns:
            return
        self._armed_ns = None
        for channel in self._channels.values():
            if channel.transfer is not None:
                self._guarded(channel.check_deadline, now_ns)
        waiting = [channel.deadline_ns for channel in self._channels.values() if channel.transfer is not None]
        if waiting:
            self.arm(min(waiting))

    def _guarded(self, action: Callable[[Any], object], argument: object) -> None:
        """A send that fails means that the bus is gone or must not be sent to, for every node."""
        try:
            action(argument)
        except (BusLostError, RefusedError) as error:
            self.lose(error)
