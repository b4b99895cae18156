"""Twins on a simulated line, served over TCP on 127.0.0.1: the wire that drivers are tested on."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager

from app.drivers.can_config import CanConfig, CanInterface
from app.model.address import Address
from app.model.description_file import load_builtin
from app.twins.canopen_device import CanopenDevice, Mount
from app.twins.line import CanLine, Fault
from app.twins.line_thread import LineThread
from app.twins.socketcand_server import SocketcandServer
from app.wire.frame import Can, Stamper

MS = 1_000_000
PMC = load_builtin("oat-pmc")
PMM = load_builtin("oat-pmm")
DEADLINE_S = 10.0


def stamper() -> Stamper:
    return Stamper(time.time_ns(), time.monotonic_ns)


class Wire:
    """A line of 500 kbit/s with its server. Everything of the line is done on the line's thread."""

    def __init__(self, thread: LineThread, server: SocketcandServer) -> None:
        self.thread = thread
        self.server = server
        self.devices: dict[int, CanopenDevice] = {}

    @property
    def config(self) -> CanConfig:
        return CanConfig(CanInterface.SOCKETCAND, "can0", host="127.0.0.1", port=self.server.port)

    def do(self, function: Callable[[], None]) -> None:
        """Run ``function`` on the line's thread and wait for its end."""
        done, raised = threading.Event(), []

        def run() -> None:
            try:
                function()
            except Exception as error:  # noqa: BLE001 - raised again by the caller
                raised.append(error)
            finally:
                done.set()

        self.thread.call_soon(run)
        assert done.wait(DEADLINE_S), "the line's thread did not come to it"
        if raised:
            raise raised[0]

    def add_pmc(self, node: int, turnaround_ns: int = MS) -> None:
        mount = Mount(turnaround_ns, boot_ns=30 * MS, save_ns=50 * MS, identity={Address(0x1018, 4): 7000 + node})
        self._add(CanopenDevice(self.thread.line, node, PMC, mount))

    def add_pmm(self, node: int, turnaround_ns: int = MS) -> None:
        self._add(CanopenDevice(self.thread.line, node, PMM, Mount(turnaround_ns, boot_ns=30 * MS)))

    def _add(self, device: CanopenDevice) -> None:
        self.devices[device.node_id] = device
        self.do(lambda: device.power_on(self.thread.line.now_ns))
        until(lambda: device.state.name == "PRE_OPERATIONAL")

    def inject(self, fault: Fault) -> None:
        self.do(lambda: self.thread.line.inject(fault))

    def cut(self) -> None:
        """Close every connection of the server."""

        def close_all() -> None:
            for client in list(self.server._clients):
                client.close("cut")

        self.do(close_all)

    def send(self, can: Can) -> None:
        """Put a frame on the line as some other node."""
        self.do(lambda: self.thread.line.attach(lambda _can, _t_ns: None, ()).send(can))


def until(condition: Callable[[], bool], timeout_s: float = DEADLINE_S) -> None:
    """Wait until ``condition`` holds; fail after ``timeout_s``."""
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end, "the condition never came true"
        time.sleep(0.002)


@contextmanager
def wire(pmc: Iterable[int] = (), pmm: Iterable[int] = ()) -> Iterator[Wire]:
    """A line with twins at the given nodes."""
    with ExitStack() as stack:
        thread = stack.enter_context(LineThread(CanLine(500_000)))
        server = stack.enter_context(SocketcandServer(thread))
        built = Wire(thread, server)
        for node in pmc:
            built.add_pmc(node)
        for node in pmm:
            built.add_pmm(node)
        yield built
