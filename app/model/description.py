"""What a device IS: the description of every parameter, as read from ``od/*.toml``.

Everything else is derived from these objects: EDS files, forms of the page, the twins' dictionaries, documents.
The same shapes serve index/sub-index (CiA 301) and IND/PNU (PROFIBUS PKW).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from enum import Enum
from typing import Final

from app.errors import UnknownObjectError
from app.model.address import Address, Addressing
from app.model.axis_machine import StateMachine, machine_of
from app.model.cylinders import Cylinders
from app.model.datatypes import DataType, Raw

Lookup = Callable[[Address], Raw | None]
"""Gives the latest known raw value of another object of the same device, or None."""


class Bus(Enum):
    """The bus a device speaks."""

    CANOPEN = "canopen"
    MODBUS_TCP = "modbus-tcp"
    PROFIBUS_DP = "profibus-dp"


class Kind(Enum):
    """Object code of CiA 301 (7.4.3); a PKW parameter is a VAR."""

    VAR = "var"
    ARRAY = "array"
    RECORD = "record"


class Access(Enum):
    """Access as the manuals print it; ``r(w)`` is writable by the maker only."""

    RO = "ro"
    WO = "wo"
    RW = "rw"
    FACTORY = "r(w)"
    CONST = "const"

    @property
    def readable(self) -> bool:
        """True where a read is allowed."""
        return self is not Access.WO

    @property
    def writable(self) -> bool:
        """True where a write is allowed in normal operation."""
        return self in (Access.RW, Access.WO)


class PdoWay(Enum):
    """Which way an object may go in PDOs, where its EDS says more than that it may (CiA 306: rwr, rww)."""

    BOTH = "rw"
    TRANSMIT = "rwr"
    RECEIVE = "rww"


class RestoreClass(Enum):
    """Where a value of a parameter set may be written back to.

    ``COPY``: any machine of this kind. ``UNIT``: the same machine only. ``FACTORY``: by the maker. ``NETWORK``: no
    machine by itself; it decides at which address the device is found, and the wrong value cuts the connection.
    """

    COPY = "copy"
    UNIT = "unit"
    FACTORY = "factory"
    NETWORK = "network"
    NEVER = "never"


class PdoSide(Enum):
    """Which process image an object may stand in: what the device receives, or what it transmits."""

    RX = "rx"
    TX = "tx"


class Fact(Enum):
    """What a manual tells of one entry, each for itself, and where it fails to."""

    SUB = "sub"
    NAME = "name"
    TYPE = "type"
    ACCESS = "access"
    PDO = "pdo"
    DEFAULT = "default"
    SAVED = "saved"


class Verify(Enum):
    """How a write is proven."""

    EQUAL = "equal"
    ACK = "ack"
    EFFECT = "effect"


@dataclass(frozen=True, slots=True)
class Quantity:
    """Unit and factor: scaled = raw x scale."""

    unit: str = ""
    scale: Decimal = Decimal(1)


@dataclass(frozen=True, slots=True)
class QuantityRule:
    """A unit that depends on other objects.

    Either a table of the raw value of ``address`` (``choices``), or the rule ``feed`` of CiA 402: a position in units
    of ``feed`` per ``shaft`` revolutions, shown in degrees: 360 / (feed / shaft) degrees a unit. ``after``: objects
    that are put back before what has this unit, for its numbers mean something else until then.
    """

    address: Address
    choices: Mapping[int, Quantity] = field(default_factory=dict)
    shaft: Address | None = None
    after: tuple[Address, ...] = ()


@dataclass(frozen=True, slots=True)
class LimitRef:
    """A limit that is the raw value of another object, times ``factor``."""

    address: Address
    factor: Decimal = Decimal(1)


Limit = int | Decimal | LimitRef


@dataclass(frozen=True, slots=True)
class Condition:
    """A write is allowed only while the object at ``address`` holds one of ``values``.

    Where ``writing`` is not empty, this is asked of writes of these raw values only.
    """

    address: Address
    values: tuple[int, ...]
    writing: tuple[int, ...] = ()

    def concerns(self, raw: Raw) -> bool:
        """True where a write of ``raw`` depends on it."""
        return not self.writing or raw in self.writing


@dataclass(frozen=True, slots=True)
class Effect:
    """A write of one of the raw values ``writing`` has the device itself put ``raw`` into the object at ``address``."""

    address: Address
    raw: int
    writing: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class TableRule:
    """A table of bits or of names that depends on the raw value of ``address``: the id of one for each."""

    address: Address
    choices: Mapping[int, str]


@dataclass(frozen=True, slots=True)
class LimitsRule:
    """Limits that depend on the raw value of ``address``: the lowest and the highest raw value for each."""

    address: Address
    choices: Mapping[int, tuple[Limit | None, Limit | None]]


@dataclass(frozen=True, slots=True)
class Mirror:
    """The object shows the low bits of ``of``, divided by ``divisor``."""

    of: Address
    divisor: int = 1


@dataclass(frozen=True, slots=True)
class Bit:
    """One bit, or a field of bits ``bit..last``, of a bit table."""

    bit: int
    name: str
    text_key: str
    last: int | None = None
    clamp: str = ""
    error_code: int | None = None

    @property
    def mask(self) -> int:
        """The bits that belong to it."""
        last = self.bit if self.last is None else self.last
        return (1 << last + 1) - (1 << self.bit)


@dataclass(frozen=True, slots=True)
class BitTable:
    """Names of the bits of an object. Bits that are not named are reserved.

    ``origin`` is the source of what the device's own manual does not tell.
    """

    id: str
    bits: tuple[Bit, ...]
    origin: str | None = None


@dataclass(frozen=True, slots=True)
class EnumValue:
    """One value of an enumeration."""

    value: int
    name: str
    text_key: str


@dataclass(frozen=True, slots=True)
class Enumeration:
    """Names of values. Where ``exclusive``, no other value may be written; else others are plain numbers.

    ``origin`` is the source of what the device's own manual does not tell.
    """

    id: str
    values: tuple[EnumValue, ...]
    exclusive: bool = True
    origin: str | None = None

    def by_value(self, value: int) -> EnumValue | None:
        """The named value, or None."""
        return next((v for v in self.values if v.value == value), None)


@dataclass(frozen=True, slots=True)
class ErrorCode:
    """An error code of the device (EMCY, error field) with its texts.

    ``aid`` names the texts of its cause and of first aid: those of a family where several codes tell the same
    (battery bloc 1 to 8), of the device where another one means something else by the same name; else ``name``.
    ``number`` is its number in the family and fills the placeholder {number} of the texts. ``origin`` is the source of
    a code that the device's own manual does not tell.
    """

    code: int
    name: str
    text_key: str
    reaction: str = ""
    aid: str = ""
    number: int | None = None
    origin: str | None = None

    @property
    def cause_key(self) -> str:
        """Text: what the device has seen, and which objects decide."""
        return f"error_cause.{self.aid or self.name}"

    @property
    def first_aid_key(self) -> str:
        """Text: what to do, one step a line."""
        return f"first_aid.{self.aid or self.name}"


@dataclass(frozen=True, slots=True)
class VariantValues:
    """What differs in one variant of the device; None where nothing differs."""

    default: Raw | None = None
    minimum: Limit | None = None
    maximum: Limit | None = None


@dataclass(frozen=True, slots=True)
class Entry:
    """One row of a dictionary: one sub-index, or one PNU.

    ``default``, ``minimum``, ``maximum`` and ``also`` (values allowed beyond the limits) are raw values. Where
    ``node_id``, the node's number is added to the default ($NODEID of CiA 306). ``save_category`` is what saves it,
    where a device saves by categories; without one each save command does. ``inferred`` marks what the manual does not
    print, ``unproven`` which facts these are (empty where all of them), and ``origin`` the source that they come from
    instead, if there is one. ``pdo_side`` is the process image it may stand in. ``motion`` marks an object whose write
    can set an axis in motion; ``counts`` one that the device itself counts on, so that no old value is put back. An
    emergency feather command puts the value of ``overwritten_by`` into it, in RAM. ``line`` is the row's line in its
    file.

    ``enumeration_rule``, ``bits_rule`` and ``limits_rule`` replace ``enumeration``, ``bits`` and the limits while the
    object that they name is known. A raw value is a multiple of ``step``, or one of ``only`` where that is not empty.
    ``ipv4`` marks an address of the internet, its first number in the highest byte. ``signals`` are the numbers that a
    telegram of process data knows it by, and ``tool_name`` the name that the maker's own tool gives it. ``effects`` are
    what the device itself changes with a write.
    """

    address: Address
    name: str
    object_name: str
    kind: Kind
    type: DataType
    access: Access
    pdo: bool
    default: Raw | None
    saved: bool
    group: str
    section: str
    quantity: Quantity = Quantity()
    quantity_rule: QuantityRule | None = None
    minimum: Limit | None = None
    maximum: Limit | None = None
    also: tuple[int, ...] = ()
    enumeration: str | None = None
    bits: str | None = None
    restore: RestoreClass = RestoreClass.NEVER
    verify: Verify = Verify.EQUAL
    save_category: str | None = None
    requires: tuple[Condition, ...] = ()
    mirror: Mirror | None = None
    variants: Mapping[str, VariantValues] = field(default_factory=dict)
    note: str | None = None
    inferred: bool = False
    unproven: frozenset[Fact] = frozenset()
    origin: str | None = None
    pdo_side: PdoSide | None = None
    timeout_s: float | None = None
    hexadecimal: bool = False
    ipv4: bool = False
    node_id: bool = False
    motion: bool = False
    counts: bool = False
    overwritten_by: Address | None = None
    enumeration_rule: TableRule | None = None
    bits_rule: TableRule | None = None
    limits_rule: LimitsRule | None = None
    step: int = 1
    only: tuple[int, ...] = ()
    signals: tuple[int, ...] = ()
    tool_name: str | None = None
    effects: tuple[Effect, ...] = ()
    pdo_way: PdoWay = PdoWay.BOTH
    line: int = 0

    @property
    def receivable(self) -> bool:
        """True where a receive PDO may write it, if it may be mapped at all."""
        return self.access.writable and self.pdo_way is not PdoWay.TRANSMIT

    @property
    def sendable(self) -> bool:
        """True where a transmit PDO may carry it, if it may be mapped at all."""
        return self.access.readable and self.pdo_way is not PdoWay.RECEIVE

    @property
    def is_parameter(self) -> bool:
        """True for what is saved and can be set: no counters, no process values."""
        return self.saved and self.restore is not RestoreClass.NEVER

    @property
    def limited_by_variant(self) -> bool:
        """True where variants of the device have limits of their own."""
        return any(one.minimum is not None or one.maximum is not None for one in self.variants.values())

    def proves(self, fact: Fact) -> bool:
        """True where the device's own manual prints the fact."""
        return not self.inferred or (bool(self.unproven) and fact not in self.unproven)

    @property
    def title(self) -> str:
        """Name for people: the object's name, and the sub-index's where there is one."""
        return self.name if self.kind is Kind.VAR else f"{self.object_name}: {self.name}"


