"""The tables as SQLAlchemy knows them. ``migrations`` makes them; a test holds the two against each other."""

from __future__ import annotations

from sqlalchemy import Column, ForeignKey, Integer, LargeBinary, MetaData, Table, Text, UniqueConstraint

metadata = MetaData()

users = Table(
    "users",
    metadata,
    Column("id", Text, primary_key=True),
    Column("name", Text, nullable=False),
    Column("name_key", Text, nullable=False, unique=True),
    Column("role", Text, nullable=False),
    Column("password_hash", Text, nullable=False),
    Column("disabled", Integer, nullable=False),
    Column("created_ns", Integer, nullable=False),
)
"""``name_key`` is the name as it is compared: without regard to case."""

sessions = Table(
    "sessions",
    metadata,
    Column("id", Text, primary_key=True),
    Column("secret_hash", Text, nullable=False, unique=True),
    Column("user_id", Text, ForeignKey("users.id")),
    Column("created_ns", Integer, nullable=False),
    Column("expires_ns", Integer, nullable=False),
)
"""``user_id`` NULL: opened by a launch token. The secret itself is never kept."""

audit = Table(
    "audit",
    metadata,
    Column("seq", Integer, primary_key=True),
    Column("id", Text, nullable=False, unique=True),
    Column("t_ns", Integer, nullable=False),
    Column("person", Text, nullable=False),
    Column("kind", Text, nullable=False),
    Column("device", Text),
    Column("address", Text),
    Column("details", Text, nullable=False),
    Column("previous", Text, nullable=False),
    Column("hash", Text, nullable=False),
)
"""``details`` is canonical JSON; ``previous`` and ``hash`` are SHA-256 in hexadecimal digits (see ``audit_chain``)."""

audit_head = Table(
    "audit_head",
    metadata,
    Column("one", Integer, primary_key=True),
    Column("seq", Integer, nullable=False),
    Column("hash", Text, nullable=False),
)
"""One row: the last of ``audit``, so that rows missing at the end are noticed."""

settings = Table(
    "settings",
    metadata,
    Column("key", Text, primary_key=True),
    Column("value", Text, nullable=False),
)
"""``value`` is JSON."""

visits = Table(
    "visits",
    metadata,
    Column("id", Text, primary_key=True),
    Column("turbine", Text, nullable=False),
    Column("person", Text, nullable=False),
    Column("started_ns", Integer, nullable=False),
    Column("ended_ns", Integer),
    Column("left_open", Integer, nullable=False),
    Column("reason", Text, nullable=False),
    Column("work_order", Text, nullable=False),
)

visit_sets = Table(
    "visit_sets",
    metadata,
    Column("visit_id", Text, ForeignKey("visits.id"), primary_key=True),
    Column("phase", Text, primary_key=True),
    Column("device", Text, primary_key=True),
    Column("content", Text, nullable=False),
)
"""The values of a device as found or as left: ``content`` is a parameter set (hubside-set/1)."""

favourites = Table(
    "favourites",
    metadata,
    Column("person", Text, primary_key=True),
    Column("description_id", Text, primary_key=True),
    Column("address", Text, primary_key=True),
    Column("position", Integer, nullable=False),
)

motors = Table(
    "motors",
    metadata,
    Column("id", Text, primary_key=True),
    Column("deleted_ns", Integer),
)
"""A motor that was deleted is not listed any more; its versions stay readable."""

motor_versions = Table(
    "motor_versions",
    metadata,
    Column("motor_id", Text, ForeignKey("motors.id"), primary_key=True),
    Column("version", Integer, primary_key=True),
    Column("t_ns", Integer, nullable=False),
    Column("person", Text, nullable=False),
    Column("source", Text, nullable=False),
    Column("origin", Text, nullable=False),
    Column("description_version", Text, nullable=False),
    Column("content", Text, nullable=False),
)
"""``content`` is a draft (``model.motor.dump_draft``). Rows are never changed."""

motor_devices = Table(
    "motor_devices",
    metadata,
    Column("id", Text, primary_key=True),
    Column("device", Text, nullable=False),
    Column("motor_id", Text, nullable=False),
    Column("version", Integer, nullable=False),
    Column("t_ns", Integer, nullable=False),
    Column("person", Text, nullable=False),
)
"""Which motor a device drives: the newest row of a device counts. The motor may be an example, which is not stored."""

