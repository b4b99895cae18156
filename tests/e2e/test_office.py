"""The commands for users, audit log and store, and what a command on a bus leaves in the log."""

from __future__ import annotations

import csv
import io
import subprocess
from pathlib import Path

from app.store import database
from tests.e2e.conftest import Twins
from tests.e2e.processes import HUBSIDE, ROOT, hubside
from tests.service.test_audit import tamper

GOOD = "pitch and yaw 7"


def users(data: Path, *arguments: str, given: str = "") -> subprocess.CompletedProcess[str]:
    command = [*HUBSIDE, "--data", str(data), "users", *arguments]
    return subprocess.run(command, input=given, capture_output=True, text=True, cwd=ROOT, timeout=60, check=False)


def test_users_are_kept_from_the_command_line_and_no_password_is_an_argument(tmp_path: Path) -> None:
    assert users(tmp_path, "add", "Anna", "--role", "viewer", given=f"{GOOD}\n").returncode == 0
    assert users(tmp_path, "add", "Ben", given="short\n").returncode == 3
    assert users(tmp_path, "add", "Ben", given=f"{GOOD}\n").returncode == 0
    listed = hubside("users", "list", "--json", data=tmp_path).json
    assert [(one["name"], one["role"]) for one in listed] == [("Anna", "expert"), ("Ben", "technician")]
    assert users(tmp_path, "role", "Anna", "viewer").returncode == 3
    assert users(tmp_path, "role", "Ben", "expert").returncode == 0
    assert users(tmp_path, "disable", "Anna").returncode == 0
    assert users(tmp_path, "password", "Ben", given="another password\n").returncode == 0
    assert users(tmp_path, "add", "Carl", "--password", GOOD).returncode == 2
    rows = hubside("audit", "list", "--json", data=tmp_path).json
    assert [row["kind"] for row in rows][::-1] == [
        "user_added",
        "user_added",
        "user_role",
        "user_disabled",
        "user_password",
    ]
    assert GOOD not in str(rows)


def test_a_write_by_command_stands_in_the_log_which_is_exported_and_verified(twins: Twins, tmp_path: Path) -> None:
    data = tmp_path / "data"
    site = ("--site", str(twins.site))
    assert hubside("write", *site, "wtg-07/blade-1/pmm", "3110:01", "49.0", "--save", data=data).code == 0
    assert hubside("restart", *site, "wtg-07/blade-1/pmm", data=data).code == 0
    export = hubside("audit", "export", "--csv", "--device", "wtg-07", data=data)
    rows = list(csv.DictReader(io.StringIO(export.out)))
    assert [(row["kind"], row["address"]) for row in rows] == [("written", "3110:01"), ("saved", ""), ("restart", "")]
    head = hubside("audit", "head", "--json", data=data).json
    noted = f"{head['seq']}:{head['hash']}"
    assert hubside("audit", "verify", "--head", noted, data=data).code == 0
    assert hubside("audit", "verify", "--head", f"{head['seq']}:{'0' * 64}", data=data).code == 4
    assert hubside("audit", "verify", "--head", "nonsense", data=data).code == 2
    tamper(data, f"UPDATE audit SET person = 'x' WHERE seq = {rows[0]['seq']}")
    broken = hubside("audit", "verify", "--json", data=data)
    assert (broken.code, broken.json["broken_seq"], broken.json["breach"]) == (4, int(rows[0]["seq"]), "changed")


def test_the_store_is_checked_backed_up_and_restored(tmp_path: Path) -> None:
    data, backup = tmp_path / "data", tmp_path / "backup.sqlite3"
    assert users(data, "add", "Anna", given=f"{GOOD}\n").returncode == 0
    assert hubside("store", "backup", str(backup), data=data).code == 0
    assert hubside("store", "backup", str(backup), data=data).code == 2
    assert hubside("store", "check", "--json", data=data).json["users"] == 1
    path = data / database.FILE
    path.write_bytes(path.read_bytes()[:6000])
    damaged = hubside("store", "check", "--json", data=data)
    assert (damaged.code, damaged.error["error"]) == (2, "store_damaged")
    assert str(path) in damaged.error["text"]
    restored = hubside("store", "restore", str(backup), "--json", data=data)
    assert restored.code == 0
    assert Path(restored.json["aside"]).stat().st_size == 6000
    assert hubside("store", "check", "--json", data=data).json["users"] == 1
