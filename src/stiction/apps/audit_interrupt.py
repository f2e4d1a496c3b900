"""Ctrl-C during an audit: the first one lets the loops in work finish, the second one ends the audit."""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
from typing import Any

__all__ = ["AuditInterrupt"]

MAX_WAIT_S = 10.0
"""Time after the first Ctrl-C for the loops in work [s]."""
WORK_STAGES = ("screen", "diagnose")


class AuditInterrupt:
    """Handles Ctrl-C while it is open.

    While loops are in work the first one sets `stop`; the second one, or `MAX_WAIT_S` later, raises
    `KeyboardInterrupt`. At other times the first one does.
    """

    def __init__(self) -> None:
        self.stop = threading.Event()
        self.stage = "find"
        self._timer: threading.Timer | None = None
        self._before: Any = None

    def __enter__(self) -> AuditInterrupt:
        if threading.current_thread() is threading.main_thread():
            self._before = signal.signal(signal.SIGINT, self._handle)
        return self

    def __exit__(self, *_: object) -> None:
        if self._timer is not None:
            self._timer.cancel()
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def _handle(self, *_: object) -> None:
        if self.stop.is_set() or self.stage not in WORK_STAGES:
            raise KeyboardInterrupt
        self.stop.set()
        text = f"Stopping when the running loops are finished (at most {MAX_WAIT_S:.0f} s); press again to stop now.\n"
        sys.stderr.flush()
        os.write(sys.stderr.fileno(), text.encode())  # `print` cannot run twice at a time, as it might in here
        self._timer = threading.Timer(MAX_WAIT_S, _thread.interrupt_main)
        self._timer.daemon = True
        self._timer.start()
