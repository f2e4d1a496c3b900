"""Who may use the server: its addresses, the token of the link, and the cookie that replaces it."""

from __future__ import annotations

import hmac
import secrets
from dataclasses import dataclass, field

__all__ = ["Access"]

TOKEN_BYTES = 24
"""Random bytes of token and cookie."""


@dataclass(frozen=True)
class Access:
    """Secrets and addresses of one run of the server."""

    port: int
    """Port on the loopback address."""
    token: str = field(default_factory=lambda: secrets.token_urlsafe(TOKEN_BYTES), repr=False)
    """Secret in the link that the command prints."""
    cookie: str = field(default_factory=lambda: secrets.token_urlsafe(TOKEN_BYTES), repr=False)
    """Secret of the browsers that sent the token."""

    @property
    def cookie_name(self) -> str:
        """Name of the cookie; browsers share cookies between ports, so the port is part of it."""
        return f"stiction-{self.port}"

    @property
    def hosts(self) -> frozenset[str]:
        """Values of the Host header that are served."""
        names = ("127.0.0.1", "localhost")
        bare = names if self.port == 80 else ()
        return frozenset((*(f"{name}:{self.port}" for name in names), *bare))

    @property
    def origins(self) -> frozenset[str]:
        """Values of the Origin header that are served."""
        return frozenset(f"http://{host}" for host in self.hosts)

    @property
    def address(self) -> str:
        """The link that opens the page."""
        return f"http://127.0.0.1:{self.port}/#token={self.token}"

    def is_token(self, text: str) -> bool:
        """Whether a text is the token; the comparison takes the same time for all texts."""
        return hmac.compare_digest(text.encode(), self.token.encode())

    def is_cookie(self, text: str) -> bool:
        """Whether a text is the value of the cookie."""
        return hmac.compare_digest(text.encode(), self.cookie.encode())
