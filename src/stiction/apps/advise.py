"""Advice for a record or a given loop: diagnosis, trial of remedies, structured text and work order."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from stiction.apps.failure import Failure, try_each
from stiction.apps.options import option_text
from stiction.errors import ParameterError, RecordError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stiction.compensation import CompensationTrial
    from stiction.diagnosis import Diagnosis
    from stiction.models import PID, Loop

__all__ = ["Advice", "advise_file", "advise_loop"]


class Advice(NamedTuple):
    """Advice for one loop."""

    file: str | None
    """Name of its file; None for a given loop."""
    diagnosis: Diagnosis | None
    """Its diagnosis; None for a given loop."""
    trial: CompensationTrial
    """The trial of remedies, or the reason for none."""
    structured_text: str | None
    """The recommended compensator for a control system; None when there is none."""
    work_order: str | None
    """The work order for the valve shop; None when the valve needs no work."""


def advise_file(
    file: str,
    options: Mapping[str, Any],
    controller: PID | None,
    settings: Mapping[str, Any],
    single: Sequence[str],
    *,
    as_json: bool,
) -> tuple[list[Advice], list[Failure]]:
    """Give advice for every loop of a file.

    Parameters
    ----------
    file : str
        Name of the file.
    options : mapping
        Options of the reader.
    controller : PID, optional
        The controller; by default it is identified from the record.
    settings : mapping
        weights, seeds and duration of the trial.
    single : sequence of str
        Given options that are for one loop only.
    as_json : bool
        Whether the standard output is for JSON only.

    Returns
    -------
    tuple of list
        The advice, and the failures: loops without advice, or the file when it cannot be read.

    Raises
    ------
    ParameterError
        When the file holds several loops and an option is for one loop only.
    """
    import stiction
    from stiction.apps.output import print_err, print_out, track
    from stiction.records import summarise

    try:
        records = stiction.read(file, **options)
    except RecordError as error:
        return [], [Failure(file, None, error.text(option_text))]
    if single and len(records) > 1:
        tags = ", ".join(record.tag for record in records)
        raise ParameterError(
            f"{single[0]} is for one loop, but {file} contains {len(records)} loops ({tags}); choose one with --tag."
        )
    (print_err if as_json else print_out)(summarise(records).summary())
    diagnoses, failures = try_each(track(records, "Diagnosing"), stiction.diagnose)
    advices, more = try_each(diagnoses, lambda found: _advice(file, found, _run_trial(found, controller, settings)))
    return advices, [failure._replace(file=file) for failure in (*failures, *more)]


def advise_loop(loop: Loop, tag: str, settings: Mapping[str, Any]) -> Advice:
    """Give advice for a loop with given parameters."""
    return _advice(None, None, _run_trial(loop, None, settings, tag))


def _run_trial(
    source: Diagnosis | Loop, controller: PID | None, settings: Mapping[str, Any], tag: str = ""
) -> CompensationTrial:
    from stiction import compensate
    from stiction.apps.output import progress_callback
    from stiction.diagnosis import Diagnosis

    tag = source.record.tag if isinstance(source, Diagnosis) else tag
    with progress_callback(tag) as progress:
        trial = compensate(source, controller=controller, progress=progress, **settings)
    return replace(trial, tag=tag)


def _advice(file: str | None, diagnosis: Diagnosis | None, trial: CompensationTrial) -> Advice:
    from stiction import work_order
    from stiction.compensation import recommended_text

    text = order = None
    if trial.twin is not None and trial.recommended and trial[trial.recommended].remedy.compensator is not None:
        low, high = trial.twin.loop.controller.op_limits
        # A control system cannot use settings for an OP in deviations or in another unit.
        if trial.twin.inputs is None or math.isfinite(low):
            text = recommended_text(trial, (max(low, 0.0), min(high, 100.0)))
    if diagnosis is not None and diagnosis.verdict != "no_stiction":
        order = work_order(diagnosis, trial).to_text()
    return Advice(file, diagnosis, trial, text, order)
