"""A restore over the wire: new, old or incomplete, and what stands in RAM, memory and store then."""

from __future__ import annotations

from app.service.restore.transaction import End
from app.store.restore_rows import RestoreState
from tests.service.restore.conftest import CHANGES, Bench


async def test_a_restore_writes_saves_and_proves_the_station(bench: Bench) -> None:
    before = {(slug, address): await bench.ram(slug, address) for slug, own in CHANGES.items() for address in own}
    restore_id, end = await bench.run(restart=True)
    kept = await bench.desk.get(restore_id)
    assert end is End.NEW, kept.outcome
    assert kept.row.state is RestoreState.DONE and kept.outcome["proven"] is True
    for slug, own in CHANGES.items():
        for address, raw in own.items():
            assert await bench.ram(slug, address) == raw != before[slug, address]
            stored = bench.stored(slug, address)
            assert stored is not None and int.from_bytes(stored, "little") == raw
    assert bench.desk.open == ()
