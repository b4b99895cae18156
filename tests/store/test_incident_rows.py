"""Rows of incidents and annotations: versions that nobody rewrites, codes that are unique, histories."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from app.errors import StoreError
from app.model.incident import Annotation, Draft, Incident, Note, Origin, SignalRef, Span
from app.store import incident_rows
from app.store.store import Store

DRAFT = Draft(
    recording="trip.mcap",
    fingerprint="17-ab",
    turbine="wtg-07",
    span=Span(10, 90),
    at_ns=50,
    title="Blatt 2 löst aus",
    notes="zwei\nZeilen",
    tags=("8611h",),
    plots=((SignalRef.parse("wtg-07/blade-2/pmc/6064"), SignalRef.parse("wtg-07/blade-2/ed2/12/221")),),
    camera="hub",
    loop=Span(20, 60),
)
ORIGIN = Origin("a.hubside-incident", "hubside 1", "Ben", 5, 7, "Anna", "long.mcap", "ff" * 32)
INCIDENT = Incident("i1", "abc2345", 1, DRAFT, 100, "Anna", 100, "Anna", origin=ORIGIN)
MARK = Annotation("a1", "trip.mcap", Span(20, 30), "first", Note.ERROR, "#ff0000", "Anna", 5, extra={"k": "v"})


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    opened = Store.open(tmp_path)
    yield opened
    opened.close()


def put(store: Store, *incidents: Incident) -> None:
    for one in incidents:
        store.call(lambda kept, one=one: incident_rows.put_version(kept, one))  # type: ignore[misc]


def test_an_incident_comes_back_as_it_was_with_its_first_author(store: Store) -> None:
    second = replace(INCIDENT, version=2, person="Ben", t_ns=200, draft=replace(DRAFT, title="later", loop=None))
    other = replace(INCIDENT, id="i2", code="zzz2345", origin=None)
    put(store, INCIDENT, second, other)
    assert store.call(incident_rows.newest) == [other, second]
    assert store.call(lambda kept: incident_rows.versions_of(kept, "i1")) == [second, INCIDENT]
    assert store.call(lambda kept: incident_rows.versions_of(kept, "abc2345"))[0] == second


def test_a_hidden_one_is_found_by_name_alone_and_another_version_lists_it_again(store: Store) -> None:
    put(store, INCIDENT)
    store.call(lambda kept: incident_rows.hide(kept, "i1", 300))
    assert store.call(incident_rows.newest) == []
    assert store.call(lambda kept: incident_rows.newest(kept, hidden=True)) == [replace(INCIDENT, hidden=True)]
    put(store, replace(INCIDENT, version=2))
    assert [one.version for one in store.call(incident_rows.newest)] == [2]


def test_no_two_incidents_have_one_code_and_no_version_is_rewritten(store: Store) -> None:
    put(store, INCIDENT)
    with pytest.raises(StoreError):
        put(store, replace(INCIDENT, id="i2"))
    for order in ("UPDATE incident_versions SET content = '{}'", "DELETE FROM incident_versions"):
        with pytest.raises(StoreError):
            store.call(lambda kept, order=order: kept.exec_driver_sql(order))  # type: ignore[misc]
    assert store.call(incident_rows.newest) == [INCIDENT]


def test_of_an_annotation_the_newest_row_counts_and_all_are_kept(store: Store) -> None:
    put(store, INCIDENT)
    early = replace(MARK, id="a2", span=Span(3, 3), incident="i1", foreign=True)
    store.call(lambda kept: incident_rows.put_annotations(kept, [MARK, early, replace(MARK, text="second")]))
    assert store.call(lambda kept: incident_rows.annotations_of(kept, "trip.mcap")) == [
        early,
        replace(MARK, text="second"),
    ]
    gone = replace(MARK, deleted=True)
    store.call(lambda kept: incident_rows.put_annotations(kept, [gone]))
    assert store.call(lambda kept: incident_rows.annotations_of(kept, "trip.mcap")) == [early]
    assert store.call(lambda kept: incident_rows.annotations_of(kept, "trip.mcap", deleted=True)) == [early, gone]
    assert store.call(lambda kept: incident_rows.annotations_of(kept, "other.mcap")) == []
    with pytest.raises(StoreError):
        store.call(lambda kept: kept.exec_driver_sql("UPDATE annotation_versions SET person = 'x'"))


def test_hashes_of_recordings_and_of_what_was_written_beside_them(store: Store) -> None:
    for digest in ("aa", "bb"):
        store.call(lambda kept, digest=digest: incident_rows.put_recording_hash(kept, "17-ab", digest, 1))  # type: ignore[misc]
        store.call(lambda kept, digest=digest: incident_rows.put_file_hash(kept, "trip.mcap", digest, 1))  # type: ignore[misc]
    assert store.call(lambda kept: incident_rows.recording_hash(kept, "17-ab")) == "bb"
    assert store.call(lambda kept: incident_rows.recording_hash(kept, "18-ab")) is None
    assert store.call(lambda kept: incident_rows.file_hash(kept, "trip.mcap")) == "bb"
