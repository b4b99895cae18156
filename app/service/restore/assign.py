"""Which device of a station a set is for."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from app.errors import UsageError
from app.service.devices import Target
from app.service.restore.order import Given


def assign(targets: Sequence[Target], sets: Iterable[Given]) -> tuple[dict[str, Given], tuple[Given, ...]]:
    """Each set to its own device where that is here, else to the only one of its kind; and those that fit none.

    Raises UsageError where it is not clear which device is meant, or two sets are for one.
    """
    found: dict[str, Given] = {}
    homeless = []
    for given in sets:
        target = _target_for(targets, given)
        if target is None:
            homeless.append(given)
        elif target.slug in found:
            raise UsageError(reason=f"two sets are for {target.slug}")
        else:
            found[target.slug] = given
    return found, tuple(homeless)


def _target_for(targets: Sequence[Target], given: Given) -> Target | None:
    origin, kind = given.parameters.origin, given.parameters.description_id
    own = next((target for target in targets if target.slug == origin.device), None)
    if own is not None:
        return own
    same = [target for target in targets if target.description.id == kind]
    if len(same) > 1:
        same = [target for target in same if target.node == origin.node] or same
    if len(same) > 1:
        names = ", ".join(target.slug for target in same)
        raise UsageError(reason=f"the set of {origin.device} may be for any of {names}")
    return same[0] if same else None
