"""Names of months in the languages of plants, full and abbreviated."""

from __future__ import annotations

import re
import unicodedata

__all__ = ["month_number"]

_NAMES = (
    "january february march april may june july august september october november december",
    "januar februar maerz april mai juni juli august september oktober november dezember",
    "januar februar marz april mai juni juli august september oktober november dezember",
    "janner feber mrz april mai juni juli august september oktober november dezember",
    "janvier fevrier mars avril mai juin juillet aout septembre octobre novembre decembre",
    "enero febrero marzo abril mayo junio julio agosto septiembre octubre noviembre diciembre",
    "gennaio febbraio marzo aprile maggio giugno luglio agosto settembre ottobre novembre dicembre",
    "janeiro fevereiro marco abril maio junho julho agosto setembro outubro novembro dezembro",
    "januari februari maart april mei juni juli augustus september oktober november december",
    "januari februari mrt april maj juni juli augusti september oktober november december",
    "tammikuuta helmikuuta maaliskuuta huhtikuuta toukokuuta kesakuuta heinakuuta elokuuta syyskuuta lokakuuta "
    "marraskuuta joulukuuta",
)
_MIN_LETTERS = 3


def _abbreviations() -> dict[str, int]:
    """Each name and each of its beginnings that belongs to one month alone; English first, the others in turn."""
    months: dict[str, int] = {}
    for language in _NAMES:
        own: dict[str, set[int]] = {}
        for number, name in enumerate(language.split(), 1):
            for length in range(_MIN_LETTERS, len(name) + 1):
                own.setdefault(name[:length], set()).add(number)
        for text, numbers in own.items():
            if len(numbers) == 1:
                months.setdefault(text, next(iter(numbers)))
    return months


_MONTHS = _abbreviations()


def month_number(name: str) -> int:
    """Return the month (1 to 12) that a name or its first three or more letters mean, 0 when it is none.

    Examples
    --------
    >>> month_number("Feb"), month_number("Mär."), month_number("août"), month_number("lokakuuta"), month_number("Sun")
    (2, 3, 8, 10, 0)
    """
    plain = unicodedata.normalize("NFKD", name.lower().rstrip("."))
    return _MONTHS.get(re.sub(r"[^a-z]", "", plain), 0)