restores = Table(
    "restores",
    metadata,
    Column("id", Text, primary_key=True),
    Column("turbine", Text, nullable=False),
    Column("station", Text, nullable=False),
    Column("state", Text, nullable=False),
    Column("person", Text, nullable=False),
    Column("reason", Text, nullable=False),
    Column("work_order", Text, nullable=False),
    Column("started_ns", Integer, nullable=False),
    Column("details", Text, nullable=False),
    Column("ended_ns", Integer),
    Column("outcome", Text, nullable=False),
)
"""``details`` and ``outcome`` are JSON (see ``service.restore``)."""

restore_values = Table(
    "restore_values",
    metadata,
    Column("restore_id", Text, ForeignKey("restores.id"), primary_key=True),
    Column("n", Integer, primary_key=True),
    Column("device", Text, nullable=False),
    Column("address", Text, nullable=False),
    Column("before", Text, nullable=False),
    Column("wanted", Text, nullable=False),
)

restore_steps = Table(
    "restore_steps",
    metadata,
    Column("restore_id", Text, ForeignKey("restores.id"), primary_key=True),
    Column("n", Integer, primary_key=True),
    Column("direction", Text, nullable=False),
    Column("kind", Text, nullable=False),
    Column("device", Text, nullable=False),
    Column("address", Text),
    Column("raw", Text),
    Column("begun_ns", Integer, nullable=False),
    Column("state", Text, nullable=False),
    Column("ended_ns", Integer),
    Column("details", Text, nullable=False),
)
"""Each row is committed before its step is carried out."""

restore_records = Table(
    "restore_records",
    metadata,
    Column("seq", Integer, primary_key=True),
    Column("restore_id", Text, ForeignKey("restores.id"), nullable=False),
    Column("t_ns", Integer, nullable=False),
    Column("text", Text, nullable=False),
    Column("seal", Text, nullable=False),
)
"""``text`` is the canonical JSON of a record; one at each end of a restore, the last one counts."""

set_layouts = Table(
    "set_layouts",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("description_id", Text, nullable=False),
    Column("description_version", Text, nullable=False),
    Column("addresses", Text, nullable=False),
    UniqueConstraint("description_id", "description_version", "addresses"),
)
"""What the words of a vector are: ``addresses`` in their order, with blanks between (``model.set_vector``)."""

set_contents = Table(
    "set_contents",
    metadata,
    Column("hash", Text, primary_key=True),
    Column("description_id", Text, nullable=False),
    Column("description_version", Text, nullable=False),
    Column("identity", Text, nullable=False),
    Column("size", Integer, nullable=False),
    Column("content", Text, nullable=False),
)
"""``hash`` is the SHA-256 of ``content`` (``ParameterSet.content``); ``size`` is the number of its values."""

set_records = Table(
    "set_records",
    metadata,
    Column("id", Text, primary_key=True),
    Column("hash", Text, ForeignKey("set_contents.hash"), nullable=False),
    Column("turbine", Text, nullable=False),
    Column("station", Text, nullable=False),
    Column("device", Text, nullable=False),
    Column("node", Integer, nullable=False),
    Column("t_ns", Integer, nullable=False),
    Column("person", Text, nullable=False),
    Column("reason", Text, nullable=False),
    Column("work_order", Text, nullable=False),
    Column("tool", Text, nullable=False),
    Column("unread", Text, nullable=False),
    Column("empty", Text, nullable=False),
    Column("source", Text, nullable=False),
)
"""An occasion on which a content was taken. ``unread`` (address: why) and ``empty`` are JSON."""

set_latest = Table(
    "set_latest",
    metadata,
    Column("device", Text, primary_key=True),
    Column("record_id", Text, ForeignKey("set_records.id"), nullable=False),
    Column("t_ns", Integer, nullable=False),
    Column("layout", Integer, ForeignKey("set_layouts.id"), nullable=False),
    Column("vector", LargeBinary, nullable=False),
)
"""The latest record of each device with its values as words (``model.set_vector``): a fleet is read in one go.

It follows from ``set_records``, and is changed with them.
"""

set_tags = Table(
    "set_tags",
    metadata,
    Column("seq", Integer, primary_key=True),
    Column("tag", Text, nullable=False),
    Column("scope", Text, nullable=False),
    Column("visit_id", Text, ForeignKey("visits.id")),
    Column("record_id", Text, ForeignKey("set_records.id")),
    Column("person", Text, nullable=False),
    Column("t_ns", Integer, nullable=False),
)
"""A history: of each tag, scope and visit the newest row counts; ``record_id`` NULL takes the tag off."""

