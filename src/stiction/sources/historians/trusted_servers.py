"""Certificates of OPC UA servers that the user has accepted, by their SHA-256 fingerprints."""

from __future__ import annotations

import hashlib
import json
import tomllib
from typing import TYPE_CHECKING

from stiction.atomic_write import write_atomically
from stiction.errors import RecordError
from stiction.sources.historians.credentials import configuration_folder

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["fingerprint", "require_trusted", "trust"]


def fingerprint(certificate: bytes) -> str:
    """SHA-256 of a certificate, in pairs of hexadecimal digits.

    Examples
    --------
    >>> fingerprint(b"certificate")[:11]
    '03:D6:6D:D0'
    """
    return hashlib.sha256(certificate).digest().hex(":").upper()


def trust(host: str, certificate: bytes) -> str:
    """Accept a certificate for a host from now on, and give its fingerprint."""
    path = _file()
    known = _read(path) | {host: fingerprint(certificate)}
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [f"{json.dumps(name)} = {json.dumps(value)}" for name, value in sorted(known.items())]
    write_atomically("\n".join(lines) + "\n", path)
    return known[host]


def require_trusted(host: str, certificate: bytes, where: str) -> None:
    """Refuse a certificate that was not accepted for a host.

    Raises
    ------
    RecordError
        With the fingerprint, and the command that accepts it.
    """
    found, known = fingerprint(certificate), _read(_file()).get(host)
    if found == known:
        return
    changed = f" (it was {known} before)" if known else ""
    raise RecordError(
        f"the certificate of the server is not trusted: SHA-256 {found}{changed}; compare it with that on the server, "
        f"then run stiction watch --trust {where}",
        where=where,
    )


def _file() -> Path:
    return configuration_folder() / "trusted-servers.toml"


def _read(path: Path) -> dict[str, str]:
    if not path.is_file():
        return {}
    try:
        return {str(name): str(value) for name, value in tomllib.loads(path.read_text(encoding="utf-8")).items()}
    except (OSError, ValueError) as error:
        raise RecordError(f"cannot be read as TOML ({error}); correct or delete it.", where=path) from None
