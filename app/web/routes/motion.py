"""Moving axes: the lease, what a person confirms, preparation, and orders that last as long as they are held.

An order is answered when it has ended. What holds an axis is the beat on the socket, not the request.
"""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends

from app.errors import NotConnectedError, RoleError
from app.model.roles import Role
from app.service.motion import hydraulic_moves, moves, operation
from app.service.motion.brake_test import try_brake
from app.service.motion.desk import MotionDesk
from app.service.motion.feathering import feather
from app.service.motion.homing import search_home
from app.service.motion.interlocks import Confirmed
from app.service.motion.line import MotionLine, motion_line
from app.service.motion.orders import orders_of
from app.service.motion.positions import Positions, positions
from app.web.deps import DEVICE, BenchOf, ConnectionOf, JournalOf, PersonOf, TargetOf, needs
from app.web.models.motion import (
    AnswerRequest,
    BrakeTestDoc,
    ConfirmRequest,
    FeatheredDoc,
    FenceRequest,
    HomedDoc,
    HomeRequest,
    InterlockDoc,
    JogRequest,
    LeaseDoc,
    LeaseRequest,
    ManualRequest,
    MovedDoc,
    MoveRequest,
    OperationRequest,
    OrderRequest,
    PreparedDoc,
    SearchHomeRequest,
)

router = APIRouter()
TECHNICIAN = needs(Role.TECHNICIAN)
MOTION = DEVICE + "/motion"


def get_desk(bench: BenchOf) -> MotionDesk:
    """The desk of the connection. Raises NotConnectedError."""
    if bench.motion is None:
        raise NotConnectedError
    return bench.motion


DeskOf = Annotated[MotionDesk, Depends(get_desk)]


@router.get("/live/motion")
async def motion(bench: BenchOf) -> MotionLine:
    """Who may move the axes, what is prepared and under way. The socket has it as topic ``motion``."""
    return motion_line(bench.motion)


@router.post("/live/motion/lease", dependencies=[TECHNICIAN])
async def take_lease(desk: DeskOf, person: PersonOf, request: LeaseRequest) -> LeaseDoc:
    """Take the lease, or keep it; another page's is refused with 409 ``lease_held``."""
    return LeaseDoc(fence=desk.take_lease(person.person, request.page).fence)


@router.post("/live/motion/lease/ask", dependencies=[TECHNICIAN])
async def ask_for_lease(desk: DeskOf, person: PersonOf, request: LeaseRequest) -> LeaseDoc:
    """Ask its holder for the lease. Once it is had, taking it tells its number."""
    desk.ask_for_lease(person.person, request.page)
    holder = desk.lease.holder
    return LeaseDoc(fence=holder.fence if holder is not None and holder.page == request.page else None)


@router.post("/live/motion/lease/withdraw", dependencies=[TECHNICIAN])
async def withdraw_wish(desk: DeskOf, request: LeaseRequest) -> MotionLine:
    """Ask for the lease no longer."""
    desk.withdraw_wish(request.page)
    return motion_line(desk)


@router.post("/live/motion/lease/answer", dependencies=[TECHNICIAN])
async def answer_wish(desk: DeskOf, request: AnswerRequest) -> MotionLine:
    """The holder's answer to who asks: hand the lease over, or keep it."""
    desk.answer_wish(request.fence, request.hand_over)
    return motion_line(desk)


@router.post("/live/motion/lease/give-back", dependencies=[TECHNICIAN])
async def give_back_lease(desk: DeskOf, request: FenceRequest) -> MotionLine:
    """End the lease; what was prepared is put back."""
    desk.give_back_lease(request.fence)
    return motion_line(desk)


@router.post("/live/motion/confirm", dependencies=[TECHNICIAN])
async def confirm(desk: DeskOf, person: PersonOf, request: ConfirmRequest) -> MotionLine:
    """What the holder has looked at. For the external stop of a drive an expert answers, nobody else."""
    stops = frozenset(request.external_stops)
    if stops - desk.confirmed.external_stops and not person.role.covers(Role.EXPERT):
        raise RoleError(needs=Role.EXPERT.value, has=person.role.value)
    desk.confirm(request.fence, Confirmed(request.rotor_locked, request.people_out, stops))
    return motion_line(desk)


@router.get(MOTION + "/interlocks")
async def interlocks(desk: DeskOf, target: TargetOf) -> list[InterlockDoc]:
    """How every interlock of an axis stands."""
    return [InterlockDoc.of(standing) for standing in await desk.interlocks(target.slug)]


@router.get(MOTION + "/positions")
async def encoder_positions(connection: ConnectionOf, target: TargetOf) -> Positions:
    """Where both encoders say that the blade is, asked now."""
    return await positions(connection.driver(target), target)


@router.post(MOTION + "/prepare", dependencies=[TECHNICIAN])
async def prepare(desk: DeskOf, target: TargetOf, request: OrderRequest) -> PreparedDoc:
    """Have the drive watch our heartbeat and prove that it stops without it. Held; its fault may feather the blades.

    One whose bus has no heartbeat is only taken, where ``self_stop`` of its interlocks lets it.
    """
    desk.admit(request.fence, request.order)
    axis = await desk.prepare(target.slug, request.fence)
    return PreparedDoc(proof_ms=axis.proof_ms)


