"""Advice on the terminal, as a page and as JSON objects."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.apps.output import print_out
from stiction.apps.print_blocks import print_blocks
from stiction.report.blocks import Block, Collapsible, Heading, Sheet, Table
from stiction.report.page import write_page
from stiction.report.pages.trial import OVERVIEW_COLUMNS, trial_blocks, trial_headline, trial_line, trial_row

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from stiction.apps.advise import Advice
    from stiction.apps.failure import Failure

__all__ = ["advice_dict", "failed_advice_dict", "not_written_text", "print_advice", "write_advice_page"]


def print_advice(advices: Sequence[Advice], failures: Sequence[Failure]) -> None:
    """Print the advice on each loop."""
    for advice in advices:
        print_out("")
        blocks = trial_blocks(advice.trial, advice.diagnosis)
        print_blocks([block for block in blocks if not isinstance(block, Sheet)], details=False)
    for failure in failures if advices or len(failures) > 1 else ():
        print_out(f"\n{failure.tag}: no advice. {failure.reason}")


def write_advice_page(advices: Sequence[Advice], path: Path) -> Path:
    """Write the page of one loop, or of several loops in parts that open on a click."""
    pages = [trial_blocks(advice.trial, advice.diagnosis, advice.work_order) for advice in advices]
    trials = [advice.trial for advice in advices]
    if len(pages) == 1:
        title = "What if" if advices[0].file is None else trials[0].tag
        return write_page(title, pages[0], path, subtitle="Repair, retune or compensate")
    rows = [trial_row(trial, f"#loop-{k}") for k, trial in enumerate(trials)]
    blocks: list[Block] = [Table(OVERVIEW_COLUMNS, rows, "Advice for each loop."), Heading("Loops", anchor="loops")]
    blocks += [
        Collapsible(f"{trial.tag} · {trial_line(trial)}", page, anchor=f"loop-{k}")
        for k, (trial, page) in enumerate(zip(trials, pages, strict=True))
    ]
    return write_page("Repair, retune or compensate", blocks, path)


def not_written_text(key: str, target: Path, advice: Advice) -> str:
    """Say why a requested file is not written."""
    trial = advice.trial
    if key == "work_order":
        why = "The valve needs no work."
    elif trial.recommended and trial[trial.recommended].remedy.compensator is not None:
        why = "The OP of the record leaves 0 to 100 %, so the limits of the compensator are not known."
    else:
        why = trial.reason if trial.refused else f"The remedy '{trial.recommended}' needs no compensator."
    old = f" {target} is from an earlier run." if target.is_file() else ""
    return f"{key.replace('_', ' ').capitalize()}: not written. {why}{old}"


def advice_dict(advice: Advice, written: Mapping[str, str]) -> dict[str, Any]:
    """Return one loop for JSON, without series over time."""
    diagnosis, trial = advice.diagnosis, advice.trial.to_dict()
    trial.pop("trends")
    if trial["twin"] is not None:
        trial["twin"].pop("overlay")
    return {
        "file": advice.file,
        "tag": trial.pop("tag"),
        "verdict": None if diagnosis is None else diagnosis.verdict,
        "probability": None if diagnosis is None else diagnosis.probability,
        "oscillation_cause": None if diagnosis is None else diagnosis.oscillation_cause.to_dict(),
        "action": trial_headline(advice.trial, diagnosis).action,
        **trial,
        "structured_text": written.get("structured_text"),
        "work_order": written.get("work_order"),
        "error": None,
    }


def failed_advice_dict(failure: Failure) -> dict[str, Any]:
    """Return a loop without advice with the keys of the others."""
    unknown = ("probability", "oscillation_cause", "S", "J", "twin", "retuning", "structured_text", "work_order")
    return {
        "file": failure.file, "tag": failure.tag, "verdict": "undecided", "reason": failure.reason,
        "action": failure.remedy, "recommended": None, "expected_improvement": None, "refused": True, "risk": "",
        "weights": {}, "seeds": 0, "max_travel": None, "remedies": [],
        **dict.fromkeys(unknown), "error": failure.reason,
    }  # fmt: skip
