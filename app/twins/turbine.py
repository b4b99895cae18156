"""A turbine with three blades on one CAN line: PMM n and PMC 10+n for blade n, and the plant behind them.

To serve it in real time, give its line to a ``LineThread`` and that to a ``SocketcandServer``::

    line = CanLine(500_000)
    turbine = build_turbine(line, load_builtin("oat-pmm"), load_builtin("oat-pmc"), state_dir=Path("state"))
    turbine.power_on(line.now_ns)
    with LineThread(line) as thread, SocketcandServer(thread, ...):
        ...

``turbine.problems`` names state files that could not be used; a state folder that cannot be one is a UsageError.
In a test, ``line.run_until`` is the clock.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app.errors import UsageError
from app.model.address import Address
from app.model.description import Description
from app.twins.canopen_device import MS, CanopenDevice, Mount
from app.twins.oat_pmc import TICK_BUSY_NS, OatPmc
from app.twins.oat_pmm import OatPmm
from app.twins.plant import AxisPlant
from app.twins.plant_kernel import Run, run_plain
from app.twins.plant_power import PowerPlant
from app.twins.ports import Alarm, Line
from app.twins.safety_chain import SafetyChain

BLADES: Final = (1, 2, 3)
START_ANGLE_DEG: Final = 80.0
"""A healthy twin stands here: nearly at feather, no limit switch actuated."""
TWIN_NAME: Final = "HUBSIDE TWIN"
"""What 1008h of every twin begins with."""
_PMC_NODE_OFFSET: Final = 10
_ENCODER_ZERO_DEG: Final = {1: -3.21, 2: 1.74, 3: 0.58}
_BLADE_ENCODER_ZERO_DEG: Final = {1: 2.05, 2: -1.12, 3: 4.4}
"""Blade angles at which the encoders count 0, as the fitter left them; 607Ch and 687Ch make up for them."""
_VENDOR_ID: Final = 0x000000F0
_PMM_PRODUCT: Final = 0x504D4D
_PMC_PRODUCT: Final = 0x504D43
_REVISION: Final = 0x00010009
_SERIAL_BASE: Final = 0x20090500
"""Identity (1018h): invented; the manual prints none."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How the twins are run. Durations in ns; ``state_dir`` None: nothing outlives the process."""

    state_dir: Path | None = None
    turnaround_ns: int = MS
    boot_ns: int = 500 * MS
    save_ns: int = 300 * MS
    factory: bool = False
    angle_deg: float = START_ANGLE_DEG
    unit_link: bool = True
    """PMM and PMC of a blade send each other what they tell over the bus."""
    run: Run = run_plain
    """What runs the plants' cycles."""


def commissioned(encoder_zero_deg: float, blade_encoder_zero_deg: float) -> dict[Address, int]:
    """What commissioning has stored in a PMC: scaling of the pitch example (5.5, 5.6), offsets, limits of motion.

    All else is as the manual prints it. 607Fh obeys its formula (at most 1063 units/s), which its default does not.
    """
    return {
        Address(0x608F, 1): 1024,
        Address(0x6091, 1): 183 * 111,
        Address(0x6091, 2): 12,
        Address(0x688F, 1): 1024,
        Address(0x6891, 1): 111,
        Address(0x6891, 2): 15,
        Address(0x607C): round(encoder_zero_deg * 100),
        Address(0x687C): round(blade_encoder_zero_deg * 100),
        Address(0x607F): 1000,
        Address(0x6083): 1500,
        Address(0x6084): 1500,
        Address(0x5681): 800,
        Address(0x5683): 1500,
        Address(0x5684): 1500,
        Address(0x6402): 0x0007,
    }