@router.post(MOTION + "/put-back", dependencies=[TECHNICIAN])
async def put_back(desk: DeskOf, target: TargetOf, request: OrderRequest) -> MotionLine:
    """End the preparation: the settings from before stand again."""
    desk.admit(request.fence, request.order)
    await desk.put_back(target.slug, request.fence)
    return motion_line(desk)


@router.post(MOTION + "/jog", dependencies=[TECHNICIAN])
async def jog(desk: DeskOf, target: TargetOf, journal: JournalOf, request: JogRequest) -> MovedDoc:
    """Turn the axis as long as it is held."""
    desk.admit(request.fence, request.order)
    await moves.jog(desk, target.slug, request.fence, request.speed, journal)
    return _moved(desk)


@router.post(MOTION + "/manual", dependencies=[TECHNICIAN])
async def drive_by_hand(desk: DeskOf, target: TargetOf, request: ManualRequest) -> MovedDoc:
    """Manual control of a hydraulic axis, at the speeds that the device holds for it, as long as it is held."""
    desk.admit(request.fence, request.order)
    way = hydraulic_moves.Way(request.positive, request.rapid)
    await hydraulic_moves.drive_by_hand(desk, target.slug, request.fence, way)
    return _moved(desk)


@router.post(MOTION + "/operation", dependencies=[TECHNICIAN])
async def take_over(desk: DeskOf, target: TargetOf, journal: JournalOf, request: OperationRequest) -> MovedDoc:
    """Have the bus drive a hydraulic axis, its cylinders single or together; nothing moves by it."""
    desk.admit(request.fence, request.order)
    await operation.take_over(desk, target.slug, request.fence, request.single, request.aligned, journal)
    return _moved(desk)


@router.post(MOTION + "/move", dependencies=[TECHNICIAN])
async def move(desk: DeskOf, target: TargetOf, journal: JournalOf, request: MoveRequest) -> MovedDoc:
    """Move the axis to a position as long as it is held."""
    desk.admit(request.fence, request.order)
    await orders_of(target).move_to(desk, target.slug, request.fence, request.position, request.speed, journal)
    return _moved(desk)


@router.post(MOTION + "/home", dependencies=[TECHNICIAN])
async def home(desk: DeskOf, target: TargetOf, journal: JournalOf, request: HomeRequest) -> MovedDoc:
    """Take the present position of an axis without power for another one (homing method 35)."""
    desk.admit(request.fence, request.order)
    await moves.home(desk, target.slug, request.fence, request.position, journal)
    return _moved(desk)


@router.post(MOTION + "/search-home", dependencies=[TECHNICIAN])
async def find_home(desk: DeskOf, target: TargetOf, journal: JournalOf, request: SearchHomeRequest) -> HomedDoc:
    """Home a drive that has methods to look for its home, as long as it is held."""
    desk.admit(request.fence, request.order)
    position = await search_home(desk, target.slug, request.fence, request.method, journal)
    return HomedDoc(why=_moved(desk).why, position=position)


@router.post(MOTION + "/reset", dependencies=[TECHNICIAN])
async def reset(desk: DeskOf, target: TargetOf, journal: JournalOf, request: OrderRequest) -> MovedDoc:
    """Reset the fault of the axis; nothing moves by it."""
    desk.admit(request.fence, request.order)
    await orders_of(target).reset_fault(desk, target.slug, request.fence, journal)
    return _moved(desk)


@router.post(MOTION + "/hold", dependencies=[TECHNICIAN])
async def hold(desk: DeskOf, target: TargetOf, request: OrderRequest) -> MovedDoc:
    """Have the axis enabled and standing, brake lifted, as long as it is held."""
    desk.admit(request.fence, request.order)
    await orders_of(target).hold(desk, target.slug, request.fence)
    return _moved(desk)


@router.post(MOTION + "/feather", dependencies=[TECHNICIAN])
async def feather_one(desk: DeskOf, target: TargetOf, request: OrderRequest) -> FeatheredDoc:
    """Try the EFC of one axis by its controlword, as long as it is held; let go, it stops by its quick stop."""
    desk.admit(request.fence, request.order)
    found = await feather(desk, target.slug, request.fence)
    return FeatheredDoc(
        why=_moved(desk).why,
        from_deg=found.from_deg,
        to_deg=found.to_deg,
        target_deg=found.target_deg,
        took_s=round(found.took_s, 2),
    )


@router.post(MOTION + "/brake-test", dependencies=[TECHNICIAN])
async def brake_test(desk: DeskOf, target: TargetOf, journal: JournalOf, request: OrderRequest) -> BrakeTestDoc:
    """Try whether the brake lifts and holds, as long as it is held: the blade turns by half a degree, then rests."""
    desk.admit(request.fence, request.order)
    found = await try_brake(desk, target.slug, request.fence, journal)
    return BrakeTestDoc.of(_moved(desk).why, found)


@router.post(MOTION + "/halt", dependencies=[TECHNICIAN])
async def halt(desk: DeskOf, target: TargetOf, request: FenceRequest) -> MotionLine:
    """Halt one axis by its ramp, whoever has it run; it stays enabled where it was not this desk."""
    await desk.halt(target.slug, request.fence)
    return motion_line(desk)


def _moved(desk: MotionDesk) -> MovedDoc:
    return MovedDoc(why="" if desk.last is None else desk.last.why.value)
