"""Which saves make values permanent: one for all, or one for each category that a device saves by."""

from __future__ import annotations

from collections.abc import Iterable

from app.errors import UsageError
from app.model.address import Address
from app.model.description import Description, SaveCommand

Category = str | None
"""What one save command saves; None saves all."""


def text_key(category: str | None) -> str:
    """Key of the category's name."""
    return f"category.{category or 'all'}"


def command_of(commands: Iterable[SaveCommand], category: Category) -> SaveCommand:
    """How ``category`` is saved. Raises UsageError where there is no such command."""
    known = tuple(commands)
    for command in known:
        if command.category == category:
            return command
    names = ", ".join(one.category or "all" for one in known) or "none"
    raise UsageError(reason=f"category '{category or 'all'}' cannot be saved (there are: {names})")


def has_categories(description: Description) -> bool:
    """True where the device can save a part of its parameters."""
    return any(command.category is not None for command in description.save)


def categories_of(description: Description) -> tuple[str, ...]:
    """The categories that can be saved and that hold a parameter, in the order of their commands."""
    used = {entry.save_category for entry in description if entry.saved}
    return tuple(one.category for one in description.save if one.category is not None and one.category in used)


def saves_for(description: Description, addresses: Iterable[Address]) -> tuple[Category, ...]:
    """The saves that keep the values of ``addresses``, in the order of the commands; empty where nothing is kept.

    What has no category goes with each save, and needs one of its own only where there is no other. What has a category
    that no command saves needs the save of all.
    """
    kept = [entry for address in addresses if (entry := description.entries.get(address)) is not None and entry.saved]
    if not kept:
        return ()
    known = [command.category for command in description.save]
    wanted = {entry.save_category for entry in kept if entry.save_category is not None}
    if not has_categories(description) or not wanted or not wanted <= set(known):
        return (None,)
    return tuple(category for category in known if category in wanted)
