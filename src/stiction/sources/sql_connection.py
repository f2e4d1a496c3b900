"""Connections to a database on which nothing is written, and its errors without passwords."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from stiction.errors import MissingExtraError, ParameterError, RecordError
from stiction.sources.database_url import hide_password, show_url

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import Connection, Engine

__all__ = ["connect", "make_engine", "refused_as"]

CONNECT_TIMEOUT_S = 10


def make_engine(url: str) -> Engine:
    """Make the engine of a URL; no connection is made yet."""
    from sqlalchemy import create_engine, exc

    shown = show_url(url)
    try:
        is_postgresql = url.startswith("postgresql")
        engine = create_engine(url, connect_args={"connect_timeout": CONNECT_TIMEOUT_S} if is_postgresql else {})
    except exc.NoSuchModuleError:
        raise ParameterError(
            f"{shown}: is of an unknown kind of database; give for example postgresql+psycopg://, or install its "
            "SQLAlchemy dialect."
        ) from None
    except ImportError as error:
        module = error.name or "the driver"
        remedy = "pip install 'stiction[sql]'" if module == "psycopg" else f"pip install {module}"
        raise MissingExtraError(f"{shown}: needs {module}, which is not installed; {remedy}.") from None
    except (exc.ArgumentError, ValueError, TypeError):
        raise ParameterError(
            f"{shown}: is no database URL; write KIND+DRIVER://USER:PASSWORD@HOST:PORT/DATABASE, with special "
            "characters of the password encoded (%40 for @)."
        ) from None
    file = engine.url.database
    if engine.dialect.name == "sqlite" and not (file and (file.startswith("file:") or Path(file).is_file())):
        raise RecordError(f"{shown}: no such file; check the name and the folder.")
    return engine


@contextmanager
def connect(engine: Engine, url: str) -> Iterator[Connection]:
    """Open a connection on which nothing is written."""
    from sqlalchemy import exc

    try:
        connection = engine.connect()
    except (exc.SQLAlchemyError, OSError, ValueError) as error:
        raise RecordError(
            f"{show_url(url)}: cannot be reached ({_reason(error, url)}); check host, port, user and password, and "
            "that the server runs."
        ) from None
    with connection:
        with refused_as("cannot be read", url, "check the rights of the user"):
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
    except (exc.SQLAlchemyError, ValueError, OverflowError) as error:
        if isinstance(error, (RecordError, ParameterError)):
            raise
        raise RecordError(f"{show_url(url)}: {what} ({_reason(error, url)}); {remedy}.") from None


def _reason(error: Exception, url: str) -> str:
    """Give the message of the driver, in one line, without passwords."""
    text = str(getattr(error, "orig", None) or error)
    lines = [line.strip() for line in hide_password(text, url).splitlines() if line.strip()]
    return " ".join(lines)[:300].rstrip(".") or type(error).__name__
