"""Sets as a device would give them: every readable object at its default, and a few values of every kind."""

from __future__ import annotations

from hypothesis import strategies as st

from app.model.address import Address, Addressing
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.description_file import load_builtin
from app.model.set_head import Taking
from app.model.sets import MAX_NODE, Identity, Origin, ParameterSet, identity_of, iso_time

ORIGIN = Origin(
    "wtg-07", "wtg-07/blade-1/pmc", 12, "2026-03-04T14:03:21Z", "Jörg; #1", "50 % = zu viel", "hubside 0.1.0", "WO-7"
)
DESCRIPTIONS = {name: load_builtin(name) for name in ("oat-pmm", "oat-pmc")}


def whole_set(name: str, origin: Origin = ORIGIN) -> ParameterSet:
    """Complete but for what has no default; texts and numbers that a file must not spoil."""
    description = DESCRIPTIONS[name]
    values: dict[Address, Raw] = {
        entry.address: default_of(description, entry.address)
        for entry in description
        if entry.access.readable and entry.default is not None
    }
    values[Address(0x1008)] = '  Ä "quoted"; =1+1 #2\n'
    values[Address(0x1009)] = ""
    unread = {entry.address: "abort 08000022h" for entry in description if entry.address not in values}
    empty = tuple(unread)[:1]
    for address in empty:
        del unread[address]
    return ParameterSet(name, description.version, identity_of(values, "SN 12"), origin, values, unread, empty)


def default_of(description: Description, address: Address) -> Raw:
    """The default, the node's number put in."""
    entry = description.entries[address]
    assert entry.default is not None
    return entry.default + ORIGIN.node if entry.node_id and isinstance(entry.default, int) else entry.default


def taking(**changes: object) -> Taking:
    """Values of a file that says nothing of itself go to this device."""
    given = {"descriptions": DESCRIPTIONS, "origin": ORIGIN, **changes}
    return Taking(**given)  # type: ignore[arg-type]


TEXTS = st.one_of(
    st.text(st.characters(exclude_categories=["Cs"]), max_size=12),
    st.sampled_from(
        ["=1+1", "+2", "-3", "@a", "'x", '"', '""', ",", ";", "\t", "\r\n", "\n", "\0", " a ", "\ufeff", "#hubside-set"]
    ),
)
INTEGERS = st.one_of(st.integers(-(1 << 63), (1 << 64) - 1), st.sampled_from([-(1 << 63), (1 << 64) - 1, 0, -1]))
RAWS: st.SearchStrategy[Raw] = st.one_of(
    INTEGERS, TEXTS, st.binary(max_size=12), st.floats(allow_nan=False, allow_infinity=False)
)
ADDRESSES = st.one_of(
    st.builds(Address, st.integers(0, 0xFFFF), st.integers(0, 255), st.just(Addressing.OD)),
    st.builds(Address, st.integers(0, 255), st.integers(0, 255), st.just(Addressing.PKW)),
    st.sampled_from([entry.address for entry in DESCRIPTIONS["oat-pmc"]]),
)


@st.composite
def any_set(draw: st.DrawFn) -> ParameterSet:
    """Whatever a set can hold, also what no device would say."""
    values = draw(st.dictionaries(ADDRESSES, RAWS, max_size=8))
    free = ADDRESSES.filter(lambda one: one not in values)
    device, texts = draw(TEXTS), [draw(TEXTS) for _ in range(6)]
    time = iso_time(draw(st.integers(0, (1 << 63) - 1)))
    origin = Origin(texts[0], device, draw(st.integers(0, MAX_NODE)), time, texts[1], texts[2], texts[3], texts[4])
    number, text = st.none() | INTEGERS, st.none() | TEXTS
    identity = draw(st.builds(Identity, number, text, text, text, number, number, number, number, text))
    unread, empty = draw(st.dictionaries(free, TEXTS, max_size=3)), draw(st.lists(free, max_size=2))
    return ParameterSet(
        draw(st.sampled_from(["oat-pmc", "other"])), texts[5], identity, origin, values, unread, tuple(empty)
    )
