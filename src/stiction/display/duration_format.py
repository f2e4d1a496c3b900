"""Durations as text."""

__all__ = ["format_seconds"]


def format_seconds(duration: float) -> str:
    """Return a duration as text, never with a power of ten.

    Parameters
    ----------
    duration : float
        Duration [s].

    Returns
    -------
    str
        Whole seconds from 1000 s on, otherwise four significant digits.

    Examples
    --------
    >>> format_seconds(95.25), format_seconds(0.123456), format_seconds(43200.0)
    ('95.25 s', '0.1235 s', '43200 s')
    """
    return f"{duration:.0f} s" if duration >= 1000.0 else f"{duration:.4g} s"
