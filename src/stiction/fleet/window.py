"""The time that a run audits."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING

from stiction.errors import ParameterError, Setting
from stiction.fleet.ledger import Ledger, ResultKey

if TYPE_CHECKING:
    Span = tuple[datetime | None, datetime | None]

__all__ = ["resolve_window"]


def resolve_window(
    ledger: Ledger, digest: str, since: datetime | str | None, until: datetime | None
) -> tuple[ResultKey, Span]:
    """Find the key of the results and the times of a run.

    `ledger`: the ledger, which tells where the data of the last audit ended. `digest`: digest of the options. `since`:
    first time; "last" is the end of the data of the last finished run, or the `since` of an unfinished run that asked
    for "last" too. `until`: time before which the samples end. Returns the key, and first and last time. Raises
    ParameterError when "last" has nothing to go on from, or `since` is not before `until`.
    """
    from stiction import __version__

    if isinstance(since, str):
        since = _end_of_last_run(ledger, digest)
    if since is not None and until is not None and since.replace(tzinfo=None) >= until.replace(tzinfo=None):
        raise ParameterError(
            Setting("since"), f" = {since} is not before ", Setting("until"), f" = {until}",
            remedy=("give an earlier ", Setting("since"), " or a later ", Setting("until")),
        )  # fmt: skip
    window = f"{since.isoformat() if since else ''}..{until.isoformat() if until else ''}"
    return ResultKey(window, digest, __version__), (since, until)


def _end_of_last_run(ledger: Ledger, digest: str) -> datetime:
    runs = ledger.read_runs()
    if runs and not runs[-1]["finished"] and runs[-1]["body"].get("since") and runs[-1]["options"] == digest:
        return datetime.fromisoformat(runs[-1]["body"]["since"])
    for run in reversed(runs):
        if run["finished"]:
            results = ledger.read_results(ResultKey.of_run(run))
            ends = [one.row.end for one in results.values() if one.row.end]
            if ends:
                return max(datetime.fromisoformat(end) for end in ends)
    raise ParameterError(
        Setting("since"),
        " = 'last' needs a finished audit of records with time stamps in this folder",
        remedy="run one without it first",
    )
