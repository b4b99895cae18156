"""Records a scenario: twins, rotor and controller in bulk, as fast as the machine goes, through the real recorder.

Nothing reads a clock: the times of the recording are those of the simulated line, counted from a fixed moment, so that
the same scenario makes the same recording. What a service master sends is ours (``tx``), all else was heard (``rx``).
"""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from app import __version__
from app.cli.scenario_notes import BUS, ScenarioNotes
from app.errors import RecordingError
from app.model.description import Description
from app.model.description_file import load_builtin
from app.model.od_export import to_json
from app.recording.content import AttachedFile, EventKind, RecorderClock, RecordingInfo
from app.recording.pack import pack
from app.recording.writer import RecorderCore, RecorderSettings
from app.twins.faults import Instructor
from app.twins.line import CanLine
from app.twins.plant_kernel import Run, run_compiled
from app.twins.rotor import Rotor
from app.twins.scenario import Scenario, load_scenario
from app.twins.surroundings import Surroundings
from app.twins.turbine import START_ANGLE_DEG, Settings, Turbine
from app.wire.decoder import CanOpenDecoder
from app.wire.frame import Can, Direction, Frame, Stamper
from app.wire.live import LiveState

BIT_RATE: Final = 500_000
TURBINE: Final = "wtg-07"
PERSON: Final = "scenario"
BEGIN_NS: Final = 1_772_431_200_000_000_000
"""2 March 2026, 6:00 UTC: any fixed moment would do."""
_PART_NS: Final = 3_600_000_000_000
"""Scenarios begin on the hour of their seed, so that a list by time has them in order."""
_STEP_NS: Final = 50_000_000
_WORKING_DEG: Final = 45.0
"""A turbine that begins with less pitch than this has been turning."""


@dataclass(frozen=True, slots=True)
class Recorded:
    """A finished recording: its file, its frames, its size in bytes and its length in s."""

    file: Path
    frames: int
    size_bytes: int
    seconds: float


class _Stage:
    """Twins, rotor and instructor of one scenario on a line."""

    def __init__(self, scenario: Scenario, run: Run) -> None:
        self.line = CanLine(BIT_RATE)
        pmm, pmc = load_builtin("oat-pmm"), load_builtin("oat-pmc")
        angle_deg = START_ANGLE_DEG if scenario.start.angle_deg is None else scenario.start.angle_deg
        self.turbine = Turbine(self.line, pmm, pmc, Settings(angle_deg=angle_deg, run=run))
        rotor = Rotor(scenario.seed)
        axes = [blade.axis for blade in self.turbine.blades]
        self.surroundings = Surroundings(self.line, rotor, axes)
        if scenario.start.wind_mps is not None:
            self.surroundings.mean_wind_mps = scenario.start.wind_mps
        if angle_deg < _WORKING_DEG:
            rotor.settle([angle_deg] * len(axes))
        self.instructor = Instructor(self.turbine, self.line, self.surroundings, scenario.seed)
        self.descriptions: dict[int, Description] = {}
        self.slugs: dict[int, str] = {}
        for blade in self.turbine.blades:
            for device, unit in zip(blade.devices, ("pmm", "pmc"), strict=True):
                self.descriptions[device.node_id] = device.description
                self.slugs[device.node_id] = f"{TURBINE}/blade-{blade.number}/{unit}"


