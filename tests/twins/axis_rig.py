"""An axis with its controllers and plant, without state machine, bus and supply: a stiff DC link feeds it."""

from __future__ import annotations

from collections.abc import Callable

from app.model.address import parse_address
from app.model.description_file import load_builtin
from app.twins import axis_kernel as k
from app.twins.axis_drive import AxisDrive, Mode
from app.twins.object_store import ObjectStore
from app.twins.plant import AxisConstants, AxisPlant
from app.twins.turbine import commissioned

DC_LINK_V = 565.0


def run_stiff(s: list[float], p: list[float], cycles: int) -> int:
    """Runs the axis' own cycles at a DC link that gives and takes all."""
    for cycle in range(cycles):
        s[k.DC_LINK_V] = DC_LINK_V
        k.axis_cycle(s, p)
        if s[k.EVENT]:
            return cycle + 1
    return cycles


class AxisRig:
    """An axis at 50 degrees that is switched on. Values are those of objects."""

    def __init__(self, constants: AxisConstants | None = None, /, **values: int) -> None:
        self.store = ObjectStore(load_builtin("oat-pmc"), 11)
        for address, raw in commissioned(0.0, 0.0).items():
            self.store.at(address).raw = raw
        self.plant = AxisPlant(50.0, constants, run=run_stiff)
        self.drive = AxisDrive(self.store, self.plant)
        self.time_s = 0.0
        for name, raw in values.items():
            self.put(name.removeprefix("x").replace("_", ":"), raw)

    def put(self, where: str, raw: int) -> None:
        """Give an object a value."""
        self.store.at(parse_address(where)).raw = raw
        self.drive.refresh()

    def start(self, mode: Mode) -> None:
        """Stage on, brake lifted, set-points followed."""
        self.drive.set_mode(mode)
        self.drive.switch_on()
        self.drive.operate(False)

    def go(self, position: int) -> None:
        """To a position, with 6081h, 6083h and 6084h."""
        self.put("607A", position)
        self.drive.new_set_point()

    def run(self, seconds: float, each: Callable[[], None] | None = None) -> None:
        """Let time pass, looking at every cycle where ``each`` is given."""
        left = round(seconds / k.CYCLE_S)
        while left > 0:
            done = self.drive.advance(1 if each is not None else left)
            left -= done
            self.time_s += done * k.CYCLE_S
            if each is not None:
                each()
