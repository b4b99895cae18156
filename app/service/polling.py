"""What is polled: which objects of each kind of device how often, and how much of the bus that may take.

Settings of the whole bench: kept in the store, changed while connections are open, in force with the next round.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any, Final

from app.errors import AccessError, LimitError, UsageError
from app.model.address import Address, parse_address
from app.model.description import Description, Entry
from app.service.journal import Journal, Kind
from app.store.small_rows import get_setting, put_setting
from app.store.store import Store

KEY: Final = "polling"
"""Under this name the settings are kept."""
MAX_ITEMS: Final = 200
"""Of one kind of device: more would be reading everything, which is another command."""
PERIOD_S: Final = (0.05, 10.0)
EVERY: Final = (2, 1000)
LOAD_CAP: Final = (0.05, 0.9)
"""Least and greatest of each setting."""
EXCHANGE_BITS: Final = 243
"""Of one SDO request with its answer on the bus, stuff bits included: two frames of eight octets."""
_EXPEDITED: Final = 4
_SEGMENT: Final = 7
"""Octets that an expedited answer and a segment carry (CiA 301, 7.2.4.3)."""
_TEXT_OCTETS: Final = 32
"""What is taken for a value whose length is not known beforehand."""

FAST: Final = tuple(map(parse_address, ("6041", "6064", "606C", "3000", "3060", "0/38", "12/100")))
SLOW: Final = tuple(
    map(
        parse_address,
        (
            *("603F", "607A", "6061", "6078", "6079", "6510:03", "6410:09", "60F4", "60FD", "60FE:03"),
            *("0/36", "0/39", "0/40", "0/41", "0/53", "12/103"),
            *("3063", "3080", "3010", "3011", "3062", "3070", "30FD", "30FE:03"),
        ),
    )
)
RARE: Final = tuple(
    map(
        parse_address,
        (
            *("1/84", "1/100", "1/101", "1/106", "12/21", "12/61", "12/64", "12/216", "12/217"),
            *("6040", "6864", "1003:00", "3001", "3002", "3003", "3004", "3012", "3013", "3053", "3081"),
            *("3005", "3050", "3064", "3067", "3068", "3074", "30B4"),
            *(f"3061:{bloc:02}" for bloc in range(1, 9)),
            *(f"301F:{bloc:02}" for bloc in range(1, 9)),
        ),
    )
)

CURRENT: Final = parse_address("6078")
TORQUE: Final = parse_address("6077")
"""What stands in for the current on a drive that gives none (CiA 402, torque actual value)."""
CONDITIONS: Final = tuple(map(parse_address, ("4014:01", "4014:03", "4014:04")))
"""Supply and temperatures of a drive that has no objects of the profile for them."""
AXIS_ROOM: Final = tuple(map(parse_address, ("6062", "60FE:01", "4014:02")))
"""What the axis room shows of such a drive besides: its demand, its outputs, the supply of its logic."""
SI_UNIT: Final = parse_address("60A8")
UNITS: Final = tuple(map(parse_address, ("60A8", "60A9", "6091:01", "6091:02", "6092:01", "6092:02")))
"""Where a device chooses its units, no value says anything without these: they must be known again after a restart."""


class Rate(Enum):
    """How often an object is read: in every round, in every n-th, in every m-th."""

    FAST = "fast"
    SLOW = "slow"
    RARE = "rare"


PollList = Mapping[Address, Rate]

_USUAL: Final[PollList] = {
    **dict.fromkeys(FAST, Rate.FAST),
    **dict.fromkeys(SLOW, Rate.SLOW),
    **dict.fromkeys(RARE, Rate.RARE),
}


def usual_list(description: Description) -> PollList:
    """What the screens need of a device, as far as it has it."""
    wanted = dict(_USUAL)
    if CURRENT not in description.entries:
        wanted |= dict.fromkeys((TORQUE, *CONDITIONS), Rate.SLOW)
        wanted |= dict.fromkeys(AXIS_ROOM, Rate.SLOW)
    if SI_UNIT in description.entries:
        wanted |= dict.fromkeys(UNITS, Rate.RARE)
    if description.cylinders is not None:
        wanted[description.cylinders.position] = Rate.FAST
        if description.machine is not None:
            wanted[description.machine.statusword] = Rate.FAST
        wanted |= dict.fromkeys(description.cylinders.still, Rate.SLOW)
    return {address: rate for address, rate in wanted.items() if address in description.entries}


@dataclass(frozen=True, slots=True)
class PollPlan:
    """``lists`` by description id; a device that is not named there has the usual list. ``load_cap`` 0..1."""

    period_s: float = 0.1
    slow_every: int = 10
    rare_every: int = 100
    load_cap: float = 0.6
    lists: Mapping[str, PollList] = field(default_factory=dict)

    def of(self, description: Description) -> PollList:
        """What is read of such a device."""
        return self.lists.get(description.id) or usual_list(description)

    def per_second(self, rate: Rate) -> float:
        """How often a second an object of this rate is read, where nothing holds the round up."""
        every = {Rate.FAST: 1, Rate.SLOW: self.slow_every, Rate.RARE: self.rare_every}[rate]
        return 1 / (self.period_s * every)

    def load(self, descriptions: Iterable[Description], bitrate: int) -> float:
        """Share of a bus's time that polling these devices takes, 0..1 (above 1 it does not fit)."""
        bits = sum(
            self.per_second(rate) * read_bits(description.entries[address])
            for description in descriptions
            for address, rate in self.of(description).items()
            if address in description.entries
        )
        return bits / bitrate


