"""The diagnosis of one loop in an audit, on its shortened record."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.fleet.loop_oscillations import LoopOscillation
from stiction.fleet.loop_row import main_oscillation
from stiction.fleet.rank import rank_row
from stiction.fleet.reduced_record import cut_time, reduce_record
from stiction.fleet.source_parts import read_loop

if TYPE_CHECKING:
    from stiction.fleet.loop_row import WorkSettings
    from stiction.fleet.source_parts import LoopPlace
    from stiction.records.record import LoopRecord

__all__ = ["diagnose_loop", "diagnose_record"]


def diagnose_loop(place: LoopPlace, settings: WorkSettings, screened: dict[str, Any]) -> dict[str, Any]:
    """Diagnose one loop on its shortened record.

    Parameters
    ----------
    place : LoopPlace
        The loop.
    settings : WorkSettings
        Time span, prior and costs.
    screened : dict
        Its row of the screen.

    Returns
    -------
    dict
        The row with the verdict.

    Raises
    ------
    RecordError
        When the loop cannot be read.
    """
    return diagnose_record(cut_time(read_loop(place), settings.since, settings.until), settings, screened)


def diagnose_record(record: LoopRecord, settings: WorkSettings, screened: dict[str, Any]) -> dict[str, Any]:
    """Diagnose the record of a loop, as `diagnose_loop` does."""
    from stiction.diagnosis import diagnose
    from stiction.diagnosis.verdict.decision import Costs

    periods = [LoopOscillation(**one) for one in screened["oscillations"]]
    main = main_oscillation(periods)
    shorter = reduce_record(record, main.period if main is not None else float("nan"))
    found = diagnose(shorter, prior=settings.prior, costs=Costs(*settings.costs)).to_dict()
    row = screened | {name: found[name] for name in ("verdict", "probability", "reason", "action")}
    row |= {"status": "diagnosed", "loop_state": found["loop_state"]["state"]}
    causes = found["oscillation_cause"]
    row |= {"oscillation_causes": causes, "oscillation_cause": _main_cause(causes)}
    oscillation = found["oscillation"]
    if oscillation["oscillating"]:
        row |= {"oscillating": True, "period_s": oscillation["period_s"], "regularity": oscillation["regularity"]}
    valve = found["stiction"] or {}
    if row["verdict"] != "no_stiction":
        row |= {name: valve.get(name) for name in ("S", "S_low", "S_high", "J", "J_low", "J_high")}
    return rank_row(row)


def _main_cause(causes: dict[str, Any]) -> str:
    from stiction.diagnosis.verdict.causes import OscillationCause

    return OscillationCause(**causes).main
