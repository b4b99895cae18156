"""The package as a person gets it: one file, installed where there is neither our source nor Node, runs the demo."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from playwright.sync_api import expect, sync_playwright

from tests.e2e.browser import CHROMIUM, FLAGS
from tests.e2e.processes import ROOT, START_S

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

BUILD_S = 120.0
INSTALL_S = 240.0
BIN = "Scripts" if sys.platform == "win32" else "bin"


def build(source: Path, kind: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Build ``kind`` of ``source`` into ``folder``."""
    command = [sys.executable, "-m", "build", kind, "--no-isolation", "--outdir", str(folder), str(source)]
    return subprocess.run(command, check=False, capture_output=True, text=True, timeout=BUILD_S)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of this tree."""
    folder = tmp_path_factory.mktemp("wheel")
    done = build(ROOT, "--wheel", folder)
    assert done.returncode == 0, done.stdout + done.stderr
    (found,) = folder.glob("hubside-*.whl")
    return found


@pytest.fixture(scope="module")
def elsewhere(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fresh environment with the wheel in it, and what it needs by the lock file."""
    folder = tmp_path_factory.mktemp("elsewhere")
    subprocess.run([sys.executable, "-m", "venv", str(folder / "venv")], check=True, timeout=BUILD_S)
    pip = [str(folder / "venv" / BIN / "python"), "-m", "pip", "install", "--quiet", "--no-compile"]
    lock = ["--require-hashes", "--requirement", str(ROOT / "requirements" / "run.txt")]
    for what in (lock, ["--no-deps", str(wheel)]):
        done = subprocess.run([*pip, *what], check=False, capture_output=True, text=True, timeout=INSTALL_S)
        assert done.returncode == 0, done.stdout + done.stderr
    return folder


def bare(folder: Path) -> Mapping[str, str]:
    """An environment in which only what was installed is found: no Node, no source tree."""
    kept = {name: text for name, text in os.environ.items() if name in ("SYSTEMROOT", "TEMP", "LANG")}
    return kept | {"PATH": str(folder / "venv" / BIN), "HOME": str(folder), "HUBSIDE_LANGUAGE": "en"}


@pytest.fixture
def demo(elsewhere: Path) -> Iterator[str]:
    """``hubside demo`` of that environment: the address that it prints."""
    command = [str(elsewhere / "venv" / BIN / "hubside"), "demo", "--json", "--port", "0", "--data", "data"]
    assert shutil.which("node", path=bare(elsewhere)["PATH"]) is None
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, cwd=elsewhere, env=bare(elsewhere), stderr=subprocess.DEVNULL
    ) as process:
        try:
            line = process.stdout.readline() if process.stdout is not None else ""
            yield str(json.loads(line)["url"])
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(START_S)


def test_all_that_the_program_needs_is_inside(wheel: Path) -> None:
    inside = set(zipfile.ZipFile(wheel).namelist())
    wanted = {
        *(f"app/_bundle/od/{path.name}" for path in (ROOT / "od").glob("*.toml")),
        *(f"app/_bundle/od/motors/{path.name}" for path in (ROOT / "od" / "motors").glob("*.csv")),
        *(f"app/_bundle/recordings/{path.name}" for path in (ROOT / "recordings").glob("*.mcap")),
        *(f"app/_bundle/sites/{path.name}" for path in (ROOT / "docs" / "sites").glob("*.toml")),
        *(f"app/locales/{path.name}" for path in (ROOT / "app" / "locales").glob("*.toml")),
        "app/_bundle/page/index.html",
    }
    assert len(wanted) >= 10
    assert wanted <= inside
    assert not [name for name in inside if name.startswith(("tests/", "bench/", "frontend/"))]


def test_the_demo_runs_from_the_wheel_alone_with_live_values_on_its_page(demo: str) -> None:
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        page = chromium.new_page()
        page.goto(demo)
        page.goto(demo.split("?")[0] + "?scene=off")
        for blade in (1, 2, 3):
            angle = page.get_by_test_id(f"blade-{blade}").get_by_test_id("angle")
            expect(angle).to_contain_text("80.00°", timeout=30_000)
        chromium.close()


def test_the_commands_find_their_data_without_the_source(elsewhere: Path) -> None:
    python = str(elsewhere / "venv" / BIN / "python")
    code = "import app, sys; print(app.__file__); from app.cli import main; sys.exit(main(['od', 'check']))"
    done = subprocess.run(
        [python, "-c", code], check=False, capture_output=True, text=True, cwd=elsewhere, env=bare(elsewhere)
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert Path(done.stdout.splitlines()[0]).is_relative_to(elsewhere)


@pytest.mark.parametrize("kind", ["--wheel", "--sdist"])
def test_without_a_built_page_nothing_is_packed(kind: str, tmp_path: Path) -> None:
    source = tmp_path / "source"
    (source / "frontend" / "dist").mkdir(parents=True)  # as it is left by an editable install
    for name in ("pyproject.toml", "README.md", "frontend/page_hook.py"):
        shutil.copy(ROOT / name, source / name)
    for name in ("app", "od", "recordings", "docs"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    done = build(source, kind, tmp_path / "out")
    assert done.returncode != 0
    assert "build the page first (make page)" in done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    assert not list((tmp_path / "out").glob("hubside*"))
