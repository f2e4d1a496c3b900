"""Durations as text."""

__all__ = ["in_seconds"]


def in_seconds(duration: float) -> str:
    """Return a duration as text, never with a power of ten.

    Parameters
    ----------
    duration : float
        Duration [s].

    Returns
    -------
    str
        Whole seconds from a thousand on, else four significant digits.

    Examples
    --------
    >>> in_seconds(95.25), in_seconds(0.123456), in_seconds(43200.0)
    ('95.25 s', '0.1235 s', '43200 s')
    """
    return f"{duration:.0f} s" if duration >= 1000.0 else f"{duration:.4g} s"
