"""Scores of what a diagnosis advises: findings against all true causes, and what the record could show."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from calibration.train_causes import HIDDEN_KINDS, cause_labels
from stiction.diagnosis.identification.loop_response import LoopResponse
from stiction.diagnosis.identification.result import MAX_PLAY_RATIO
from stiction.diagnosis.verdict.cause_features import CAUSE_FEATURES
from stiction.diagnosis.verdict.causes import CAUSES, assess_causes, find_detectable_S, is_position, is_stuck
from stiction.diagnosis.verdict.decision import DEFAULT_SMALLEST_S, decide
from stiction.diagnosis.verdict.finding import find_code, is_backlash

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["ACCEPTED", "advice_section", "judge_again"]

ACCEPTED = {
    "sticks": "valve", "probably_sticks": "valve", "backlash": "valve", "tuning": "tuning", "external": "external",
    "follows": "set_point", "set_point": "set_point", "rate_limit": "rate_limit", "dead_zone": "dead_zone",
    "sensor": "sensor", "valve_not_responding": "stuck",
}  # fmt: skip
"""Finding -> the cause that it names; other findings name none."""
ALSO_TRUE = {"rate limit": ("tuning",)}
"""Kind -> causes that are true of it besides its own: a lower gain helps a loop that its rate limit makes cycle."""
MOVED = 2.0
"""Amplitude of OP from which a good valve should be called good [% of span]."""


def judge_again(table: pl.DataFrame) -> pl.DataFrame:
    """The rows of a feature table with verdict, finding, causes and S_detectable by the stored models."""
    rows = [_judge(row) if row["state"] == "in_control" else _not_judged() for row in table.iter_rows(named=True)]
    known = table.drop([name for name in ("finding", "S_detectable", "verdict") if name in table.columns])
    return pl.concat([known, pl.DataFrame(rows, infer_schema_length=None)], how="horizontal")


def _not_judged() -> dict[str, Any]:
    return {"finding": "no_data", "verdict": "undecided", "S_detectable": None} | dict.fromkeys(
        (f"p_{name}" for name in CAUSES), 0.0
    )


def _judge(row: Mapping[str, Any]) -> dict[str, Any]:
    features = {one.name: np.nan if (x := row[f"y_{one.name}"]) is None else x for one in CAUSE_FEATURES}
    evidence = row["evidence"]
    response = LoopResponse(evidence=np.array(evidence) if evidence else None)
    S, causes = find_detectable_S(features, response), assess_causes(features)
    play = row["J"] is not None and row["S"] is not None and row["J"] <= MAX_PLAY_RATIO * row["S"]
    identification: Any = SimpleNamespace(is_play=play, S=row["S"])
    excluded = is_backlash(causes, identification, DEFAULT_SMALLEST_S)
    excluded |= S is not None and S <= DEFAULT_SMALLEST_S
    found = SimpleNamespace(
        verdict=decide(row["probability"], excluded=excluded), probability=row["probability"],
        oscillation_cause=causes, stuck=is_stuck(features, causes), S_detectable=S, identification=identification,
        op_is_position=is_position(features, causes), smallest_S=DEFAULT_SMALLEST_S,
        segment=SimpleNamespace(
            loop_state=SimpleNamespace(state="in_control", in_control=True),
            oscillation=SimpleNamespace(oscillating=row["oscillating"]),
        ),
    )  # fmt: skip
    given = {f"p_{name}": getattr(causes, name) for name in CAUSES}
    return {"finding": find_code(found), "verdict": found.verdict, "S_detectable": S} | given  # type: ignore[arg-type]


def outcome(row: Mapping[str, Any]) -> str:
    """Right where a true cause is named, wrong where only false ones are or a sticky valve is good; else open."""
    true = {*(row["causes"] or "").split("+"), *ALSO_TRUE.get(row["cause"], ())} - {""}
    if row["cause"] in HIDDEN_KINDS:
        true.add("stuck")
    named = {ACCEPTED[row["finding"]]} if row["finding"] in ACCEPTED else set()
    if row["verdict"] == "stiction":
        named.add("valve")
    if named & true:
        return "right"
    hidden = row["cause"] in HIDDEN_KINDS
    S = row["S_detectable"]
    missed = row["verdict"] == "no_stiction" and (hidden or (row["sticky"] and (S is None or row["true_S"] >= S)))
    no_action = row["finding"] == "nothing_found" and bool(row["causes"])
    return "wrong" if named or missed or no_action else "open"


def calibration_error(true: np.ndarray, probability: np.ndarray, bins: int = 10) -> float:
    """Mean distance of probability and truth over bins of equal counts [-]."""
    parts = np.array_split(np.argsort(probability, kind="stable"), bins)
    return float(np.mean([abs(probability[i].mean() - true[i].mean()) for i in parts]))


def advice_section(title: str, table: pl.DataFrame) -> list[str]:
    """Confusion of causes, wrong advice, reliability and what the record could show, as Markdown.

    Parameters
    ----------
    title : str
        Head of the section.
    table : polars.DataFrame
        Rows of `calibration.feature_table` of a set of kinds.

    Returns
    -------
    list of str
        Lines.
    """
    table = judge_again(table)
    table = table.with_columns(pl.Series("outcome", [outcome(row) for row in table.iter_rows(named=True)]))
    codes = [name for name in (*ACCEPTED, "not_in_command", "cause_unknown", "cannot_tell", "nothing_found", "no_data")
             if name in set(table["finding"])]  # fmt: skip
    heads = ["kind", "loops", *codes, "true cause named", "wrong advice"]
    lines = [f"### {title}", "", "Findings by kind, in loops.", "", "| " + " | ".join(heads) + " |",
             "|---" * len(heads) + "|"]  # fmt: skip
    for kind in sorted(set(table["cause"])):
        own = table.filter(pl.col("cause") == kind)
        counts = [str(int((own["finding"] == code).sum()) or "") for code in codes]
        shares = [f"{float((own['outcome'] == word).mean()):.2f}" for word in ("right", "wrong")]  # type: ignore[arg-type]
        lines.append("| " + " | ".join([kind, str(own.height), *counts, *shares]) + " |")
    knowable = table.filter(pl.col("causes") != "")
    right = float((knowable["outcome"] == "right").mean())  # type: ignore[arg-type]
    wrong = float((table["outcome"] == "wrong").mean())  # type: ignore[arg-type]
    lines += ["", f"Wrong advice in {100.0 * wrong:.1f} % of {table.height} loops; a true cause named in "
              f"{100.0 * right:.1f} % of the {knowable.height} that have one the record can show.", ""]  # fmt: skip
    judged = table.filter(pl.col("state") == "in_control")
    errors = []
    for cause in CAUSES:
        true, weights = cause_labels(judged, cause)
        used = weights > 0.0
        errors.append(f"{cause} {calibration_error(true[used], judged[f'p_{cause}'].to_numpy()[used]):.3f}")
    lines += ["Calibration error of each cause over ten bins of equal counts: " + ", ".join(errors) + ".", ""]
    return [*lines, *_power(table)]


def _power(table: pl.DataFrame) -> list[str]:
    """What `no_stiction` is worth: of valves that do not move, of sticky ones, of good ones."""
    hidden = pl.col("cause").is_in(HIDDEN_KINDS)
    other = ("position as OP", "pulsed", "pulses logged")
    seen = table.filter(pl.col("sticky") & ~hidden & ~pl.col("cause").is_in(other))
    shown = pl.col("S_detectable").is_not_null() & (pl.col("true_S") >= pl.col("S_detectable"))
    above, below = seen.filter(shown), seen.filter(~shown)
    good = table.filter(~pl.col("causes").str.contains("valve") & ~hidden & ~pl.col("cause").is_in(other))
    moved = good.filter(pl.col("oscillating") & (pl.col("amplitude_op") >= MOVED) & (pl.col("state") == "in_control"))

    def share(of: pl.DataFrame) -> str:
        return f"{100.0 * float((of['verdict'] == 'no_stiction').mean() or 0.0):.1f} % of {of.height}"  # type: ignore[arg-type]

    return [
        f"Called `no_stiction`: {share(table.filter(hidden))} valves whose stem did not move, {share(below)} sticky "
        f"ones with S below `S_detectable` or without one, {share(above)} with S above it, {share(good)} good ones, "
        f"{share(moved)} good ones whose OP swings by {MOVED:g} % or more.",
        "",
    ]  # fmt: skip
