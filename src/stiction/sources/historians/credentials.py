"""Users, passwords and tokens of historians: from the environment, a keyring, or a file of the owner alone."""

from __future__ import annotations

import os
import stat
import sys
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

from stiction.errors import RecordError

__all__ = ["Credentials", "configuration_folder", "find_credentials"]

FILE = "credentials.toml"
VARIABLES = ("STICTION_HISTORIAN_USER", "STICTION_HISTORIAN_PASSWORD", "STICTION_HISTORIAN_TOKEN")


@dataclass(frozen=True)
class Credentials:
    """What a historian is told of the user; no representation shows a secret."""

    user: str = ""
    """Name of the user; empty for nobody."""
    password: str = field(default="", repr=False)
    """Password."""
    token: str = field(default="", repr=False)
    """Bearer token, instead of user and password."""


def configuration_folder() -> Path:
    """Folder of the user's own settings: credentials, trusted certificates, the client's certificate."""
    if given := os.environ.get("STICTION_CONFIG"):
        return Path(given)
    if sys.platform == "win32":
        return Path(os.environ.get("APPDATA", Path.home())) / "stiction"
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "stiction"


def find_credentials(host: str) -> Credentials:
    """Find the credentials of a host, written ``host`` or ``host:port``.

    The environment (STICTION_HISTORIAN_USER, _PASSWORD, _TOKEN) goes before a keyring (service ``stiction HOST``, where
    the package keyring is installed), and this before the section of the host in ``credentials.toml``.

    Raises
    ------
    RecordError
        When others than the owner can read the file, or it cannot be read.
    """
    given = Credentials(*(os.environ.get(name, "") for name in VARIABLES))
    if given != Credentials():
        return given
    return _from_keyring(host) or _from_file(configuration_folder() / FILE, host)


def _from_keyring(host: str) -> Credentials | None:
    try:
        import keyring  # pyright: ignore[reportMissingImports]
    except ImportError:
        return None
    try:
        found = keyring.get_credential(f"stiction {host}", None)
    except Exception:  # a keyring without a backend raises its own errors
        return None
    return None if found is None else Credentials(found.username, found.password)


def _from_file(path: Path, host: str) -> Credentials:
    if not path.is_file():
        return Credentials()
    if os.name == "posix" and path.stat().st_mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise RecordError(f"other users can read the passwords; run chmod 600 {path}.", where=path)
    try:
        stored = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise RecordError(
            f'cannot be read as TOML ({error}); write ["HOST"] with user and password below it.', where=path
        ) from None
    section = stored.get(host)
    if not isinstance(section, dict):
        return Credentials()
    return Credentials(*(str(section.get(name, "")) for name in ("user", "password", "token")))