@dataclass(frozen=True, slots=True)
class SaveCommand:
    """How RAM values become non-volatile: ``signature`` is written to ``address``.

    ``category`` None saves (or restores) all.
    """

    address: Address
    signature: int
    category: str | None = None
    timeout_s: float = 10.0


@dataclass(frozen=True, slots=True)
class Match:
    """How a device on the bus is recognised: 1000h and a piece of 1008h; None matches anything."""

    device_type: int | None = None
    device_name: str | None = None
    vendor_id: int | None = None
    product_code: int | None = None


@dataclass(frozen=True, slots=True)
class Variant:
    """One of several devices that share a description, and how it is told from the others."""

    id: str
    name: str
    match: Match = Match()


@dataclass(frozen=True, slots=True)
class Source:
    """Where facts come from that the device's own manual does not tell. ``title`` is that of the document."""

    id: str
    title: str


@dataclass(frozen=True)
class Description:
    """A device: all its entries in the order of their addresses, its tables and commands.

    ``cylinders`` is None for what moves none.
    """

    id: str
    version: str
    name: str
    vendor: str
    bus: Bus
    addressing: Addressing
    manual: str
    match: Match
    entries: Mapping[Address, Entry]
    groups: tuple[str, ...]
    bit_tables: Mapping[str, BitTable]
    enumerations: Mapping[str, Enumeration]
    errors: Mapping[int, ErrorCode]
    save: tuple[SaveCommand, ...]
    load: tuple[SaveCommand, ...]
    variants: tuple[str, ...] = ()
    variant_details: Mapping[str, Variant] = field(default_factory=dict)
    sources: Mapping[str, Source] = field(default_factory=dict)
    cylinders: Cylinders | None = None
    state_machine: StateMachine | None = None
    """Of an axis that has another one than CiA 402: see ``machine``."""

    def __iter__(self) -> Iterator[Entry]:
        return iter(self.entries.values())

    @property
    def machine(self) -> StateMachine | None:
        """The state machine by which it is commanded; None where it is no axis."""
        return machine_of(self.entries, self.state_machine)

    def entry(self, address: Address) -> Entry:
        """The entry at ``address``. Raises UnknownObjectError."""
        found = self.entries.get(address)
        if found is None:
            raise UnknownObjectError(device=self.id, address=address.short)
        return found

    def name_key(self, entry: Entry, raw: Raw) -> str | None:
        """Text key of the name that an enumeration gives the value; None where it gives none."""
        if entry.enumeration is None or not isinstance(raw, int):
            return None
        named = self.enumerations[entry.enumeration].by_value(raw)
        return None if named is None else named.text_key

    def enumeration_of(self, entry: Entry, lookup: Lookup) -> Enumeration | None:
        """The names of values in force; where they depend on an object that is not known, those of all cases."""
        name = _chosen(entry.enumeration_rule, lookup, entry.enumeration)
        return None if name is None else self.enumerations[name]

    def bits_of(self, entry: Entry, lookup: Lookup) -> BitTable | None:
        """The names of bits in force; where they depend on an object that is not known, those of all cases."""
        name = _chosen(entry.bits_rule, lookup, entry.bits)
        return None if name is None else self.bit_tables[name]

    def has_index(self, index: int) -> bool:
        """True where any sub-index of ``index`` exists."""
        return index in self._indices

    def objects(self) -> Iterator[tuple[int, list[Entry]]]:
        """Each index with its entries, sub 0 first."""
        yield from self._indices.items()

    @property
    def _indices(self) -> Mapping[int, list[Entry]]:
        cached: dict[int, list[Entry]] | None = self.__dict__.get("_by_index")
        if cached is None:
            cached = {}
            for entry in self.entries.values():
                cached.setdefault(entry.address.major, []).append(entry)
            object.__setattr__(self, "_by_index", cached)
        return cached


def _chosen(rule: TableRule | None, lookup: Lookup, otherwise: str | None) -> str | None:
    found = None if rule is None else lookup(rule.address)
    return rule.choices.get(found, otherwise) if rule is not None and isinstance(found, int) else otherwise


SAVE_SIGNATURE: Final = 0x65766173
"""'save' as an UNSIGNED32 (CiA 301, 7.5.2.13)."""
LOAD_SIGNATURE: Final = 0x64616F6C
"""'load' as an UNSIGNED32 (CiA 301, 7.5.2.14)."""
