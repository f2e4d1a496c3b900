"""Database URLs: connections on which nothing is written, and messages in which no password is shown."""

from __future__ import annotations

import re
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote, quote_plus, unquote, unquote_plus

from stiction.errors import MissingExtraError, ParameterError, RecordError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import Connection, Engine

__all__ = ["connect", "hide_password", "is_database_url", "make_engine", "refused_as", "show_url"]

CONNECT_TIMEOUT_S = 10

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9_]+(\+[A-Za-z0-9_]+)?://")
_NOT_DATABASES = ("file", "http", "https", "ftp", "sftp", "s3", "gs", "az", "abfs", "opc", "opc.tcp", "pi")
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


def make_engine(url: str) -> Engine:
    """Make the engine of a URL; no connection is made yet."""
    from sqlalchemy import create_engine, exc

    shown = show_url(url)
    try:
        is_postgresql = url.startswith("postgresql")
        engine = create_engine(url, connect_args={"connect_timeout": CONNECT_TIMEOUT_S} if is_postgresql else {})
    except exc.NoSuchModuleError:
        raise ParameterError(
            "is of an unknown kind of database; give for example postgresql+psycopg://, or install its "
            "SQLAlchemy dialect.",
            where=shown,
        ) from None
    except ImportError as error:
        module = error.name or "the driver"
        package = '"stiction[sql]"' if module == "psycopg" else module
        raise MissingExtraError(
            f"needs {module}, which is not installed; install it with: pip install {package}", where=shown
        ) from None
    except (exc.ArgumentError, ValueError, TypeError):
        raise ParameterError(
            "is not a database URL; write KIND+DRIVER://USER:PASSWORD@HOST:PORT/DATABASE, with special "
            "characters of the password encoded (%40 for @).",
            where=shown,
        ) from None
    file = engine.url.database
    if engine.dialect.name == "sqlite" and not (file and (file.startswith("file:") or Path(file).is_file())):
        raise RecordError("no such file; check the name and the folder.", where=shown)
    return engine


@contextmanager
def connect(engine: Engine, url: str) -> Iterator[Connection]:
    """Open a connection on which nothing is written."""
    with refused_as("cannot be reached", url, "check host, port, user and password, and whether the server runs"):
        connection = engine.connect()
    with connection:
        with refused_as("cannot be read", url, "check the access rights of the user"):
            if engine.dialect.name == "sqlite":
                connection.exec_driver_sql("PRAGMA query_only = ON")
            if engine.dialect.name == "postgresql":
                connection = connection.execution_options(postgresql_readonly=True)
                connection.exec_driver_sql("SET TIME ZONE 'UTC'")
        yield connection
        connection.rollback()


@contextmanager
def refused_as(what: str, url: str, remedy: str) -> Iterator[None]:
    """Turn an error of the database into a `RecordError` without passwords."""
    from sqlalchemy import exc

    try:
        yield
    except (exc.SQLAlchemyError, OSError, ValueError, OverflowError) as error:
        if isinstance(error, (RecordError, ParameterError)):
            raise
        raise RecordError(f"{what} ({_reason(error, url)}); {remedy}.", where=show_url(url)) from None


def _reason(error: Exception, url: str) -> str:
    """Give the message of the driver, in one line, without passwords."""
    text = str(getattr(error, "orig", None) or error)
    lines = [line.strip() for line in hide_password(text, url).splitlines() if line.strip()]
    return " ".join(lines)[:300].rstrip(".") or type(error).__name__
