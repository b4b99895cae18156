"""Who is served, and the texts."""

from __future__ import annotations

from fastapi import APIRouter, Request

from app import __version__
from app.model.texts import LANGUAGES, load_texts
from app.web.deps import BenchOf, PersonOf
from app.web.models import Language, Session

router = APIRouter()


@router.get("/session")
async def session(request: Request, bench: BenchOf, person: PersonOf) -> Session:
    """Who is served, and in which languages."""
    return Session(
        version=__version__,
        role=person.role.value,
        person=person.person,
        user=person.user_id,
        login_needed=bench.office.sessions.login_needed,
        languages=list(LANGUAGES),
        locale=request.app.state.language,
    )


@router.get("/texts/{locale}")
async def texts(locale: Language) -> dict[str, str]:
    """All texts for people in one language, by key."""
    return dict(load_texts(locale).flat)
