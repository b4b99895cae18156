"""For every rule: what breaks it, what just keeps it, and the value without which it cannot be judged.

Changes of the PMM come first, those of the PMC second; all else is as it should be (``stations.healthy``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tests.model.rules.stations import Changes


@dataclass(frozen=True)
class Example:
    """``without``: an address that is taken away, of the PMC where ``of_pmc``."""

    broken: tuple[Changes, Changes]
    kept: tuple[Changes, Changes]
    without: str
    of_pmc: bool = False


def _pmm(broken: Changes, kept: Changes, without: str) -> Example:
    return Example((broken, {}), (kept, {}), without)


def _pmc(broken: Changes, kept: Changes, without: str) -> Example:
    return Example(({}, broken), ({}, kept), without, of_pmc=True)


EXAMPLES: Final = {
    "oat.dc_link_ladder": _pmm({"30FA:01": 420}, {"30FA:01": 421}, "30FA:01"),
    "oat.pmc_minimum_below_battery": Example(({}, {"6510:04": 216}), ({}, {"6510:04": 215}), "3020:04"),
    "oat.chopper_above_booster": _pmm({"30FC:02": 599}, {"30FC:02": 600}, "30FB:07"),
    "oat.nominal_dc_link": _pmm({"3062": 690}, {"3062": 380}, "3062"),
    "oat.booster_inductance": _pmm({"30FB:09": 0}, {"30FB:09": 1}, "30FB:09"),
    "oat.hold_up_time": _pmm({"30E0": 2999}, {"30E0": 3000}, "30E0"),
    "oat.shut_down_time": Example(({"30E1": 14}, {}), ({"30E1": 15}, {}), "5681", of_pmc=True),
    "oat.battery_type": _pmm({"3020:01": 0x18}, {"3020:01": 0xA1}, "3020:01"),
    "oat.bloc_voltages": _pmm({"3020:05": 41000}, {"3020:05": 40999}, "3020:06"),
    "oat.battery_resistance": _pmm({"3020:08": 0}, {"3020:08": 1}, "3020:08"),
    "oat.self_test_time": _pmm({"30E3": 59}, {"30E3": 60}, "30E3"),
    "oat.self_test_off": _pmm({"30E3": 0}, {"30E3": 10080}, "30E3"),
    "oat.charging_voltage": _pmm({"30F1:04": 247}, {"30F1:04": 246}, "30F1:04"),
    "oat.charging_voltage_low": _pmm({"30F1:04": 245}, {"3020:06": 41100}, "3020:06"),
    "oat.recharge_threshold": _pmm({"30F1:05": 246}, {"30F1:05": 245}, "30F1:05"),
    "oat.switch_off_current": _pmm({"30F1:06": 100}, {"30F1:06": 600}, "3020:02"),
    "oat.charge_ends_at_once": _pmm({"3020:03": 300}, {"3020:03": 301}, "3020:03"),
    "oat.charging_current_beyond_supply": _pmm({"3020:03": 1500}, {"3020:03": 1499}, "30F0:03"),
    "oat.supply_warning": _pmm({"30C0": 8000}, {"30C0": 7999}, "30C0"),
    "oat.software_limits": _pmc({"607D:01": 9500}, {"607D:01": -200}, "607D:01"),
    "oat.feather_reachable": _pmc({"607D:02": 8999}, {"607D:02": 9000}, "607D:02"),
    "oat.within_limits": _pmc({"5681": 1001}, {"5681": 1000, "5684": 60000}, "607F"),
    "oat.feather_angle": _pmc({"567A": 7900}, {"567A": 8700}, "6092:02"),
    "oat.efc_values": _pmc({"5683": 0}, {"5683": 1}, "5683"),
    "oat.efc_deceleration": _pmc({"5684": 0}, {"5684": 1}, "5684"),
    "oat.acceleration_zero": _pmc({"6083": 0}, {"6083": 1}, "6083"),
    "oat.acceleration_limit_zero": _pmc({"60C5": 0}, {"60C5": 1}, "60C5"),
    "oat.max_profile_velocity": _pmc({"607F": 1064}, {"607F": 1063}, "6091:02"),
    "oat.following_error_window": _pmc({"6065": 29, "60FB:02": 500}, {"6065": 30, "60FB:02": 500}, "60FB:01"),
    "oat.position_gain": _pmc({"60FB:01": 0}, {"60FB:01": 1}, "60FB:01"),
    "oat.interpolation_period": _pmc({"60C2:02": -4}, {"60C2:01": 2, "60C2:02": -2}, "60C2:02"),
    "oat.controller_mode": _pmc({"6510:09": 1}, {"6510:09": 2}, "6510:09"),
    "oat.brake_time": _pmc({"60F9:04": 49}, {"60F9:04": 0}, "60F9:04"),
    "oat.motor_type": _pmc({"6402": 0}, {"6402": 10}, "6402"),
    "oat.rated_current": _pmc({"6076": 0}, {"6076": 1}, "6076"),
    "oat.motor_slip": _pmc({"6410:01": 2}, {"6410:01": 2, "6410:04": 1450}, "6410:06"),
    "oat.motor_speed_zero": _pmc({"6080": 0}, {"6080": 3500}, "6080"),
    "oat.motor_temperatures": _pmc({"6410:08": 1500}, {"6410:08": 1499}, "6410:07"),
    "oat.heat_sink_temperatures": _pmc({"6510:06": 800}, {"6510:06": 799}, "6510:02"),
    "oat.encoder_resolution": _pmc({"688F:01": 1000}, {"688F:01": 4096, "688F:02": 2}, "688F:01"),
    "oat.polarity_bits": _pmc({"687E": 0x80}, {"687E": 0xC0}, "607E"),
    "oat.blade_encoder_feed": _pmc({"6892:01": 3600}, {"6892:01": 72000, "6892:02": 2}, "6892:01"),
    "oat.blade_encoder_gear": _pmc({"6891:01": 1, "6891:02": 1}, {"6891:02": 12}, "6891:02"),
    "oat.blade_encoder_simulated": _pmc({"5894": 0xFF}, {"5894": 3}, "5894"),
    "oat.following_error_off": _pmc({"6065": 0xFFFFFFFF}, {"6065": 0xFFFFFFFE}, "6065"),
    "oat.difference_off": _pmc({"6866": 0}, {"6866": 1}, "6865"),
    "oat.target_on_overshoot": _pmc({"6068": 0}, {"6068": 1}, "6068"),
    "oat.masked_errors": _pmc({"6510:07": 0xBFFF}, {"6510:07": 0x7FFF}, "6510:07"),
    "oat.simulation_mode": _pmc({"60FB:03": 0x8001}, {"60FB:03": 0x0301}, "60FB:03"),
    "oat.limit_switches_crossable": _pmc({"60FB:03": 0x4001}, {"60FB:03": 0}, "60FB:03"),
    "oat.unused_flags": _pmc({"60FB:03": 0x0003}, {"60FB:03": 0x0300}, "60FB:03"),
    "oat.connection_loss": _pmc({"6007": 0}, {"6007": 3}, "6007"),
    "oat.fault_reaction": _pmc({"605E": -1}, {"605E": 0}, "605E"),
    "oat.heartbeat_off": _pmc({"1017": 0}, {"1017": 100}, "1017"),
    "oat.temperature_limits": _pmm({"3110:01": 550}, {"3110:01": 549}, "3110:02"),
    "oat.temperature_bands": _pmm({"3201:01": 400}, {"3201:01": 399}, "3201:03"),
    "oat.temperature_hysteresis": _pmm({"3203:03": 0}, {"3202:03": 0}, "3203:03"),
    "oat.cooling_after_warning": _pmm({"3201:02": 501}, {"3201:02": 500}, "3110:01"),
    "oat.controller_without_fan": _pmm({"3201:06": 0}, {"3201:04": 0, "3201:06": 0}, "3201:06"),
    "oat.motor_fan_off": _pmm({"3204:03": 0}, {"3204:03": 1}, "3204:03"),
    "oat.motor_fan_temperature": Example(({"3204:01": 8}, {}), ({"3204:01": 1299}, {}), "6410:08", of_pmc=True),
    "oat.outputs_shared": _pmm({"3202:06": 0x0010}, {"3202:06": 0x0100}, "3202:06"),
    "oat.outputs_of_controller": _pmm({"30FE:02": 0x0040}, {"30FE:02": 0x0101}, "30FE:02"),
    "oat.outputs_without_clamp": _pmm({"3220:03": 0x1000}, {"3220:03": 0x0100}, "3220:03"),
    "oat.fault_output": _pmm({"30FF:01": 0}, {"30FF:01": 0x0200}, "30FF:01"),
    "oat.alarm_without_input": _pmm({"3300:01": 0x4000}, {"3300:01": 0x4200}, "3300:08"),
    "oat.alarm_of_several_inputs": _pmm({"3300:01": 0x4300}, {"3300:01": 0x4200}, "3300:01"),
    "oat.alarms_shared": _pmm(
        {"3300:01": 0x4200, "3300:02": 0x0200}, {"3300:01": 0x4200, "3300:02": 0x0400}, "3300:02"
    ),
    "oat.input_check_pulse": _pmm({"30E2": 40}, {"30E2": 41}, "30E2"),
    "oat.position_range": _pmm({"3220:01": 8700}, {"3220:01": 8699}, "3220:02"),
    "oat.position_range_unit": Example(
        ({"3220:03": 0x0100}, {"6092:01": 3600}), ({"3220:03": 0x0100}, {}), "6092:01", of_pmc=True
    ),
    "oat.mirror_overflow": _pmc({"607D:02": 32768}, {"607D:02": 32767}, "607F"),
}
