"""``hubside export``, ``import``, ``cut``, ``merge`` and ``anonymise``: what they write, say and refuse."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from app.cli.main import main
from app.recording.exchange.cut import CutOrder, cut
from app.recording.index import open_index
from app.recording.reader import open_recording
from app.wire.frame import Frame

VISIT = Path(__file__).resolve().parents[2] / "recordings" / "scenarios" / "7-service-visit.mcap"
S = 1_000_000_000
BEGIN_NS = 1_772_456_400_000_000_000 + 38 * S


@pytest.fixture(scope="module")
def part(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("exchange") / "visit.mcap"
    cut(VISIT, path, CutOrder(BEGIN_NS, BEGIN_NS + 6 * S))
    return path


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[dict[str, Any], str]:
    """The result and what was said beside it."""
    code = main([*map(str, arguments), "--json"])
    out, err = capsys.readouterr()
    assert code == 0, err
    found: dict[str, Any] = json.loads(out)
    return found, err


def frames(path: str | Path) -> list[Frame]:
    with open_recording(Path(path), strict=True) as recording:
        return list(recording.frames())


def test_modbus_goes_to_wireshark_and_not_into_a_log_of_can(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bench = VISIT.with_name("pd4e-bench.mcap")
    done, _ = run(capsys, "export", bench, "--format", "pcapng", "--output", tmp_path / "bench.pcapng")
    assert (done["frames"], done["channels"]) == (len(frames(bench)), ["lan"])
    assert (tmp_path / "bench.pcapng").stat().st_size > 100 * done["frames"]
    for form in ("candump", "asc", "blf", "trc", "csv"):
        assert main(["export", str(bench), "--format", form, "--output", str(tmp_path / "none"), "--json"]) == 2
        assert "take pcapng" in capsys.readouterr().err
    assert not (tmp_path / "none").exists()


def test_there_and_back_again(part: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    done, said = run(capsys, "export", part, "--format", "candump", "--exact", "--output", tmp_path / "visit.log")
    assert "attachments stay behind" in said
    assert "time" not in done["losses"]
    made, said = run(
        capsys, "import", tmp_path / "visit.log", "--output", tmp_path / "in", "--bitrate", "can0=500000",
        "--node", "can0/11=oat-pmc:wtg-07/blade-1/pmc",
    )  # fmt: skip
    (file,) = made["parts"]
    assert said == ""
    assert Path(file).name.endswith("-wtg-07-001.mcap")
    assert frames(file) == frames(part)
    index = open_index(Path(file))
    assert index is not None, "made at once: its trips are known"
    index.close()
    with open_recording(Path(file)) as recording:
        assert recording.info.nodes == {"can0/11": "wtg-07/blade-1/pmc oat-pmc"}
        assert recording.info.bit_rates == {"can0": 500_000}


def test_losses_are_told_before_anything_is_written(
    part: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "visit.log"
    told, said = run(capsys, "export", part, "--format", "candump", "--losses", "--output", target)
    assert told["losses"]["time"] > 1000
    assert f"{told['losses']['time']} time stamps lose what is below one microsecond in candump" in said
    assert not target.exists()


def test_a_site_file_tells_what_the_nodes_are(part: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(capsys, "export", part, "--format", "trc", "--output", tmp_path / "visit.trc")
    site = Path(__file__).resolve().parents[2] / "docs" / "sites" / "example.toml"
    made, _ = run(capsys, "import", tmp_path / "visit.trc", "--output", tmp_path / "in", "--site", site)
    with open_recording(Path(made["parts"][0])) as recording:
        assert recording.info.turbine == "wtg-07"
        assert recording.info.nodes["can0/12"] == "wtg-07/blade-2/pmc oat-pmc"


def test_cuts_merge_and_lose_their_names(part: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(capsys, "cut", part, "--until", "4", "--output", tmp_path / "a.mcap")
    run(capsys, "cut", part, "--from", "2026-03-02T13:00:41Z", "--output", tmp_path / "b.mcap")
    done, _ = run(capsys, "merge", tmp_path / "a.mcap", tmp_path / "b.mcap", "--output", tmp_path / "m.mcap")
    assert frames(tmp_path / "m.mcap") == frames(part)
    assert done["duplicates"] > 300
    run(capsys, "merge", tmp_path / "a.mcap", tmp_path / "b.mcap", "--output", tmp_path / "s.mcap",
        "--offset-s", "2=10", "--rename", "2:can0=hub")  # fmt: skip
    last = frames(tmp_path / "s.mcap")[-1]
    assert (last.bus, last.t_ns) == ("hub", frames(part)[-1].t_ns + 10 * S)
    run(capsys, "anonymise", tmp_path / "m.mcap", "--output", tmp_path / "x.mcap", "--hide-times")
    assert len(frames(tmp_path / "x.mcap")) == len(frames(part))
    assert b"wtg-07" not in (tmp_path / "x.mcap").read_bytes()


def test_signals_as_parquet_and_messages_as_plain_mcap(
    part: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    done, _ = run(capsys, "export", part, "--parquet", "--output", tmp_path / "t.parquet", "--wide", "--from", "2",
                  "--signal", "wtg-07/blade-1/pmc:6064", "--signal", "can0/12:6041")  # fmt: skip
    assert pq.read_table(tmp_path / "t.parquet").num_rows == done["rows"] > 100
    run(capsys, "export", part, "--format", "mcap", "--output", tmp_path / "plain.mcap")
    assert frames(tmp_path / "plain.mcap") == frames(part)


def test_what_is_wrong_is_said_in_the_person_s_language(
    part: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HUBSIDE_LANGUAGE", "de")
    bad = tmp_path / "bad.log"
    bad.write_text("(1750000000.000001) can0 181#0102\nrubbish\n")
    assert main(["import", str(bad), "--output", str(tmp_path / "in")]) == 2
    said = capsys.readouterr().err
    assert "bad.log, Zeile 2" in said
    assert "Erwartet wird eine Zeile von candump" in said
    assert "rubbish" in said
    made, said = run(capsys, "import", bad, "--output", tmp_path / "in", "--lenient")
    assert made["remarks"] == {"skipped": 1}
    assert "Zeile 2: rubbish" in said


@pytest.mark.parametrize(
    "arguments",
    [
        ("export", "{part}"),
        ("export", "{part}", "--format", "blf", "--bus", "can9"),
        ("export", "{part}", "--format", "mcap", "--output", "{part}"),
        ("cut", "{part}", "--from", "yesterday"),
        ("cut", "{part}", "--from", "900"),
        ("merge", "{part}", "{part}", "--output", "{tmp}/m.mcap", "--offset-s", "3=1"),
        ("merge", "{part}", "{part}", "--output", "{tmp}/m.mcap", "--offset-s", "1=inf"),
        ("import", "{part}", "--node", "can0/128=oat-pmc:a/b/c"),
        ("import", "{part}", "--node", "can0/1=oat-xyz:a/b/c"),
        ("import", "{tmp}/missing.log"),
        ("anonymise", "{part}", "--output", "{tmp}/x.mcap", "--object", "nothing"),
    ],
)
def test_what_makes_no_sense_is_refused(
    arguments: tuple[str, ...], part: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = [text.format(part=part, tmp=tmp_path) for text in arguments]
    try:
        code = main([*given, "--data", str(tmp_path / "data")])
    except SystemExit as error:
        code = int(error.code or 0)
    assert code == 2
    assert capsys.readouterr().err
    assert not list(tmp_path.glob("*.mcap"))
