"""The guard of the server: which requests are refused, and the headers of every answer."""

from __future__ import annotations

from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

    from stiction.apps.web.access import Access

__all__ = ["Guard"]

OPEN_PATHS = frozenset(("/", "/healthz", "/favicon.ico", "/api/session"))
"""Paths that need no cookie. They hold no data."""
STATIC = "/static/"
SAFE_METHODS = frozenset(("GET", "HEAD"))
CUSTOM_HEADER = b"x-stiction"
"""Header that a form or an image of another page cannot send."""
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; object-src 'none'; base-uri 'none'; form-action 'self'; "
    "frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
"""Headers of every answer."""


class Guard:
    """Refuse what does not come from our own page; add the security headers to every answer.

    Parameters
    ----------
    app : ASGI application
        What answers the requests that pass.
    access : Access
        Addresses and secrets of this run.
    """

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self.app = app
        self.access = access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer or refuse one request."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        refusal = self._refusal(scope)
        if scope["type"] == "websocket":
            if refusal is not None:
                await receive()
                await send({"type": "websocket.close", "code": 1008, "reason": refusal[1]})
                return
            await self.app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message["headers"], *_header_pairs()]
            await send(message)

        if refusal is None:
            await self.app(scope, receive, send_with_headers)
            return
        from starlette.responses import JSONResponse

        await JSONResponse({"error": refusal[1]}, refusal[0])(scope, receive, send_with_headers)

    def _refusal(self, scope: Scope) -> tuple[int, str] | None:
        """Status and reason when a request is refused, else None."""
        headers: dict[bytes, str] = {name: value.decode("latin-1") for name, value in scope["headers"]}
        is_socket = scope["type"] == "websocket"
        path: str = scope["path"]
        if headers.get(b"host") not in self.access.hosts:
            return 403, "This host name is not served. Open the address that the command printed."
        origin = headers.get(b"origin")
        if (origin is None and is_socket) or (origin is not None and origin not in self.access.origins):
            return 403, "This request comes from another page and is refused."
        if headers.get(b"sec-fetch-site", "none") not in ("none", "same-origin"):
            return 403, "This request comes from another page and is refused."
        if not is_socket and scope["method"] not in SAFE_METHODS and CUSTOM_HEADER not in headers:
            return 403, "The header X-Stiction is missing; use the page that the command opened."
        is_open = not is_socket and (path in OPEN_PATHS or path.startswith(STATIC))
        if not is_open and not self.access.is_cookie(_cookie(headers.get(b"cookie", ""), self.access.cookie_name)):
            return 401, "This browser is not signed in. Open the address that stiction serve printed, with its token."
        return None


def _header_pairs() -> list[tuple[bytes, bytes]]:
    return [(name.lower().encode(), value.encode()) for name, value in HEADERS.items()]


def _cookie(header: str, name: str) -> str:
    """Value of a cookie; empty when it was not sent."""
    try:
        morsel: Any = SimpleCookie(header).get(name)
    except CookieError:
        return ""
    return "" if morsel is None else morsel.value
