"""Database URLs, and texts about them in which no password is shown."""

from __future__ import annotations

import re
from urllib.parse import quote, quote_plus, unquote, unquote_plus

__all__ = ["hide_password", "is_database_url", "show_url"]

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9_]+(\+[A-Za-z0-9_]+)?://")
_NOT_DATABASES = ("file", "http", "https", "ftp", "sftp", "s3", "gs", "az", "abfs", "opc")
_PASSWORD = re.compile(r"^[^:/]+://[^:@/?]*:(?P<secret>.*)@", re.DOTALL)
"""All between the user name and the last @: a password may itself hold @, / or :, though it should be encoded."""
_SECRET_OPTION = re.compile(
    r"(?P<key>[?&;](?:[a-z_]*(?:password|passwd|pwd|passphrase|secret|token|key)|odbc_connect)=)(?P<secret>[^&]*)",
    re.IGNORECASE,
)


def is_database_url(text: str) -> bool:
    """Whether a text is the URL of a database, not a file name or a web address."""
    match = _SCHEME.match(text)
    return match is not None and text.split("://")[0].split("+")[0].lower() not in _NOT_DATABASES


def show_url(url: str) -> str:
    """Give a database URL with ``***`` in place of passwords.

    Examples
    --------
    >>> show_url("postgresql://ana:s%40crt@host/plant?sslpassword=x&connect_timeout=5")
    'postgresql://ana:***@host/plant?sslpassword=***&connect_timeout=5'
    """
    if match := _PASSWORD.match(url):
        url = url[: match.start("secret")] + "***" + url[match.end("secret") :]
    return _SECRET_OPTION.sub(r"\g<key>***", url)


def hide_password(text: str, url: str) -> str:
    """Give a text, such as the message of a driver, with ``***`` in place of the passwords of a URL in any writing."""
    found = [match["secret"] for match in _SECRET_OPTION.finditer(url)]
    if match := _PASSWORD.match(url):
        found += [match["secret"], match["secret"].split("@")[0]]
    plain = {form for secret in found for form in (secret, unquote(secret), unquote_plus(secret))}
    forms = {form for one in plain for form in (one, quote(one), quote(one, safe=""), quote_plus(one), repr(one)[1:-1])}
    for form in sorted(forms - {""}, key=len, reverse=True):
        text = re.sub(re.escape(form), "***", text, flags=re.IGNORECASE)
    return text
