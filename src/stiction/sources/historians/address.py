"""Addresses of historians, such as opc.tcp://host:4840 and pi+https://host/piwebapi."""

from __future__ import annotations

from typing import NamedTuple
from urllib.parse import parse_qs, urlsplit

from stiction.errors import ParameterError

__all__ = ["HistorianAddress", "is_historian_url", "parse_address"]

SCHEMES = ("opc.tcp", "pi+https", "pi+http")


class HistorianAddress(NamedTuple):
    """The parts of an address."""

    kind: str
    """`opc_ua` or `pi`."""
    url: str
    """URL that the client connects to."""
    host: str
    """Host and port, under which credentials are kept."""
    server: str = ""
    """PI Data Archive, where the address names one (``?server=NAME``)."""


def is_historian_url(source: object) -> bool:
    """Whether a source is the address of a historian.

    Examples
    --------
    >>> is_historian_url("opc.tcp://plant:4840"), is_historian_url("sqlite:///plant.db")
    (True, False)
    """
    return isinstance(source, str) and "://" in source and source.split("://")[0].lower() in SCHEMES


def parse_address(source: str) -> HistorianAddress:
    """Split the address of a historian.

    Raises
    ------
    ParameterError
        When it holds a password, or no host.

    Examples
    --------
    >>> parse_address("pi+https://plant/piwebapi?server=ARCHIVE")
    HistorianAddress(kind='pi', url='https://plant/piwebapi', host='plant', server='ARCHIVE')
    """
    scheme, _, rest = source.partition("://")
    try:
        parts = urlsplit(f"//{rest}")
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port, parts = None, None, urlsplit("")
    if "@" in parts.netloc:
        raise ParameterError(
            f"the address of {scheme}://{parts.netloc.rpartition('@')[2]} contains a user or password; give them in "
            "STICTION_HISTORIAN_USER and STICTION_HISTORIAN_PASSWORD, or in the file of credentials."
        )
    if not host:
        raise ParameterError(
            f"{source!r} has no host; write opc.tcp://HOST:4840 or pi+https://HOST/piwebapi.",
        )
    name = host if port is None else f"{host}:{port}"
    if scheme.lower() == "opc.tcp":
        return HistorianAddress("opc_ua", f"opc.tcp://{name if port else f'{name}:4840'}{parts.path}", name)
    server = parse_qs(parts.query).get("server", [""])[0]
    path = parts.path.rstrip("/") or "/piwebapi"
    return HistorianAddress("pi", f"{scheme.lower().removeprefix('pi+')}://{name}{path}", name, server)
