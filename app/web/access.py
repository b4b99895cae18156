"""Sessions as browsers hold them: by a cookie of this server, opened by a launch token or a login."""

from __future__ import annotations

from app.model.roles import SignedIn
from app.service.office.sessions import SESSION_S, Session, Sessions


class Access:
    """``port`` is ours; ``secure`` where the page is served by TLS.

    The session belongs to the browser: reload, further tabs and a restarted browser or server stay in; another browser
    needs a token or a login of its own.
    """

    def __init__(self, sessions: Sessions, port: int, secure: bool = False) -> None:
        self.sessions = sessions
        # Cookies are shared by all ports of a host: a second bench on another port must not end our session.
        self.cookie_name = f"hubside_{port}"
        self._attributes = f"Path=/; HttpOnly; SameSite=Strict{'; Secure' if secure else ''}"

    def issue_token(self) -> str:
        """A new token for a launch address."""
        return self.sessions.issue_token()

    def find(self, cookies: str) -> Session | None:
        """The open session that a Cookie header names."""
        for part in cookies.split(";"):
            name, _, secret = part.strip().partition("=")
            if name == self.cookie_name and (session := self.sessions.find(secret)) is not None:
                return session
        return None

    def who(self, session: Session) -> SignedIn | None:
        """Who a session belongs to now; None where it ended."""
        return self.sessions.who(session)

    def cookie(self, secret: str) -> str:
        """The Set-Cookie header that gives a browser its session."""
        return f"{self.cookie_name}={secret}; Max-Age={SESSION_S}; {self._attributes}"

    def no_cookie(self) -> str:
        """The Set-Cookie header that takes it away."""
        return f"{self.cookie_name}=; Max-Age=0; {self._attributes}"
