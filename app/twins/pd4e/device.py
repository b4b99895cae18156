"""The whole twin of a PD4-E: dictionary, memory, drive, process data; time passes in steps of a millisecond."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app.model.address import Address
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.variant import as_variant
from app.twins.nonvolatile import NonVolatile
from app.twins.object_store import ObjectStore, RefusedAccessError
from app.twins.pd4e import digital
from app.twins.pd4e.drive import Drive
from app.twins.pd4e.error_stack import Trouble
from app.twins.pd4e.live import connect
from app.twins.pd4e.modes import ModeCode
from app.twins.pd4e.nanoj import NanoJ
from app.twins.pd4e.process_data import ProcessData
from app.twins.pd4e.saving import Saving
from app.twins.pd4e.servo import Bench, Control, Motor, Servo
from app.twins.state_file import StateFile
from app.wire.sdo import Abort

CYCLE_NS: Final = 1_000_000
WAKE_NS: Final = 10_000_000
"""How often the device wants to be run where nobody asks it; a request lets it come to the present anyway."""
BOOT_NS: Final = 500_000_000
SAVE_NS: Final = 200_000_000
"""Times assumed."""
REBOOT_SIGNATURE: Final = 0x746F6F62
"""'boot' (manual, 7.3.9)."""
_REBOOT: Final = (0x2800, 1)
_REBOOT_DELAY: Final = (0x2800, 2)
_MS: Final = 1_000_000
_POLE_PAIRS: Final = Address(0x2030)

MOTORS: Final = {
    "pd4-e591": Motor(rated_ma=2100, torque_nm=0.85, inertia_kgm2=1.2e-4, friction_nm=0.02),
    "pd4-e601": Motor(rated_ma=2100, torque_nm=1.4, inertia_kgm2=2.0e-4, friction_nm=0.03),
    "pd4-eb59": Motor(rated_ma=3000, torque_nm=0.60, inertia_kgm2=1.0e-4, friction_nm=0.015),
}
"""Motor and load of each variant; assumed, but for the EB59's torque (manual, 3.3.2)."""
POLE_PAIRS: Final = {"pd4-e591": 50, "pd4-e601": 50, "pd4-eb59": 3}
"""What the auto set-up finds."""
FREE_SHAFT: Final = Bench()


@dataclass(frozen=True, slots=True)
class Settings:
    """How a twin is set up. ``state`` is the file of its memory, None forgets everything at the end."""

    variant: str = "pd4-e591"
    serial: str = "TWIN-0001"
    state: Path | None = None
    bench: Bench = FREE_SHAFT
    nanoj_program: bool = True


