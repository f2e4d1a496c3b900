"""Requests to a PI Web API: GET alone, limits of the server kept, repeated while it is busy, errors in words."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError, import_extra
from stiction.sources.historians.credentials import find_credentials

if TYPE_CHECKING:
    from collections.abc import Sequence

    import httpx

    from stiction.sources.historians.address import HistorianAddress

__all__ = ["PiRequests", "RequestTooLargeError"]

BUSY = (429, 502, 503, 504)
"""Answers after which a request is repeated."""
WAITS_S = (0.5, 1.0, 2.0, 4.0, 8.0)
"""Times before a request is repeated [s]."""
MAX_WAIT_S = 60.0
"""Longest time that the server may ask to wait [s]."""
TIMEOUT_S = 60.0
"""Time for an answer of the server [s]."""


class RequestTooLargeError(RecordError):
    """The server refuses a request for its size, so it is to be split."""


class PiRequests:
    """A connection to a PI Web API."""

    def __init__(self, address: HistorianAddress) -> None:
        httpx = import_extra("httpx", "live")
        user = find_credentials(address.host)
        self.address = address
        self._client: httpx.Client = httpx.Client(
            base_url=f"{address.url}/", timeout=TIMEOUT_S, follow_redirects=False, trust_env=True,
            auth=(user.user, user.password) if user.user else None,
            headers={"Authorization": f"Bearer {user.token}"} if user.token else None,
        )  # fmt: skip

    def __enter__(self) -> PiRequests:
        return self

    def __exit__(self, *_: object) -> None:
        self._client.close()

    def get(self, path: str, query: Sequence[tuple[str, str | int]] = ()) -> dict[str, Any]:
        """Get an answer of the server as JSON.

        Raises
        ------
        RequestTooLargeError
            When the server says that the request or its answer is too large.
        RecordError
            When it cannot be reached, refuses the user or the request, or answers with no JSON object.
        """
        import httpx

        for wait in (*WAITS_S, None):
            try:
                answer = self._client.get(path, params=list(query))
            except httpx.TransportError as error:
                if wait is None or "CERTIFICATE_VERIFY_FAILED" in str(error):
                    raise self._unreachable(error) from None
                time.sleep(wait)
                continue
            except httpx.InvalidURL:
                raise RecordError("is not a valid address; correct it.", where=self.address.url) from None
            if answer.status_code not in BUSY or wait is None:
                return self._parse(answer)
            time.sleep(max(wait, _retry_after(answer)))
        raise AssertionError

    def _unreachable(self, error: Exception) -> RecordError:
        if "CERTIFICATE_VERIFY_FAILED" in str(error):
            return RecordError(
                "the certificate of the server cannot be verified; give the file of its authority in SSL_CERT_FILE.",
                where=self.address.url,
            )
        reason = str(error) or type(error).__name__
        return RecordError(
            f"cannot be reached ({reason}); check host and port, and whether the server runs.", where=self.address.url
        )

    def _parse(self, answer: httpx.Response) -> dict[str, Any]:
        status = answer.status_code
        if status in (401, 403):
            raise RecordError(
                f"refuses the user ({status})",
                remedy="check STICTION_HISTORIAN_USER and STICTION_HISTORIAN_PASSWORD, or the file of credentials",
                where=self.address.url,
            )
        try:
            body = answer.json()
        except ValueError:
            body = None
        said = "; ".join(error_texts(body))[:300]
        if status in (413, 414) or (status == 400 and ("maximum" in said.lower() or "exceed" in said.lower())):
            text = f"refuses the request, because it is too large ({said or status})"
            raise RequestTooLargeError(text, where=self.address.url)
        if status not in (200, 207):
            reason = said or answer.reason_phrase
            raise RecordError(f"answers with {status} ({reason}); check the address.", where=self.address.url)
        if not isinstance(body, dict):
            raise RecordError(
                "answers with something else than JSON; check that the address is that of a PI Web API, such as "
                "pi+https://HOST/piwebapi.",
                where=self.address.url,
            )
        return body


def error_texts(body: object) -> list[str]:
    """What an answer, or one item of it, says of errors.

    Examples
    --------
    >>> error_texts({"Errors": ["The point is gone."]}), error_texts({"Items": []})
    (['The point is gone.'], [])
    """
    if not isinstance(body, dict):
        return []
    exception = body.get("Exception")
    found = body.get("Errors") or (exception.get("Errors") if isinstance(exception, dict) else None) or []
    texts = []
    for one in found if isinstance(found, list) else [found]:
        message = one.get("Message", one) if isinstance(one, dict) else one
        texts += [str(part) for part in message] if isinstance(message, list) else [str(message)]
    return texts or ([str(body["Message"])] if "Message" in body and "Items" not in body else [])


def _retry_after(answer: httpx.Response) -> float:
    """Time that the server asks to wait [s]."""
    try:
        return min(float(answer.headers.get("Retry-After", 0.0)), MAX_WAIT_S)
    except ValueError:
        return 0.0
