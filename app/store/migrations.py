"""The versions of the store's schema, each as the statements that lead to it from the one before.

A step that was released is never changed: files made by it are out there. ``user_version`` of the file tells how far
it is. Each step is one transaction with its version number, so that a crash leaves the version before.
"""

from __future__ import annotations

from typing import Final

STEPS: Final[tuple[tuple[str, ...], ...]] = (
    (
        """CREATE TABLE users (
            id TEXT PRIMARY KEY NOT NULL, name TEXT NOT NULL, name_key TEXT NOT NULL UNIQUE, role TEXT NOT NULL,
            password_hash TEXT NOT NULL, disabled INTEGER NOT NULL, created_ns INTEGER NOT NULL
        ) STRICT""",
        """CREATE TABLE sessions (
            id TEXT PRIMARY KEY NOT NULL, secret_hash TEXT NOT NULL UNIQUE, user_id TEXT REFERENCES users (id),
            created_ns INTEGER NOT NULL, expires_ns INTEGER NOT NULL
        ) STRICT""",
        """CREATE TABLE audit (
            seq INTEGER PRIMARY KEY NOT NULL, id TEXT NOT NULL UNIQUE, t_ns INTEGER NOT NULL, person TEXT NOT NULL,
            kind TEXT NOT NULL, device TEXT, address TEXT, details TEXT NOT NULL, previous TEXT NOT NULL,
            hash TEXT NOT NULL
        ) STRICT""",
        "CREATE INDEX audit_device ON audit (device, address, seq)",
        "CREATE INDEX audit_kind ON audit (kind, seq)",
        "CREATE INDEX audit_person ON audit (person, seq)",
        "CREATE TABLE audit_head (one INTEGER PRIMARY KEY NOT NULL, seq INTEGER NOT NULL, hash TEXT NOT NULL) STRICT",
        """CREATE TRIGGER audit_keeps_its_rows BEFORE DELETE ON audit
            BEGIN SELECT RAISE(ABORT, 'rows of the audit log are never deleted'); END""",
        """CREATE TRIGGER audit_never_changes BEFORE UPDATE ON audit
            BEGIN SELECT RAISE(ABORT, 'rows of the audit log are never changed'); END""",
        "CREATE TABLE settings (key TEXT PRIMARY KEY NOT NULL, value TEXT NOT NULL) STRICT",
    ),
    (
        """CREATE TABLE visits (
            id TEXT PRIMARY KEY NOT NULL, turbine TEXT NOT NULL, person TEXT NOT NULL, started_ns INTEGER NOT NULL,
            ended_ns INTEGER, left_open INTEGER NOT NULL, reason TEXT NOT NULL, work_order TEXT NOT NULL
        ) STRICT""",
        "CREATE INDEX visits_turbine ON visits (turbine, started_ns)",
        """CREATE TABLE visit_sets (
            visit_id TEXT NOT NULL REFERENCES visits (id), phase TEXT NOT NULL, device TEXT NOT NULL,
            content TEXT NOT NULL, PRIMARY KEY (visit_id, phase, device)
        ) STRICT""",
    ),
    (
        """CREATE TABLE favourites (
            person TEXT NOT NULL, description_id TEXT NOT NULL, address TEXT NOT NULL, position INTEGER NOT NULL,
            PRIMARY KEY (person, description_id, address)
        ) STRICT""",
    ),
    (
        "CREATE TABLE motors (id TEXT PRIMARY KEY NOT NULL, deleted_ns INTEGER) STRICT",
        """CREATE TABLE motor_versions (
            motor_id TEXT NOT NULL REFERENCES motors (id), version INTEGER NOT NULL, t_ns INTEGER NOT NULL,
            person TEXT NOT NULL, source TEXT NOT NULL, origin TEXT NOT NULL, description_version TEXT NOT NULL,
            content TEXT NOT NULL, PRIMARY KEY (motor_id, version)
        ) STRICT""",
        """CREATE TRIGGER motor_versions_never_change BEFORE UPDATE ON motor_versions
            BEGIN SELECT RAISE(ABORT, 'versions of a motor are never changed'); END""",
        """CREATE TABLE motor_devices (
            id TEXT PRIMARY KEY NOT NULL, device TEXT NOT NULL, motor_id TEXT NOT NULL, version INTEGER NOT NULL,
            t_ns INTEGER NOT NULL, person TEXT NOT NULL
        ) STRICT""",
        "CREATE INDEX motor_devices_device ON motor_devices (device, id)",
    ),
    (
        """CREATE TABLE restores (
            id TEXT PRIMARY KEY NOT NULL, turbine TEXT NOT NULL, station TEXT NOT NULL, state TEXT NOT NULL,
            person TEXT NOT NULL, reason TEXT NOT NULL, work_order TEXT NOT NULL, started_ns INTEGER NOT NULL,
            details TEXT NOT NULL, ended_ns INTEGER, outcome TEXT NOT NULL
        ) STRICT""",
        "CREATE INDEX restores_state ON restores (state, started_ns)",
        """CREATE TABLE restore_values (
            restore_id TEXT NOT NULL REFERENCES restores (id), n INTEGER NOT NULL, device TEXT NOT NULL,
            address TEXT NOT NULL, before TEXT NOT NULL, wanted TEXT NOT NULL, PRIMARY KEY (restore_id, n)
        ) STRICT""",
        """CREATE TABLE restore_steps (
            restore_id TEXT NOT NULL REFERENCES restores (id), n INTEGER NOT NULL, direction TEXT NOT NULL,
            kind TEXT NOT NULL, device TEXT NOT NULL, address TEXT, raw TEXT, begun_ns INTEGER NOT NULL,
            state TEXT NOT NULL, ended_ns INTEGER, details TEXT NOT NULL, PRIMARY KEY (restore_id, n)
        ) STRICT""",
    ),
    (
        """CREATE TABLE set_layouts (
            id INTEGER PRIMARY KEY NOT NULL, description_id TEXT NOT NULL, description_version TEXT NOT NULL,
            addresses TEXT NOT NULL, UNIQUE (description_id, description_version, addresses)
        ) STRICT""",
        """CREATE TABLE set_contents (
            hash TEXT PRIMARY KEY NOT NULL, description_id TEXT NOT NULL, description_version TEXT NOT NULL,
            identity TEXT NOT NULL, size INTEGER NOT NULL, content TEXT NOT NULL
        ) STRICT""",
        """CREATE TABLE set_records (
            id TEXT PRIMARY KEY NOT NULL, hash TEXT NOT NULL REFERENCES set_contents (hash), turbine TEXT NOT NULL,
            station TEXT NOT NULL, device TEXT NOT NULL, node INTEGER NOT NULL, t_ns INTEGER NOT NULL,
            person TEXT NOT NULL, reason TEXT NOT NULL, work_order TEXT NOT NULL, tool TEXT NOT NULL,
            unread TEXT NOT NULL, empty TEXT NOT NULL, source TEXT NOT NULL
        ) STRICT""",
        "CREATE INDEX set_records_device ON set_records (device, t_ns)",
        "CREATE INDEX set_records_hash ON set_records (hash, device, t_ns)",
        "CREATE INDEX set_records_time ON set_records (t_ns, id)",
        """CREATE TABLE set_latest (
            device TEXT PRIMARY KEY NOT NULL, record_id TEXT NOT NULL REFERENCES set_records (id),
            t_ns INTEGER NOT NULL, layout INTEGER NOT NULL REFERENCES set_layouts (id), vector BLOB NOT NULL
        ) STRICT""",
        """CREATE TABLE set_tags (
            seq INTEGER PRIMARY KEY NOT NULL, tag TEXT NOT NULL, scope TEXT NOT NULL,
            visit_id TEXT REFERENCES visits (id), record_id TEXT REFERENCES set_records (id), person TEXT NOT NULL,
            t_ns INTEGER NOT NULL
        ) STRICT""",
        "CREATE INDEX set_tags_scope ON set_tags (tag, scope, visit_id, seq)",
        """CREATE TABLE nameplates (
            seq INTEGER PRIMARY KEY NOT NULL, device TEXT NOT NULL, serial TEXT NOT NULL, person TEXT NOT NULL,
            t_ns INTEGER NOT NULL
        ) STRICT""",
        """CREATE TABLE set_files (
            name TEXT PRIMARY KEY NOT NULL, size_bytes INTEGER NOT NULL, modified_ns INTEGER NOT NULL,
            record_id TEXT REFERENCES set_records (id), line INTEGER, reason TEXT
        ) STRICT""",
        *(
            f"""CREATE TRIGGER {table}_never_{doing.lower()} BEFORE {doing} ON {table}
            BEGIN SELECT RAISE(ABORT, 'rows of {table} are kept as they are'); END"""
            for table in ("set_contents", "set_records", "set_tags", "nameplates")
            for doing in ("UPDATE", "DELETE")
        ),
    ),
    (
        """CREATE TABLE set_evidence (
            record_id TEXT PRIMARY KEY NOT NULL REFERENCES set_records (id), recording TEXT NOT NULL,
            seen TEXT NOT NULL
        ) STRICT""",
    ),
    (
        """CREATE TABLE restore_records (
            seq INTEGER PRIMARY KEY NOT NULL, restore_id TEXT NOT NULL REFERENCES restores (id), t_ns INTEGER NOT NULL,
            text TEXT NOT NULL, seal TEXT NOT NULL
        ) STRICT""",
        *(
            f"""CREATE TRIGGER restore_records_never_{doing.lower()} BEFORE {doing} ON restore_records
            BEGIN SELECT RAISE(ABORT, 'rows of restore_records are kept as they are'); END"""
            for doing in ("UPDATE", "DELETE")
        ),
    ),
    (
        """CREATE TABLE incidents (
            id TEXT PRIMARY KEY NOT NULL, code TEXT NOT NULL UNIQUE, hidden_ns INTEGER, origin TEXT
        ) STRICT""",
        """CREATE TABLE incident_versions (
            incident_id TEXT NOT NULL REFERENCES incidents (id), version INTEGER NOT NULL, t_ns INTEGER NOT NULL,
            person TEXT NOT NULL, content TEXT NOT NULL, PRIMARY KEY (incident_id, version)
        ) STRICT""",
        """CREATE TABLE annotations (
            id TEXT PRIMARY KEY NOT NULL, recording TEXT NOT NULL, incident_id TEXT REFERENCES incidents (id)
        ) STRICT""",
        "CREATE INDEX annotations_recording ON annotations (recording)",
        """CREATE TABLE annotation_versions (
            seq INTEGER PRIMARY KEY NOT NULL, annotation_id TEXT NOT NULL REFERENCES annotations (id),
            t_ns INTEGER NOT NULL, person TEXT NOT NULL, deleted INTEGER NOT NULL, content TEXT NOT NULL
        ) STRICT""",
        "CREATE INDEX annotation_versions_of ON annotation_versions (annotation_id, seq)",
        """CREATE TABLE annotation_files (
            recording TEXT PRIMARY KEY NOT NULL, sha256 TEXT NOT NULL, t_ns INTEGER NOT NULL
        ) STRICT""",
        """CREATE TABLE recording_hashes (
            fingerprint TEXT PRIMARY KEY NOT NULL, sha256 TEXT NOT NULL, t_ns INTEGER NOT NULL
        ) STRICT""",
        *(
            f"""CREATE TRIGGER {table}_never_{doing.lower()} BEFORE {doing} ON {table}
            BEGIN SELECT RAISE(ABORT, 'rows of {table} are kept as they are'); END"""
            for table in ("incident_versions", "annotation_versions")
            for doing in ("UPDATE", "DELETE")
        ),
    ),
    (
        """CREATE TABLE battery_records (
            id TEXT PRIMARY KEY NOT NULL, device TEXT NOT NULL, kind TEXT NOT NULL, t_ns INTEGER NOT NULL,
            person TEXT NOT NULL, content TEXT NOT NULL
        ) STRICT""",
        "CREATE INDEX battery_records_device ON battery_records (device, kind, id)",
        *(
            f"""CREATE TRIGGER battery_records_never_{doing.lower()} BEFORE {doing} ON battery_records
            BEGIN SELECT RAISE(ABORT, 'rows of battery_records are kept as they are'); END"""
            for doing in ("UPDATE", "DELETE")
        ),
    ),
    (
        """CREATE TABLE signal_runs (
            id TEXT PRIMARY KEY NOT NULL, device TEXT NOT NULL, t_ns INTEGER NOT NULL, person TEXT NOT NULL,
            shape TEXT NOT NULL, why TEXT NOT NULL, content TEXT NOT NULL
        ) STRICT""",
        "CREATE INDEX signal_runs_device ON signal_runs (device, t_ns)",
        *(
            f"""CREATE TRIGGER signal_runs_never_{doing.lower()} BEFORE {doing} ON signal_runs
            BEGIN SELECT RAISE(ABORT, 'rows of signal_runs are kept as they are'); END"""
            for doing in ("UPDATE", "DELETE")
        ),
    ),
    (
        """CREATE TABLE scope_captures (
            id TEXT PRIMARY KEY NOT NULL, trigger_ns INTEGER NOT NULL, head TEXT NOT NULL, samples BLOB NOT NULL,
            in_force TEXT NOT NULL
        ) STRICT""",
        "CREATE INDEX scope_captures_time ON scope_captures (trigger_ns)",
    ),
    (
        "ALTER TABLE scope_captures ADD COLUMN marks TEXT NOT NULL DEFAULT '[]'",
        "UPDATE scope_captures SET marks = json_extract(head, '$.marks'), head = json_remove(head, '$.marks')",
    ),
)
SCHEMA: Final = len(STEPS)
"""The version that this program writes."""