USUAL: Final = PollPlan()
"""The plan where nobody has changed it."""


def read_bits(entry: Entry) -> int:
    """Bits on the bus that reading an object once takes."""
    octets = -(-entry.type.bits // 8) if entry.type.bits else _TEXT_OCTETS
    segments = 0 if octets <= _EXPEDITED else -(-octets // _SEGMENT)
    return EXCHANGE_BITS * (1 + segments)


class Polling:
    """The plan in force, kept in ``store``; without one it lasts as long as the bench. For the event loop."""

    def __init__(self, store: Store | None = None) -> None:
        self._store = store
        kept = None if store is None else store.call(lambda connection: get_setting(connection, KEY))
        self._plan = USUAL if kept is None else plan_from(kept)

    @property
    def plan(self) -> PollPlan:
        """The plan."""
        return self._plan

    async def change(self, plan: PollPlan, known: Mapping[str, Description], journal: Journal) -> None:
        """Put ``plan`` in force, keep it and note what changed. ``known`` by id must hold every device it names.

        Raises UsageError, UnknownObjectError, AccessError, LimitError, StoreError; then nothing has changed.
        """
        plan = checked(plan, known)
        before, after = plan_document(self._plan), plan_document(plan)
        if before == after:
            return
        if self._store is not None:
            await self._store.run(lambda connection: put_setting(connection, KEY, after))
        self._plan = plan
        journal.note(Kind.SETTINGS_CHANGED, None, what_key="settings.polling", changes=changes_text(before, after))


def checked(plan: PollPlan, known: Mapping[str, Description]) -> PollPlan:
    """``plan`` with lists that are worth keeping: one that is the usual one is not."""
    _within("period", plan.period_s, PERIOD_S, "s")
    _within("slow", plan.slow_every, EVERY, "")
    _within("rare", plan.rare_every, EVERY, "")
    _within("load cap", plan.load_cap, LOAD_CAP, "")
    lists = {}
    for name, items in plan.lists.items():
        description = known.get(name)
        if description is None:
            raise UsageError(reason=f"no description '{name}'")
        for address in items:
            entry = description.entry(address)
            if not entry.access.readable:
                raise AccessError(address=address.short, name=entry.name, access=entry.access.value)
        _within(f"objects of {name}", len(items), (1, MAX_ITEMS), "")
        if dict(items) != dict(usual_list(description)):
            lists[name] = dict(items)
    return replace(plan, lists=lists)


def _within(name: str, number: float, limits: tuple[float, float], unit: str) -> None:
    if not limits[0] <= number <= limits[1]:
        raise LimitError(address="", name=name, value=number, minimum=limits[0], maximum=limits[1], unit=unit)


# -- as it is kept ------------------------------------------------------------------


def plan_document(plan: PollPlan) -> dict[str, Any]:
    """The plan as JSON."""
    lists = {
        name: {address.short: rate.value for address, rate in sorted(items.items())}
        for name, items in sorted(plan.lists.items())
    }
    return {
        "period_s": plan.period_s,
        "slow_every": plan.slow_every,
        "rare_every": plan.rare_every,
        "load_cap": plan.load_cap,
        "lists": lists,
    }


def plan_from(document: Any) -> PollPlan:
    """The plan of its JSON. Raises UsageError where it is none."""
    try:
        lists = {
            str(name): {parse_address(address): Rate(rate) for address, rate in items.items()}
            for name, items in document["lists"].items()
        }
        return PollPlan(
            float(document["period_s"]),
            int(document["slow_every"]),
            int(document["rare_every"]),
            float(document["load_cap"]),
            lists,
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise UsageError(reason=f"the polling list that is kept cannot be read: {error!r}") from error


def changes_text(before: Mapping[str, Any], after: Mapping[str, Any]) -> str:
    """What differs between two documents, as ``key old → new`` with dashes for what is not there."""
    old, new = dict(_flat(before, "")), dict(_flat(after, ""))
    keys = [*old, *(key for key in new if key not in old)]
    changed = [f"{key} {old.get(key, '–')} → {new.get(key, '–')}" for key in keys if old.get(key) != new.get(key)]
    return "; ".join(changed)


def _flat(document: Mapping[str, Any], prefix: str) -> Iterable[tuple[str, Any]]:
    for key, item in document.items():
        if isinstance(item, Mapping):
            yield from _flat(item, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", item
