"""The site file of the demo: its twins wherever they answer, and what was added to it stays."""

from __future__ import annotations

from pathlib import Path

from app.cli.demo_site import demo_site
from app.model.description import Bus
from app.model.site import Turbine, load_site
from app.model.site_write import with_turbine, without_turbine

FIRST = "socketcand:127.0.0.1:29536"
LATER = "socketcand:127.0.0.1:40001"
SERVO = "127.0.0.1:1502"
SERVO_LATER = "127.0.0.1:40002"
LINE = "/dev/pts/7"
LINE_LATER = "/dev/pts/8"


def turbines(path: Path) -> dict[str, Turbine]:
    return {one.slug: one for one in load_site(path)}


def test_the_twins_are_found_wherever_they_answer(tmp_path: Path) -> None:
    for can, modbus, line in ((FIRST, SERVO, LINE), (LATER, SERVO_LATER, LINE_LATER), (FIRST, SERVO_LATER, LINE)):
        known = turbines(demo_site(tmp_path, can, modbus, line))
        assert list(known) == ["wtg-07", "bench-pd4e", "bench-ed2"]
        assert [bus.connection for bus in known["wtg-07"].buses] == [can]
        (servo,) = known["bench-pd4e"].devices
        assert (servo.address, known["bench-pd4e"].buses[0].ranges) == (modbus, (modbus,))
        assert [bus.connection for bus in known["bench-ed2"].buses] == [f"profibus:{line}"]


def test_where_nobody_can_speak_with_the_cylinders_they_are_there_to_be_asked_for(tmp_path: Path) -> None:
    (line,) = turbines(demo_site(tmp_path, FIRST, SERVO, None))["bench-ed2"].buses
    assert line.kind is Bus.PROFIBUS_DP, "the page says what is missing as soon as one connects to it"
    (line,) = turbines(demo_site(tmp_path, FIRST, SERVO, LINE))["bench-ed2"].buses
    assert line.connection == f"profibus:{LINE}"


def test_what_was_added_in_the_page_stays(tmp_path: Path) -> None:
    path = demo_site(tmp_path, FIRST, SERVO, LINE)
    turbine = turbines(path)["wtg-07"]
    text = (Path("docs/sites/example.toml").read_text(encoding="utf-8")).replace("wtg-07", "wtg-08")
    other = tmp_path / "other.toml"
    other.write_text(text.replace("WTG-07", "WTG-08"), encoding="utf-8")
    path.write_text(with_turbine(path.read_text(encoding="utf-8"), load_site(other)[0], str(path)), encoding="utf-8")
    known = turbines(demo_site(tmp_path, LATER, SERVO, LINE))
    assert list(known) == [turbine.slug, "bench-pd4e", "bench-ed2", "wtg-08"]
    assert known["wtg-07"].buses[0].connection == LATER
    assert known["wtg-08"].buses[0].connection == FIRST, "another turbine's adapter is its own affair"


def test_a_file_from_before_the_servo_gets_it_and_loses_nothing(tmp_path: Path) -> None:
    path = tmp_path / "demo-site.toml"
    text = Path("docs/sites/example.toml").read_text(encoding="utf-8")
    text = text.replace('name = "WTG-07"', 'name = "my own name"  # and my own words')
    path.write_text(text, encoding="utf-8")
    known = turbines(demo_site(tmp_path, LATER, SERVO_LATER, LINE))
    assert known["wtg-07"].name == "my own name"
    assert known["bench-pd4e"].devices[0].address == SERVO_LATER
    assert "# and my own words" in path.read_text(encoding="utf-8")


def test_what_was_changed_of_the_servo_stays(tmp_path: Path) -> None:
    path = demo_site(tmp_path, FIRST, SERVO, LINE)
    text = path.read_text(encoding="utf-8").replace(
        'ranges = ["127.0.0.1:1502"]', 'ranges = ["127.0.0.1:1502", "[::1]"]'
    )
    text = text.replace("Bench PD4-E", "My bench").replace('address = "127', 'external_stop = "button", address = "127')
    path.write_text(text, encoding="utf-8")
    bench = turbines(demo_site(tmp_path, FIRST, SERVO_LATER, LINE))["bench-pd4e"]
    (servo,) = bench.devices
    assert (bench.name, servo.external_stop, servo.address) == ("My bench", "button", SERVO_LATER)
    assert bench.buses[0].ranges == (SERVO_LATER, "[::1]")


def test_a_servo_that_was_taken_out_by_hand_is_left_out(tmp_path: Path) -> None:
    path = demo_site(tmp_path, FIRST, SERVO, LINE)
    text = path.read_text(encoding="utf-8").replace("servo", "drive-2")
    path.write_text(text, encoding="utf-8")
    before = path.read_bytes()
    demo_site(tmp_path, FIRST, SERVO_LATER, LINE)
    assert path.read_bytes() == before, "a device of another name is none of the demo's"


def test_a_file_without_the_demos_turbine_is_made_anew(tmp_path: Path) -> None:
    (tmp_path / "demo-site.toml").write_text("schema = 1\n", encoding="utf-8")
    assert list(turbines(demo_site(tmp_path, LATER, SERVO, LINE))) == ["wtg-07", "bench-pd4e", "bench-ed2"]


def test_other_turbines_outlive_the_demos_own(tmp_path: Path) -> None:
    path = demo_site(tmp_path, FIRST, SERVO, LINE)
    path.write_text(without_turbine(path.read_text(encoding="utf-8"), "wtg-07", str(path)), encoding="utf-8")
    path.write_text(path.read_text(encoding="utf-8").replace("Bench PD4-E", "My bench"), encoding="utf-8")
    known = turbines(demo_site(tmp_path, LATER, SERVO, LINE))
    assert list(known) == ["wtg-07", "bench-pd4e", "bench-ed2"]
    assert known["bench-pd4e"].name == "My bench"