nameplates = Table(
    "nameplates",
    metadata,
    Column("seq", Integer, primary_key=True),
    Column("device", Text, nullable=False),
    Column("serial", Text, nullable=False),
    Column("person", Text, nullable=False),
    Column("t_ns", Integer, nullable=False),
)
"""A history: of each device the newest row counts."""

set_files = Table(
    "set_files",
    metadata,
    Column("name", Text, primary_key=True),
    Column("size_bytes", Integer, nullable=False),
    Column("modified_ns", Integer, nullable=False),
    Column("record_id", Text, ForeignKey("set_records.id")),
    Column("line", Integer),
    Column("reason", Text),
)
"""Set files of the data folder that were looked at: the record made of each, or the line and reason why none was."""

set_evidence = Table(
    "set_evidence",
    metadata,
    Column("record_id", Text, ForeignKey("set_records.id"), primary_key=True),
    Column("recording", Text, nullable=False),
    Column("seen", Text, nullable=False),
)
"""Of a set out of a recording, how each value was seen there. ``seen`` is JSON: address to time and direction."""

incidents = Table(
    "incidents",
    metadata,
    Column("id", Text, primary_key=True),
    Column("code", Text, nullable=False, unique=True),
    Column("hidden_ns", Integer),
    Column("origin", Text),
)
"""``code`` is that of short links. ``origin`` is JSON: where an incident came from that was made elsewhere."""

incident_versions = Table(
    "incident_versions",
    metadata,
    Column("incident_id", Text, ForeignKey("incidents.id"), primary_key=True),
    Column("version", Integer, primary_key=True),
    Column("t_ns", Integer, nullable=False),
    Column("person", Text, nullable=False),
    Column("content", Text, nullable=False),
)
"""``content`` is JSON. Rows never change."""

recording_annotations = Table(
    "annotations",
    metadata,
    Column("id", Text, primary_key=True),
    Column("recording", Text, nullable=False),
    Column("incident_id", Text, ForeignKey("incidents.id")),
)
"""Marks on a recording, named by its file."""

annotation_versions = Table(
    "annotation_versions",
    metadata,
    Column("seq", Integer, primary_key=True),
    Column("annotation_id", Text, ForeignKey("annotations.id"), nullable=False),
    Column("t_ns", Integer, nullable=False),
    Column("person", Text, nullable=False),
    Column("deleted", Integer, nullable=False),
    Column("content", Text, nullable=False),
)
"""A history: of each annotation the newest row counts. ``content`` is JSON."""

annotation_files = Table(
    "annotation_files",
    metadata,
    Column("recording", Text, primary_key=True),
    Column("sha256", Text, nullable=False),
    Column("t_ns", Integer, nullable=False),
)
"""What was last written beside each recording, so that a file of another hand is noticed."""

recording_hashes = Table(
    "recording_hashes",
    metadata,
    Column("fingerprint", Text, primary_key=True),
    Column("sha256", Text, nullable=False),
    Column("t_ns", Integer, nullable=False),
)
"""The hash of a whole file by that of its ends and its size: a large file is read once."""

battery_records = Table(
    "battery_records",
    metadata,
    Column("id", Text, primary_key=True),
    Column("device", Text, nullable=False),
    Column("kind", Text, nullable=False),
    Column("t_ns", Integer, nullable=False),
    Column("person", Text, nullable=False),
    Column("content", Text, nullable=False),
)
"""Tests and changes of batteries; ``content`` is JSON of ``service.battery.records``. Rows are kept as they are."""
signal_runs = Table(
    "signal_runs",
    metadata,
    Column("id", Text, primary_key=True),
    Column("device", Text, nullable=False),
    Column("t_ns", Integer, nullable=False),
    Column("person", Text, nullable=False),
    Column("shape", Text, nullable=False),
    Column("why", Text, nullable=False),
    Column("content", Text, nullable=False),
)
"""Test signals that were run. ``content`` is JSON. Rows never change."""
scope_captures = Table(
    "scope_captures",
    metadata,
    Column("id", Text, primary_key=True),
    Column("trigger_ns", Integer, nullable=False),
    Column("head", Text, nullable=False),
    Column("samples", LargeBinary, nullable=False),
    Column("in_force", Text, nullable=False),
    Column("marks", Text, nullable=False),
)
"""``head``, ``in_force`` and ``marks`` are JSON, ``samples`` packed arrays (``service.scope.capture``)."""
