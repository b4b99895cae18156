"""The drivers by the bus they speak. A driver, and with it its library, is imported when it is first asked for."""

from __future__ import annotations

from importlib import import_module
from typing import Any, Final

from app.errors import ExtraMissingError, UsageError
from app.model.description import Bus

DRIVERS: Final[dict[Bus, tuple[str, str]]] = {
    Bus.CANOPEN: ("app.drivers.canopen", "CanOpenDriver"),
    Bus.MODBUS_TCP: ("app.drivers.modbus", "ModbusDriver"),
    Bus.PROFIBUS_DP: ("app.drivers.profibus_driver", "ProfibusDriver"),
}
"""Module and class of each driver."""
EXTRAS: Final = {"pyprofibus": "profibus"}
"""The optional extra of ours that brings a package."""


def driver_class(bus: Bus) -> type[Any]:
    """The driver of ``bus``. Raises UsageError where a library is missing, ExtraMissingError where an extra has it."""
    module, name = DRIVERS[bus]
    try:
        found: type[Any] = getattr(import_module(module), name)
    except ModuleNotFoundError as error:
        package = str(error.name).partition(".")[0]
        if package in EXTRAS:
            raise ExtraMissingError(package=package, extra=EXTRAS[package]) from error
        raise UsageError(reason=f"{bus.value} needs the package {error.name}") from error
    return found
