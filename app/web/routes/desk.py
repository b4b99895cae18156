"""Views of plots that a person keeps under names."""

from __future__ import annotations

from fastapi import APIRouter

from app.store import small_rows
from app.web.deps import BenchOf, PersonOf
from app.web.models.desk import DeskViews

router = APIRouter()


@router.get("/desk/views")
async def desk_views(bench: BenchOf, person: PersonOf) -> DeskViews:
    """The views that this person has kept."""
    key = _key(person.person)
    found = await bench.office.store.run(lambda kept: small_rows.get_setting(kept, key))
    return DeskViews(views=found or [])


@router.put("/desk/views")
async def put_desk_views(bench: BenchOf, person: PersonOf, given: DeskViews) -> DeskViews:
    """Replace them; of two with the same name the last one stays."""
    key = _key(person.person)
    views = list({view.name: view for view in given.views}.values())
    rows = [view.model_dump() for view in views]
    await bench.office.store.run(lambda kept: small_rows.put_setting(kept, key, rows or None))
    return DeskViews(views=views)


def _key(person: str) -> str:
    return f"desk_views/{person}"
