"""Controllers."""

from stiction.models.controllers.pid import PID

__all__ = ["PID"]
