"""``python -m tests.twins.make_plots FOLDER`` draws what docs/twins.md shows of a mains failure, from the twins.

Two simulations on a virtual clock; the same code gives the same bytes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from matplotlib.figure import Figure

from app.twins.turbine import Blade
from tests.twins.harness import MS, SECOND
from tests.twins.oat_rig import BladeRig
from tests.twins.turbine_rig import PMCS, TurbineRig

MAINS_FAILURE: Final = "twin-mains-failure.svg"
TIME_TO_FEATHER: Final = "twin-time-to-feather.svg"
GREY: Final = "#808080"
COLOURS: Final = ("#3b82f6", "#d97706", "#10a37f", "#a855f7")
"""Middle tones: they stand out on a dark page and on a light one."""
STYLE: Final[Any] = {
    "svg.hashsalt": "twins", "svg.fonttype": "none", "font.size": 9, "text.color": GREY, "axes.edgecolor": GREY,
    "axes.labelcolor": GREY, "xtick.color": GREY, "ytick.color": GREY, "grid.color": GREY, "grid.alpha": 0.3,
    "axes.grid": True, "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False,
    "savefig.transparent": True,
}  # fmt: skip
SAMPLE_S: Final = 0.02
BEFORE_S, AFTER_S = 2.0, 33.0
FINE_FROM_S, FINE_TO_S = 2.9, 4.4
WINDS_MPS: Final = (0.0, 10.0, 20.0, 30.0)
MOMENTS_KNM: Final = (0.0, 10.0, 20.0, 30.0, 40.0)
LONGEST_S: Final = 40

Source = Callable[[Blade], float]
COURSES: Final[dict[str, Source]] = {
    "angle": lambda blade: blade.axis.angle_deg,
    "dc link": lambda blade: blade.power.dc_link_v,
    "battery A": lambda blade: blade.power.battery_a,
    "battery V": lambda blade: blade.power.battery_v,
    "hold-up": lambda blade: blade.pmm.device.store.number(0x30B2) / 1000,
    "shut-down": lambda blade: float(blade.pmm.device.store.number(0x30B3)),
}
Courses = dict[str, list[list[float]]]


def at_work() -> TurbineRig:
    """All blades at 2 degrees in a wind of 12 m/s, enabled and holding their position."""
    rig = TurbineRig(angle_deg=2.0)
    rig.surroundings.rotor.wind.set_mean(12.0)
    for node in PMCS:
        for where, number, size in (("6060", 1, 1), ("6081", 800, 4), ("6040", 0x010F, 2)):
            rig.master.put(node, where, number, size)
    return rig


def mains_failure() -> tuple[list[float], Courses, list[float], list[float]]:
    """Time in s from the failure and the courses of each blade; then time and DC link of blade 1, in 1 ms."""
    rig = at_work()
    times: list[float] = []
    courses: Courses = {name: [[] for _ in rig.turbine.blades] for name in COURSES}
    fine_times: list[float] = []
    fine: list[float] = []
    rig.run(1.0)
    start_ns = rig.line.now_ns + round(BEFORE_S * SECOND)
    failed = False
    while (t_s := (rig.line.now_ns - start_ns) / SECOND) < AFTER_S:
        if t_s >= 0 and not failed:
            rig.fault("mains_failure")
            failed = True
        near = FINE_FROM_S <= t_s < FINE_TO_S
        for blade in rig.turbine.blades:
            blade.advance(rig.line.now_ns)
        if near:
            fine_times.append(t_s)
            fine.append(rig.turbine.blades[0].power.dc_link_v)
        if not times or t_s - times[-1] >= SAMPLE_S:
            times.append(t_s)
            for name, source in COURSES.items():
                for course, blade in zip(courses[name], rig.turbine.blades, strict=True):
                    course.append(source(blade))
        rig.run(0.001 if near else SAMPLE_S)
    return times, courses, fine_times, fine


def time_to_feather(charge: float, ohm_factor: float, wind_mps: float = 0.0, against_knm: float = 0.0) -> float:
    """From 0 degrees to the 90 degree switch by an EFC on battery, in s; not a number where it takes too long."""
    rig = BladeRig(0.0)
    power, axis = rig.blade.power, rig.blade.axis
    axis.wind_mps, axis.extra_load_nm = wind_mps, -1000 * against_knm
    for bloc in power.blocs:
        bloc.charge, bloc.ohm_factor = charge, ohm_factor
    power.mains_present = False
    rig.master.run(SECOND)
    rig.pmc.inputs.efc = False
    start_ns = rig.line.now_ns
    while not axis.at_90:
        if rig.line.now_ns - start_ns > LONGEST_S * SECOND:
            return float("nan")
        rig.master.run(10 * MS)
    return (rig.line.now_ns - start_ns) / SECOND


BATTERIES: Final = (
    ("new, 95 % charged", 0.95, 1.0),
    ("new, 5 % charged", 0.05, 1.0),
    ("resistance x 8, 50 % charged", 0.5, 8.0),
    ("resistance x 16, 50 % charged", 0.5, 16.0),
)


def draw_mains_failure() -> Figure:
    times, courses, fine_times, fine = mains_failure()
    figure = Figure(figsize=(8, 10), layout="constrained")
    angle, link, near, current, voltage, timers = figure.subplots(6, 1)
    for number, colour in enumerate(COLOURS[:3]):
        angle.plot(times, courses["angle"][number], color=colour, label=f"blade {number + 1}")
        link.plot(times, courses["dc link"][number], color=colour)
        current.plot(times, courses["battery A"][number], color=colour)
        voltage.plot(times, courses["battery V"][number], color=colour)
    near.plot(fine_times, fine, color=COLOURS[0], label="blade 1")
    timers.plot(times, courses["hold-up"][0], color=COLOURS[0], label="30B2h, to the emergency mode")
    timers.plot(times, courses["shut-down"][0], color=COLOURS[1], label="30B3h, to the shut-down")
    named = {
        angle: "blade angle, °", link: "DC link, V", near: "DC link, V", current: "battery, A", voltage: "battery, V",
        timers: "timers of blade 1, s",
    }  # fmt: skip
    for axes, label in named.items():
        axes.set_ylabel(label)
    for axes in (angle, near, timers):
        axes.legend()
    timers.set_xlabel("time from the mains failure, s")
    return figure


def draw_time_to_feather() -> Figure:
    figure = Figure(figsize=(8, 4), layout="constrained")
    windy, loaded = figure.subplots(1, 2, sharey=True)
    for (label, charge, ohm_factor), colour in zip(BATTERIES, COLOURS, strict=True):
        in_wind = [time_to_feather(charge, ohm_factor, wind_mps=wind) for wind in WINDS_MPS]
        windy.plot(WINDS_MPS, in_wind, color=colour, marker="o")
        against = [time_to_feather(charge, ohm_factor, against_knm=moment) for moment in MOMENTS_KNM]
        loaded.plot(MOMENTS_KNM, against, color=colour, marker="o", label=label)
    windy.set_xlabel("wind, m/s")
    loaded.set_xlabel("moment against the way to feather, kNm")
    windy.set_ylabel("time from 0° to the 90° switch, s")
    windy.set_ylim(bottom=0)
    loaded.legend()
    return figure


def main(arguments: Sequence[str]) -> int:
    """Draw into the folder that is named. Gives the exit code."""
    if len(arguments) != 1:
        print("usage: python -m tests.twins.make_plots FOLDER", file=sys.stderr)
        return 2
    folder = Path(arguments[0])
    with mpl.rc_context(STYLE):
        for name, draw in ((MAINS_FAILURE, draw_mains_failure), (TIME_TO_FEATHER, draw_time_to_feather)):
            draw().savefig(folder / name, format="svg", metadata={"Date": None, "Creator": None})
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
