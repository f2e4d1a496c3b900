"""Tell systemd that the service is ready, alive or ending; one datagram each, nothing where systemd does not ask."""

from __future__ import annotations

import os
import socket
from contextlib import suppress

__all__ = ["notify_systemd", "watchdog_interval"]


def notify_systemd(state: str) -> None:
    """Send a state, such as ``READY=1``, to the socket that NOTIFY_SOCKET names.

    Examples
    --------
    >>> notify_systemd("READY=1")
    """
    address = os.environ.get("NOTIFY_SOCKET", "")
    if not address or not hasattr(socket, "AF_UNIX"):
        return
    if address.startswith("@"):
        address = "\0" + address[1:]
    with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as one:
        one.connect(address)
        one.sendall(state.encode())


def watchdog_interval() -> float | None:
    """Time after which a sign of life is due [s]: half of what WATCHDOG_USEC allows; None where none is asked for."""
    text = os.environ.get("WATCHDOG_USEC", "")
    return float(text) / 2e6 if text.isdecimal() and int(text) > 0 else None
