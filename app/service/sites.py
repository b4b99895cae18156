"""The turbines that a bench knows: those of its site file, or the one that its start named."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from app.errors import UsageError
from app.model.description import Description
from app.model.site import Turbine, load_site

Describe = Callable[[Turbine], Mapping[str, Description]]


class Sites:
    """Turbines by slug.

    ``file`` is the site file, or None where the start named a bus; ``home`` is where one may be made then. ``describe``
    gives the descriptions that a turbine's devices name, by id, and raises DescriptionError.
    """

    def __init__(
        self, turbines: tuple[Turbine, ...], describe: Describe, file: Path | None = None, home: Path | None = None
    ) -> None:
        self.file = file
        self.home = home
        self.describe = describe
        self._turbines = {turbine.slug: turbine for turbine in turbines}

    @property
    def turbines(self) -> Mapping[str, Turbine]:
        """All that are known, in the order of the file."""
        return self._turbines

    def turbine(self, slug: str) -> Turbine:
        """One turbine. Raises UsageError."""
        found = self._turbines.get(slug)
        if found is None:
            raise UsageError(reason=f"no turbine '{slug}'; there are: {', '.join(self._turbines) or 'none'}")
        return found

    def reload(self, keep: Turbine | None = None) -> None:
        """Read the file again; ``keep`` stays known where the file does not name it. Raises SiteError."""
        if self.file is None:
            return
        turbines = {turbine.slug: turbine for turbine in load_site(self.file)}
        if keep is not None:
            turbines.setdefault(keep.slug, keep)
        self._turbines = turbines
