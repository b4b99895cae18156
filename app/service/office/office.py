"""The office of a bench: what is kept of people and their work, in one store."""

from __future__ import annotations

from collections.abc import Callable

from app.service.incidents.annotations import Annotations
from app.service.incidents.incidents import Incidents
from app.service.journal import Journal
from app.service.library.library import Library
from app.service.motion.runs import SignalRuns
from app.service.motors import Motors
from app.service.office.audit import AuditLog
from app.service.office.sessions import Sessions
from app.service.office.users import Users
from app.service.office.visits import Visits
from app.service.scope.captures import Captures
from app.store.store import Store


class Office:
    """Audit log, users, visits, motors, incidents, test signals and captures of ``store``. ``stamp`` gives t_ns.

    Every event of ``journal`` is audited. ``person`` is who a launch token lets in. Raises StoreError. Belongs to the
    event loop, and owns the store.
    """

    def __init__(self, store: Store, journal: Journal, stamp: Callable[[], int], person: str) -> None:
        self.store = store
        self.audit = AuditLog(store, stamp, journal)
        self.users = Users(store, self.audit)
        self.sessions = Sessions(store, self.users, self.audit, person)
        self.library = Library(store, self.audit, stamp)
        self.visits = Visits(store, self.audit, stamp, self.library)
        self.motors = Motors(store, self.audit, stamp)
        self.incidents = Incidents(store, self.audit, stamp, journal)
        self.annotations = Annotations(store, self.audit, stamp)
        self.signal_runs = SignalRuns(store, stamp)
        self.captures = Captures(store, self.audit)
        self._stop_listening = journal.listen(self.audit.take)

    async def close(self) -> None:
        """Have everything on the disk, and let another process have the store."""
        self._stop_listening()
        await self.audit.close()
        self.store.close()
