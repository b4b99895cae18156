"""The diagnosis of the buses: their lines, their stations, and the check of the order of bytes. Of the present only."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, get_args

from fastapi import APIRouter

from app.model.roles import Role
from app.service import lines
from app.service.lines import Checked, Line, Part, order_name, parts
from app.web.deps import DEVICE, BenchOf, ConnectionOf, JournalOf, TargetOf, needs
from app.web.models import Nothing
from app.web.models.lines import (
    DiagnosisDoc,
    LineDoc,
    OrderCheckDoc,
    OrderKept,
    OrderName,
    OrderReadingDoc,
    SaidDoc,
    SignalDoc,
    StationDoc,
    TelegramDoc,
    WordDoc,
)
from app.web.problem import failure
from app.wire.profibus.diagnosis import (
    NO_MASTER,
    Block,
    ChannelBlock,
    Diagnosis,
    ModuleBlock,
    RevisionBlock,
    Status,
)
from app.wire.profibus.fields import FormatError
from app.wire.profibus.pzd import Order, Values
from app.wire.profibus.slave_states import dp_state, watchdog_state

if TYPE_CHECKING:  # it comes with an optional package
    from app.drivers.profibus_view import StationView

router = APIRouter()
STALE_S: Final = 1.0
"""Process data come every few hundredths of a second; so old they are no longer of now."""
_NAMES: Final[dict[str, OrderName]] = {name: name for name in get_args(OrderName)}


@router.get("/live/bus/lines")
async def bus_lines(connection: ConnectionOf) -> list[LineDoc]:
    """Each bus as its driver has it: its line, and where it keeps stations, each of them with what is exchanged."""
    return [_line(one) for one in await lines.lines(connection)]


@router.post(f"{DEVICE}/order/check", dependencies=[needs(Role.TECHNICIAN)])
async def check_order(connection: ConnectionOf, target: TargetOf, _request: Nothing) -> OrderCheckDoc:
    """The guided check of the order of bytes: parameters are read and compared with the process data of that moment."""
    return _check(await lines.check_order(connection, target))


@router.post(f"{DEVICE}/order/keep", dependencies=[needs(Role.TECHNICIAN)])
async def keep_order(
    bench: BenchOf, connection: ConnectionOf, target: TargetOf, journal: JournalOf, request: OrderKept
) -> OrderCheckDoc:
    """Check once more, and note the order in the site file where nothing contradicts it: for the next connection."""
    return _check(await lines.keep_order(connection, target, request.order, bench.site_editor, journal))


def _line(line: Line) -> LineDoc:
    status = line.status
    return LineDoc(
        bus=line.link.name,
        kind=line.link.kind.value,
        connection=line.connection,
        bitrate=line.link.bitrate,
        master=line.master,
        state=status.state.value,
        reason=status.reason,
        since_t_ns=status.t_ns,
        reconnects=status.reconnects,
        dropped=status.dropped,
        frames=line.link.frames,
        load=round(min(1.0, line.load), 4),
        problem=None if line.problem is None else failure("", line.problem),
        stations=[_station(target.slug, target.node, view) for target, view in line.stations],
    )


def _station(slug: str, node: int, view: StationView | None) -> StationDoc:
    if view is None:
        return StationDoc(
            device=slug, node=node, state=None, problem=None, dp_state=None, watchdog_state=None, diagnosis=None,
            telegram=None, setting=None, order=None, age_ms=None, starts=0, stale=True,
        )  # fmt: skip
    exchanging = view.state.value == "exchanging"
    dp, watchdog = dp_state(view.diagnosis, exchanging), watchdog_state(view.diagnosis)
    telegram = view.telegram
    return StationDoc(
        device=slug,
        node=node,
        state=view.state.value,
        problem=None if view.problem is None else failure("", view.problem),
        dp_state=None if dp is None else dp.value,
        watchdog_state=None if watchdog is None else watchdog.value,
        diagnosis=None if view.diagnosis is None else _diagnosis(view.diagnosis),
        telegram=TelegramDoc(
            number=telegram.number,
            has_pkw=telegram.has_pkw,
            output_size=telegram.output_size,
            input_size=telegram.input_size,
            received=[_word(part, view.received) for part in parts(telegram.received, view.outputs)],
            sent=[_word(part, view.sent) for part in parts(telegram.sent, view.inputs)],
        ),
        setting=_order(view.setting),
        order=_order(view.order),
        age_ms=None if view.age_s is None else round(view.age_s * 1000, 1),
        starts=view.starts,
        stale=view.age_s is None or view.age_s > STALE_S,
    )


def _word(part: Part, values: Values | None) -> WordDoc:
    return WordDoc(
        word=part.word,
        words=part.words,
        data=part.data.hex(" ").upper(),
        signals=[
            SignalDoc(
                number=one.number,
                name=one.name,
                address=None if one.address is None else one.address.short,
                raw=None if values is None else values.get(one, 0),
            )
            for one in part.signals
        ],
    )


def _diagnosis(diagnosis: Diagnosis) -> DiagnosisDoc:
    bits = [bit for bit in Status if bit in diagnosis.status and bit is not Status.ALWAYS]
    return DiagnosisDoc(
        data=diagnosis.encode().hex(" ").upper(),
        ident=diagnosis.ident,
        master=None if diagnosis.master == NO_MASTER else diagnosis.master,
        status=[f"lines.status.{str(bit.name).lower()}" for bit in bits],
        blocks=_blocks(diagnosis),
    )


def _blocks(diagnosis: Diagnosis) -> list[SaidDoc]:
    said: list[SaidDoc] = []
    try:
        said.extend(_block(one) for one in diagnosis.blocks())
    except FormatError as error:
        said.append(SaidDoc(text_key="lines.block.broken", details={"offset": error.offset}))
    return said


def _block(block: Block) -> SaidDoc:
    if isinstance(block, ModuleBlock):
        modules = ", ".join(str(one) for one in block.modules)
        return SaidDoc(text_key="lines.block.modules", details={"modules": modules or "–"})
    if isinstance(block, ChannelBlock):
        details = {"module": block.module, "channel": block.channel, "error": block.error}
        return SaidDoc(text_key="lines.block.channel", details=details)
    if isinstance(block, RevisionBlock):
        return SaidDoc(text_key="lines.block.revision", details={"revision": block.revision})
    return SaidDoc(text_key="lines.block.device", details={"data": block.data.hex(" ").upper()})


def _check(checked: Checked) -> OrderCheckDoc:
    order = checked.order
    return OrderCheckDoc(
        readings=[
            OrderReadingDoc(
                signal=one.signal.name,
                address=None if one.signal.address is None else one.signal.address.short,
                value=one.value,
                data=one.data.hex(" ").upper(),
                said={_NAMES[order_name(each)]: value for each, value in one.by_order.items()},
            )
            for one in checked.readings
        ],
        fits=[_NAMES[order_name(one)] for one in order.fits],
        setting=_order(order.setting),
        proven=_order(order.proven),
        reason_key=None if order.proven is not None else order.reason_key,
    )


def _order(order: Order | None) -> OrderName | None:
    return None if order is None else _NAMES[order_name(order)]