class Blade:
    """One blade: its two devices, its plant, and the rhythm in which they move on."""

    def __init__(self, line: Line, number: int, pmm: Description, pmc: Description, settings: Settings) -> None:
        self.number = number
        zero_deg, blade_zero_deg = _ENCODER_ZERO_DEG[number], _BLADE_ENCODER_ZERO_DEG[number]
        self.axis = AxisPlant(settings.angle_deg, None, zero_deg, blade_zero_deg, settings.run)
        self.power = PowerPlant(seed=number, s=self.axis.s, p=self.axis.p)
        self.pmm = OatPmm(
            CanopenDevice(line, number, pmm, _mount(settings, pmm, number, "PMM", _PMM_PRODUCT, {})),
            self.power,
            lambda: self.axis.speed_rad_s != 0.0,
        )
        node = _PMC_NODE_OFFSET + number
        delivered = commissioned(zero_deg, blade_zero_deg)
        self.pmc = OatPmc(
            CanopenDevice(line, node, pmc, _mount(settings, pmc, node, "PMC", _PMC_PRODUCT, delivered)),
            self.axis,
            self.power,
        )
        self.pmm.feeds = self.devices
        if settings.unit_link:
            self.pmm.join(node)
            self.pmc.join(number)
        self.pmc.catch_up = self._catch_up
        self._alarm = Alarm(line)

    @property
    def devices(self) -> tuple[CanopenDevice, CanopenDevice]:
        """PMM and PMC."""
        return self.pmm.device, self.pmc.device

    def power_on(self, t_ns: int) -> None:
        """Switch both units on; time begins to pass."""
        self.pmc.begin(t_ns)
        for device in self.devices:
            device.power_on(t_ns)
        self._alarm.set(t_ns + self.pmc.tick_ns, self._tick)

    def power_off(self) -> None:
        """Switch both units off."""
        self._alarm.clear()
        for device in self.devices:
            device.power_off()

    def advance(self, t_ns: int) -> None:
        """Bring physics and units to ``t_ns``, as whoever is about to change the plant from outside must do."""
        self.pmc.tick(t_ns)
        self.pmm.tick(t_ns)

    def _catch_up(self, t_ns: int) -> None:
        """Physics alone."""
        self.power.brake_lifted = self.axis.brake_lifted
        self.power.prepare()
        self.pmc.run_cycles(t_ns)
        self.power.settle()

    def _tick(self, t_ns: int) -> None:
        """The next one comes sooner while something moves that must be looked at often."""
        try:
            self.advance(t_ns)
        finally:  # a defect in one tick is reported by the line, and time goes on
            quick = self.power.commands.mains_failed
            self._alarm.set(t_ns + (TICK_BUSY_NS if quick else self.pmc.tick_ns), self._tick)


class Turbine:
    """Three blades on a line. ``problems`` says which state files could not be used, and why.

    Makes the state folder; raises UsageError where that cannot be.
    """

    def __init__(self, line: Line, pmm: Description, pmc: Description, settings: Settings) -> None:
        if settings.state_dir is not None:
            _make_folder(settings.state_dir)
        self.blades = tuple(Blade(line, number, pmm, pmc, settings) for number in BLADES)
        self.chain = SafetyChain(line, self.blades)

    @property
    def devices(self) -> dict[int, CanopenDevice]:
        """All devices by node."""
        return {device.node_id: device for blade in self.blades for device in blade.devices}

    @property
    def problems(self) -> tuple[str, ...]:
        """What is wrong with the state files."""
        found = (device.memory.problem for device in self.devices.values())
        return tuple(problem for problem in found if problem is not None)

    def power_on(self, t_ns: int) -> None:
        """Switch everything on at ``t_ns`` (line time)."""
        for blade in self.blades:
            blade.power_on(t_ns)
        self.chain.start(t_ns)

    def power_off(self) -> None:
        """Switch everything off; remanent values are kept."""
        self.chain.stop()
        for blade in self.blades:
            blade.power_off()


def build_turbine(
    line: Line,
    pmm: Description,
    pmc: Description,
    *,
    state_dir: Path | None = None,
    turnaround_ns: int = MS,
    factory: bool = False,
    run: Run = run_plain,
) -> Turbine:
    """A turbine with the usual settings; call ``power_on`` next. Raises UsageError (state folder).

    ``run`` is what runs the plants' cycles: ``run_plain`` in real time, ``run_compiled()`` where much time is to pass.
    """
    settings = Settings(state_dir=state_dir, turnaround_ns=turnaround_ns, factory=factory, run=run)
    return Turbine(line, pmm, pmc, settings)


def _make_folder(folder: Path) -> None:
    """Tell at the start what else each single save would warn of."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as error:
        raise UsageError(reason=f"the place for state files, {folder}, is not a folder") from error
    except OSError as error:
        raise UsageError(reason=f"the folder for state files, {folder}: {error.strerror or error}") from error


def _mount(
    settings: Settings,
    description: Description,
    node: int,
    unit: str,
    product: int,
    delivered: Mapping[Address, int],
) -> Mount:
    folder = settings.state_dir
    return Mount(
        turnaround_ns=settings.turnaround_ns,
        boot_ns=settings.boot_ns + node * 3 * MS,  # no two units are equally fast
        save_ns=settings.save_ns,
        factory=settings.factory,
        state_path=None if folder is None else folder / f"{description.id}-node-{node:03}.json",
        delivered=delivered,
        identity={
            Address(0x1008): f"{TWIN_NAME} {unit}",
            Address(0x1009): "OAT-HW 2.1",
            Address(0x100A): "1.09",
            Address(0x1018, 1): _VENDOR_ID,
            Address(0x1018, 2): product,
            Address(0x1018, 3): _REVISION,
            Address(0x1018, 4): _SERIAL_BASE + node,
        },
    )