class Pd4e:
    """One device. It is a simulation as ``PacedThread`` runs it; nothing in it reads a clock."""

    busy: Final = False

    def __init__(self, description: Description, settings: Settings) -> None:
        self.settings = settings
        self.now_ns = 0
        self.on_handler_error: Callable[[Exception], None] | None = None
        self.on_restart: Callable[[], None] = lambda: None
        """Called when the device restarts: its connections end."""
        self.store = ObjectStore(as_variant(description, settings.variant), node_id=1)
        file = None if settings.state is None else StateFile(settings.state, f"{description.id}/{settings.variant}")
        self.memory = NonVolatile(
            self.store, file, duration_ns=SAVE_NS, delivered={}, failed=self._memory_failed, commanded=False
        )
        self.memory.recall(lambda _entry: True)
        self.servo = Servo(MOTORS[settings.variant], settings.bench)
        self.nanoj = NanoJ(settings.nanoj_program)
        self.drive = Drive(self.store, self.servo, saving=lambda: self.saving.busy)
        self.drive.setup_ended = self._setup_ended
        self.saving = Saving(
            self.store,
            self.memory,
            duration_ns=SAVE_NS,
            moving=lambda: self.drive.moving,
            now_ns=lambda: self.now_ns,
        )
        self.process_data = ProcessData(self.store)
        self.started_ns = 0
        self.at_restart: list[Callable[[], None]] = []
        """What else a restart brings into force."""
        self._booted_ns: int | None = BOOT_NS
        self._restart_due_ns: int | None = None
        connect(self)
        self._install_commands()
        self.restart()

    # -- simulation --------------------------------------------------------------------------

    @property
    def online(self) -> bool:
        """The controller has booted and answers."""
        return self._booted_ns is None

    def next_due_ns(self) -> int | None:
        """The device runs all the time."""
        return self.now_ns - self.now_ns % WAKE_NS + WAKE_NS

    def run_until(self, t_ns: int) -> None:
        """Let milliseconds pass."""
        while self.now_ns + CYCLE_NS <= t_ns:
            self.now_ns += CYCLE_NS
            self._cycle()

    def _cycle(self) -> None:
        if self._booted_ns is not None:
            if self.now_ns < self._booted_ns:
                self.servo.step(Control.OFF, 0.0, 0.0, 0.0, 0.0)  # a shaft that turns runs out
                return
            self._booted_ns = None
            self.drive.states.booted()
        self.saving.step()
        self.nanoj.cycle()
        self.drive.cycle()
        if self._restart_due_ns is not None:
            self.settle()

    # -- commands ----------------------------------------------------------------------------

    def restart(self) -> None:
        """Power-on, or a restart of the firmware: RAM is what was saved, else the defaults."""
        self._restart_due_ns = None
        self.saving.restart()
        self.memory.recall(lambda _entry: True)
        self.drive.restart()
        self.nanoj.restart()
        self.process_data.reload()
        for act in self.at_restart:
            act()
        self.started_ns = self.now_ns
        self._booted_ns = self.now_ns + BOOT_NS

    def settle(self) -> None:
        """A request has been answered: do what its writes asked for, all of them together."""
        if self._restart_due_ns is not None and self.now_ns >= self._restart_due_ns:
            self.restart()
            self.on_restart()
        elif self.online:
            self.drive.settle()

    # -- inside ------------------------------------------------------------------------------

    def _install_commands(self) -> None:
        store = self.store
        reboot = store.cell(*_REBOOT)
        reboot.guard = _only(REBOOT_SIGNATURE)
        reboot.effect = self._reboot
        store.cell(0x6060).guard = _known_mode
        store.cell(0x2300).effect = lambda raw: self.nanoj.control(_number(raw))
        store.cell(0x1003).guard = _only(0)
        store.cell(0x1003).effect = lambda _raw: self.drive.errors.clear()
        routing = store.find(0x3240, digital.Input.ROUTING)
        if routing is not None:
            before = routing

            def switched(raw: Raw) -> None:
                if raw and not before.raw:
                    digital.route_as_before(store)

            routing.guard = switched

    def _reboot(self, _raw: Raw) -> None:
        delay = self.store.find(*_REBOOT_DELAY)
        self._restart_due_ns = self.now_ns + (0 if delay is None else delay.number * _MS)

    def _memory_failed(self) -> None:
        self.drive.errors.raised(Trouble.MEMORY)

    def _setup_ended(self) -> None:
        """The auto set-up stores its results by itself (manual, 4.3)."""
        pairs = POLE_PAIRS[self.settings.variant]
        self.store.cell(_POLE_PAIRS.major).raw = pairs
        try:
            self.memory.preset(_POLE_PAIRS, self.store.at(_POLE_PAIRS).to_bytes())
        except OSError:
            self._memory_failed()


def _number(raw: Raw) -> int:
    return raw if isinstance(raw, int) else 0


def _only(wanted: int) -> Callable[[Raw], None]:
    def check(raw: Raw) -> None:
        if raw != wanted:
            raise RefusedAccessError(Abort.VALUE_RANGE)

    return check


def _known_mode(raw: Raw) -> None:
    """OPEN what a drive does with the number of a mode that it has not; refused here."""
    if raw not in {int(code) for code in ModeCode}:
        raise RefusedAccessError(Abort.VALUE_RANGE)
