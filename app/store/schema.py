"""The tables as SQLAlchemy knows them. ``migrations`` makes them; a test holds the two against each other."""

from __future__ import annotations

from sqlalchemy import Column, ForeignKey, Integer, MetaData, Table, Text

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
