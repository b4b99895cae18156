"""Whatever faults are put in and taken out, in whatever order: nothing fails, and in the end all is as it was."""

from __future__ import annotations

from typing import Any, cast

from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import UsageError
from app.model.fault import CATALOGUE, FaultKind, FaultOrder, FaultTarget
from app.twins.faults import Instructor
from app.twins.line import Port
from app.twins.plant import BrakeFault, EncoderFault
from app.twins.pmm_temperature import SensorState
from tests.twins.harness import MS
from tests.twins.turbine_rig import PMCS, PMMS, TurbineRig

blades = st.integers(1, 3)
nodes = st.sampled_from((*PMMS, *PMCS))


def orders_of(kind: FaultKind) -> st.SearchStrategy[FaultOrder]:
    """Orders of a kind, with any values that it takes."""
    values = {
        one.name: st.integers(int(one.low), int(one.high)) if one.integer else st.floats(one.low, one.high)
        for one in kind.parameters
        if one.name != "first_id"
    }
    of_blade = kind.target is FaultTarget.BLADE or (kind.target is FaultTarget.TURBINE and not kind.momentary)
    return st.builds(
        FaultOrder,
        st.just(kind.id),
        blade=(blades if kind.target is FaultTarget.BLADE else st.none() | blades) if of_blade else st.none(),
        node={FaultTarget.NODE: nodes, FaultTarget.BUS: st.none() | nodes}.get(kind.target, st.none()),
        values=st.fixed_dictionaries({}, optional=values),
        seconds=st.none() if kind.momentary else st.none() | st.floats(0, 0.4),
    )


orders = st.one_of([orders_of(kind) for kind in CATALOGUE.values()])
steps = st.lists(st.tuples(st.integers(0, 60), orders | st.integers(0, 3)), max_size=10)


def held(rig: TurbineRig) -> dict[str, Any]:
    """All that a fault may hold."""
    ports = [cast("Port", device.port) for device in rig.turbine.devices.values()]
    found: dict[str, Any] = {"nodes": rig.line.nodes, "live": [port.live for port in ports]}
    for blade in rig.turbine.blades:
        axis, power = blade.axis, blade.power
        slip = axis.blade_encoder_slip_deg
        found[f"axis {blade.number}"] = (
            axis.brake_stuck, axis.encoder_fault, axis.blade_encoder_failed, slip, axis.extra_load_nm,
        )  # fmt: skip
        found[f"mains {blade.number}"] = power.mains_present, power.mains_factor, tuple(power.phases)
        found[f"heat {blade.number}"] = power.extra_heat_sink_w, power.extra_motor_w, power.extra_battery_w
        found[f"sensors {blade.number}"] = tuple(blade.pmm.inputs.sensors)
        found[f"blocs {blade.number}"] = tuple((bloc.capacity_share, bloc.ohm_factor) for bloc in power.blocs)
        for device in blade.devices:
            memory = device.memory
            found[f"node {device.node_id}"] = memory.slow_ns, memory.failing, device.answer_delay_ns
    return found


HEALTHY_AXIS = (BrakeFault.NONE, EncoderFault.NONE, False, 0.0, 0.0)


@given(steps=steps, seed=st.integers(0, 9))
@settings(max_examples=40, deadline=None)
def test_all_ends_as_it_began(steps: list[tuple[int, FaultOrder | int]], seed: int) -> None:
    rig = TurbineRig(seed=seed)
    before = held(rig)
    assert before["axis 1"] == HEALTHY_AXIS
    assert before["sensors 1"] == (SensorState.FITTED, SensorState.FITTED)
    for wait_ms, what in steps:
        rig.run(wait_ms / 1000)
        if isinstance(what, FaultOrder):
            rig.instructor.inject(what)
        else:
            clear_one(rig.instructor, what)
    rig.instructor.clear_all()
    assert rig.instructor.active == ()
    rig.run(5 * MS / 1e9)  # a controller that was bus off for a moment only must wait
    assert held(rig) == before
    rig.run(0.2)
    for node, device in rig.turbine.devices.items():
        assert device.power.value == "on", node


def clear_one(instructor: Instructor, place: int) -> None:
    """Take out the fault at this place, if there is one."""
    faults = instructor.active
    if place < len(faults):
        instructor.clear(faults[place].id)
        try:
            instructor.clear(faults[place].id)
        except UsageError:
            return
        raise AssertionError("it was cleared twice")
