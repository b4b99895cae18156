"""What the 3D view is brought to show of a live state, and when."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator

import pytest

from app.model.address import Address
from app.scene.blade import PITCH_AXIS
from app.scene.hub import BladeState, HubScene, RotorPose
from app.scene.solids import quaternion
from app.service.rotor_view import NOBODY, RotorLine, rotor_line
from app.service.scene_feed import SceneFeed, rotor_pose
from app.service.shown import LiveShown
from app.wire.frame import Can, Direction, Frame
from app.wire.live import LiveState
from app.wire.records import EnvironmentSeen
from app.wire.twin_environment import CAN_ID, TwinEnvironment, pack_environment
from tests.scene.viewer import Viewer, viewing
from tests.web.rig import BUS, Feeder, bench_with, make_connection

DEADLINE_S = 10.0
WIND = TwinEnvironment(10.0, 0.5, 8.0, 5.0)
SECOND = 1_000_000_000


class Rig:
    """A bench whose bus is fed by hand, and a scene that follows it step by step."""

    def __init__(self, scene: HubScene) -> None:
        self.connection = make_connection()
        self.bench = bench_with(self.connection)
        self.feeder = Feeder(self.connection)
        self.scene = scene
        self.feed = SceneFeed(LiveShown(self.bench), scene)

    def angle(self, node: int, cdeg: int) -> None:
        """Somebody reads the angle of an axis that is enabled."""
        self.feeder.read(node, Address(0x6092, 1), (36_000).to_bytes(4, "little"))
        self.feeder.read(node, Address(0x6092, 2), (1).to_bytes(4, "little"))
        self.feeder.read(node, Address(0x6064), cdeg.to_bytes(4, "little"))
        self.feeder.read(node, Address(0x6041), (0x0237).to_bytes(2, "little"))

    def environment(self, environment: TwinEnvironment) -> None:
        """A twin tells rotor and wind."""
        can = Can(CAN_ID, pack_environment(environment), extended=True)
        self.connection.buses[BUS].on_frames([Frame(self.connection.stamper(), BUS, Direction.RX, can)])


@pytest.fixture
def rig() -> Iterator[Rig]:
    scene = HubScene("a secret of this test")
    yield Rig(scene)
    scene.close()


async def until(holds: Callable[[], bool]) -> None:
    async with asyncio.timeout(DEADLINE_S):
        while not holds():  # noqa: ASYNC110  what is waited for has no event
            await asyncio.sleep(0.01)


async def step_until(rig: Rig, holds: Callable[[], bool]) -> None:
    now_s = asyncio.get_running_loop().time
    await until(lambda: rig.feed.step(now_s()) is not None and holds())


def pitched(viewer: Viewer, blade: int, angle_deg: float) -> bool:
    """The viewer was told this angle last."""
    return viewer.turns.get(f"/rotor/blade-{blade}/pitch") == pytest.approx(quaternion(PITCH_AXIS, angle_deg))


async def test_nothing_is_shown_while_nobody_looks(rig: Rig) -> None:
    rig.angle(12, 4500)
    assert rig.feed.step(0.0) is False
    async with viewing(rig.scene) as viewer:
        await until(lambda: rig.scene.watched)
        await until(lambda: "/rotor/blade-2" in viewer.turns)
        assert not pitched(viewer, 2, 45.0)
        await step_until(rig, lambda: pitched(viewer, 2, 45.0))
        await until(lambda: "color" in viewer.updates.get("/rotor/blade-2/pitch/blade", {}))
        colour = tuple(viewer.updates["/rotor/blade-2/pitch/blade"]["color"])
        assert colour == BladeState.ENABLED.rgb


async def test_who_looks_later_sees_nothing_that_is_over(rig: Rig) -> None:
    rig.angle(12, 4500)
    async with viewing(rig.scene) as viewer:
        await step_until(rig, lambda: pitched(viewer, 2, 45.0))
    await until(lambda: not rig.scene.watched)
    assert rig.feed.step(1.0) is False
    async with viewing(rig.scene) as later:
        name = "/rotor/blade-2/pitch/blade"
        await until(lambda: later.updates.get(name, {}).get("opacity") == BladeState.UNKNOWN.opacity)


async def test_thirty_poses_a_second_of_three_blades_all_arrive(rig: Rig) -> None:
    """Each step shows what was read before it; the viewer ends at the last, and had most of those between."""
    async with viewing(rig.scene) as viewer:
        await until(lambda: rig.scene.watched)
        for number in range(60):
            for node in (11, 12, 13):
                rig.angle(node, 1000 + 10 * number)
            rig.feed.step(number / 30)
            await asyncio.sleep(1 / 30)
        await until(lambda: all(pitched(viewer, blade, 15.9) for blade in (1, 2, 3)))
        assert viewer.windows > 3 * 30


async def test_after_the_connection_ends_nothing_is_known(rig: Rig) -> None:
    rig.angle(12, 4500)
    async with viewing(rig.scene) as viewer:
        await step_until(rig, lambda: pitched(viewer, 2, 45.0))
        rig.bench.connection = None
        rig.bench.epoch += 1
        name = "/rotor/blade-2/pitch/blade"
        await step_until(rig, lambda: viewer.updates.get(name, {}).get("opacity") == BladeState.UNKNOWN.opacity)


async def test_the_rotor_shows_what_was_received_and_leaves_out_what_nobody_sees(rig: Rig) -> None:
    async with viewing(rig.scene) as viewer:
        rig.environment(WIND)
        turned = quaternion((1.0, 0.0, 0.0), 10.0)
        await step_until(rig, lambda: viewer.turns.get("/rotor") == pytest.approx(turned))
        rig.environment(WIND._replace(azimuth_deg=10.5))
        rig.feed.step(100.0)
        rig.environment(WIND._replace(azimuth_deg=12.0))
        further = quaternion((1.0, 0.0, 0.0), 12.0)
        told: list[tuple[float, ...]] = []

        def arrived() -> bool:
            told.append(viewer.turns["/rotor"])
            return bool(told[-1] == pytest.approx(further))

        await step_until(rig, arrived)
        assert all(turn in (pytest.approx(turned), pytest.approx(further)) for turn in told)


def test_an_old_wind_blows_no_more_and_the_rotor_stands_where_it_was_seen() -> None:
    live = LiveState()
    assert rotor_line(live, 0) is NOBODY
    assert rotor_pose(NOBODY) == RotorPose()
    live.apply(EnvironmentSeen(5 * SECOND, BUS, 0, WIND))
    fresh = rotor_line(live, 6 * SECOND)
    assert fresh == RotorLine(*WIND, t_ns=5 * SECOND, stale=False)
    assert rotor_pose(fresh) == RotorPose(10.0, 8.0, 5.0)
    assert rotor_pose(rotor_line(live, 6 * SECOND + 1)) == RotorPose(10.0)
