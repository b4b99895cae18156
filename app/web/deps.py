"""What the routes depend on: the bench, its connection, a device of it, the jobs, and who is at work in which role."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Request

from app.errors import NotConnectedError, RoleError
from app.model.roles import Role, SignedIn
from app.service.bench import Bench
from app.service.connection import Connection
from app.service.devices import Target
from app.service.jobs import Jobs
from app.service.journal import Journal
from app.service.replay.replays import Replays
from app.service.replay.session import Session
from app.service.shown import LiveShown, Shown
from app.service.stage import Stage
from app.service.views import device_state
from app.web.guard import SIGNED_IN
from app.web.models import Problem
from app.web.problem import MEDIA_TYPE, NotFoundError, UnauthorisedError

ANY_PROBLEM: dict[int | str, dict[str, Any]] = {
    "default": {"model": Problem, "description": "What went wrong", "content": {MEDIA_TYPE: {}}}
}
"""For every router: any route may answer with a problem document."""
DEVICE = "/live/devices/{turbine}/{station}/{device}"


def get_bench(request: Request) -> Bench:
    """The bench that this server serves."""
    bench: Bench = request.app.state.bench
    return bench


BenchOf = Annotated[Bench, Depends(get_bench)]


def get_connection(bench: BenchOf) -> Connection:
    """The connection. Raises NotConnectedError."""
    return bench.require()


def get_jobs(request: Request) -> Jobs:
    """The jobs of this server."""
    jobs: Jobs = request.app.state.jobs
    return jobs


def get_signed_in(request: Request) -> SignedIn:
    """Who asks, as the guard found. Raises UnauthorisedError."""
    person: SignedIn | None = request.scope.get(SIGNED_IN)
    if person is None:
        raise UnauthorisedError
    return person


def get_replays(request: Request) -> Replays:
    """The replays of this server."""
    replays: Replays = request.app.state.replays
    return replays


ReplaysOf = Annotated[Replays, Depends(get_replays)]


def get_session(replays: ReplaysOf, replay_id: str) -> Session:
    """The replay of the path. Raises ReplayEndedError, or what it has ended by."""
    return replays.require(replay_id)


SessionOf = Annotated[Session, Depends(get_session)]


def get_shown(request: Request, bench: BenchOf, replays: ReplaysOf) -> Shown:
    """What is shown: the replay where the path names one, else the live bench. Raises as ``get_session`` does."""
    name = request.path_params.get("replay_id")
    return LiveShown(bench) if name is None else replays.require(name)


ShownOf = Annotated[Shown, Depends(get_shown)]


def get_stage(shown: ShownOf) -> Stage:
    """Its devices and what is known of them. Raises NotConnectedError."""
    stage = shown.stage
    if stage is None:
        raise NotConnectedError
    return stage


StageOf = Annotated[Stage, Depends(get_stage)]


def name_replay(replay_id: str) -> None:
    """Has the path of a replay's route documented."""


def reads_both(router: APIRouter, path: str, endpoint: Callable[..., Any]) -> None:
    """A read route of the live bench and of every replay: ``/live/<path>`` and ``/replay/{replay_id}/<path>``."""
    router.add_api_route(f"/live/{path}", endpoint, methods=["GET"])
    router.add_api_route(
        f"/replay/{{replay_id}}/{path}",
        endpoint,
        methods=["GET"],
        name=f"replay_{endpoint.__name__}",
        dependencies=[Depends(name_replay)],
    )


ConnectionOf = Annotated[Connection, Depends(get_connection)]
JobsOf = Annotated[Jobs, Depends(get_jobs)]
PersonOf = Annotated[SignedIn, Depends(get_signed_in)]


def get_journal(bench: BenchOf, person: PersonOf) -> Journal:
    """The journal in the hands of who asks."""
    return bench.journal.by(person.person)


JournalOf = Annotated[Journal, Depends(get_journal)]


def get_target(request: Request, connection: ConnectionOf, turbine: str, station: str, device: str) -> Target:
    """The device of the path; errors from here on tell the state that it is in. Raises NotFoundError."""
    slug = f"{turbine}/{station}/{device}"
    target = next((one for one in connection.targets if one.slug == slug), None)
    if target is None:
        raise NotFoundError(what=slug)
    request.state.device_state = lambda: device_state(target)
    return target


TargetOf = Annotated[Target, Depends(get_target)]


class Needs:
    """Lets pass whose role covers ``role``, which a test may ask."""

    def __init__(self, role: Role) -> None:
        self.role = role

    def __call__(self, person: PersonOf) -> None:
        """Raises RoleError."""
        if not person.role.covers(self.role):
            raise RoleError(needs=self.role.value, has=person.role.value)


def needs(role: Role) -> Any:
    """A route's dependency: only who has ``role`` or a higher one gets through."""
    return Depends(Needs(role))