class _Tape:
    """The recorder behind the line: stamps, decodes for keyframes, notes."""

    def __init__(self, folder: Path, scenario: Scenario, source: AttachedFile, stage: _Stage) -> None:
        self._begin_ns = BEGIN_NS + scenario.seed % 1000 * _PART_NS
        self._line = stage.line
        self._ours: list[Can] = []
        self._frames: list[Frame] = []
        self._now_ns = 0
        self._stamp = Stamper(self._begin_ns, lambda: self._now_ns)
        self.live = LiveState()
        for node, description in stage.descriptions.items():
            self.live.set_description(BUS, node, description)
        self._decoder = CanOpenDecoder(BUS, stage.descriptions)
        clock = RecorderClock(lambda: self._now_ns, lambda: self._begin_ns + self._now_ns, self._stamp)
        settings = RecorderSettings(flush_s=5.0, min_free_bytes=0, max_file_bytes=1 << 40, max_file_s=1e9)
        known = {one.id: one for one in stage.descriptions.values()}
        info = RecordingInfo(
            TURBINE,
            PERSON,
            {BUS: BIT_RATE},
            {f"{BUS}/{node}": f"{slug} {stage.descriptions[node].id}" for node, slug in stage.slugs.items()},
            {"hubside": __version__} | {one.id: one.version for one in known.values()},
        )
        attached = [
            AttachedFile(f"descriptions/{one.id}.json", "application/json", to_json(one).encode())
            for one in known.values()
        ]
        self.recorder = RecorderCore(folder, info, clock, [source, *attached], settings)
        self._line.tap(self._heard)

    def ours(self, can: Can) -> None:
        """Our own master sends this frame."""
        self._ours.append(can)

    def note(self, kind: EventKind, text_key: str, device: str, **details: Any) -> None:
        """Note an event as of now."""
        self._now_ns = self._line.now_ns
        who = {"device": device or None, "person": PERSON, "text_key": text_key}
        self.recorder.event(kind, BUS, self._stamp(), **who, **details)

    def cycle(self) -> None:
        """Hand over what came; a keyframe where one is due."""
        self._now_ns = self._line.now_ns
        self.recorder.write(self._frames)
        self._frames.clear()
        self.live.tick(self._begin_ns + self._now_ns)
        if self.recorder.keyframe_due():
            state = {"live": self.live.snapshot(), "decoders": {BUS: self._decoder.snapshot()}}
            self.recorder.keyframe(state, self.live.t_ns or self._stamp())
        self.recorder.cycle()

    def _heard(self, _start_ns: int, end_ns: int, can: Can) -> None:
        self._now_ns = end_ns
        direction = Direction.TX if self._is_ours(can) else Direction.RX
        frame = Frame(self._stamp(), BUS, direction, can)
        self._frames.append(frame)
        self.live.apply_all(self._decoder.feed(frame))

    def _is_ours(self, can: Can) -> bool:
        """By the very object, for another master may send equal frames."""
        for place, mine in enumerate(self._ours):
            if mine is can:
                del self._ours[: place + 1]
                return True
        return False


def record_scenario(path: Path, out: Path, run: Run | None = None) -> Recorded:
    """Record the scenario of ``path`` into ``out``, in the archive form; a file that was there is replaced.

    ``run`` runs the plants' cycles, compiled where None. Raises UsageError (scenario) and RecordingError (recording).
    """
    scenario = load_scenario(path)
    source = AttachedFile(path.name, "application/toml", path.read_bytes())
    stage = _Stage(scenario, run_compiled() if run is None else run)
    with tempfile.TemporaryDirectory() as name:
        tape = _Tape(Path(name), scenario, source, stage)
        try:
            _play(scenario, stage, tape)
        except BaseException as error:
            tape.recorder.give_up(repr(error))
            raise
        tape.recorder.shut()
        status = tape.recorder.status()
        if status.file is None or status.lost:
            raise RecordingError(file=out.name, offset=0, reason=status.detail or f"{status.lost} frames were lost")
        fresh = Path(name) / "packed.mcap"
        pack(status.file, fresh)
        staged = out.with_name(f".{out.name}.{os.getpid()}")
        staged.write_bytes(fresh.read_bytes())
        staged.replace(out)
    return Recorded(out, status.frames, out.stat().st_size, scenario.duration_s)


def _play(scenario: Scenario, stage: _Stage, tape: _Tape) -> None:
    line = stage.line
    stage.turbine.power_on(line.now_ns)
    stage.surroundings.start(line.now_ns)
    player = stage.instructor.play(scenario)
    player.master.on_send(tape.ours)
    notes = ScenarioNotes(scenario, stage.slugs, stage.descriptions, tape.live, tape.note)
    notes.schedule(player.since_ns, line.call_at)
    end_ns = player.since_ns + scenario.duration_ns
    while line.now_ns < end_ns:
        line.run_until(min(line.now_ns + _STEP_NS, end_ns))
        notes.watch(player, line.now_ns)
        tape.cycle()
