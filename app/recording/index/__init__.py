"""The index beside a recording: what a timeline, plots and a seek need, without reading all frames again.

Events, signs, gaps, least and greatest values over time, values of parameters over time, bus load, and keyframes of the
whole state. It is made of the recording alone, and made anew where it no longer fits.
"""

from app.recording.index.build import build_index
from app.recording.index.content import (
    CancelledError,
    Change,
    Gap,
    GapKind,
    Load,
    Series,
    SeriesKind,
    SignalInfo,
    SignalKey,
)
from app.recording.index.course import Course, Mark, Step, marks_of, steps
from app.recording.index.frames import course_at
from app.recording.index.index import RecordingIndex, open_index
from app.recording.index.near import NearFrames
from app.recording.index.place import index_path

__all__ = [
    "CancelledError",
    "Change",
    "Course",
    "Gap",
    "GapKind",
    "Load",
    "Mark",
    "NearFrames",
    "RecordingIndex",
    "Series",
    "SeriesKind",
    "SignalInfo",
    "SignalKey",
    "Step",
    "build_index",
    "course_at",
    "index_path",
    "marks_of",
    "open_index",
    "steps",
]
