"""From a record or a given loop to advice: diagnosis, trial of remedies, and what goes out to the plant."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from stiction.apps.failure import Failure, fault
from stiction.apps.options import in_options
from stiction.errors import ParameterError, RecordError, StictionError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stiction.compensation import CompensationTrial
    from stiction.diagnosis import Diagnosis
    from stiction.models import PID, Loop

__all__ = ["Advice", "advise_file", "advise_loop"]


class Advice(NamedTuple):
    """What is said of one loop."""

    file: str | None
    """Name of its file; None where the loop was given."""
    diagnosis: Diagnosis | None
    """Its diagnosis; None where the loop was given."""
    trial: CompensationTrial
    """The remedies tried, or why none was."""
    structured_text: str | None
    """The compensator recommended, for a control system; None where none is."""
    work_order: str | None
    """The page for the valve shop; None where there is nothing to order."""


def advise_file(
    file: str,
    options: Mapping[str, Any],
    controller: PID | None,
    settings: Mapping[str, Any],
    single: Sequence[str],
    *,
    as_json: bool,
) -> tuple[list[Advice], list[Failure]]:
    """Advise on every loop of a file.

    Parameters
    ----------
    file : str
        Its name.
    options : mapping
        How to read it.
    controller : PID, optional
        The controller, where it is given.
    settings : mapping
        weights, seeds, duration of the trial.
    single : sequence of str
        Options asked for that are for one loop only.
    as_json : bool
        Whether the output is kept for JSON.

    Returns
    -------
    tuple of list
        The advice, and the loops, or the file that cannot be read, for which there is none.

    Raises
    ------
    ParameterError
        When it holds several loops and an option is for one.
    """
    from stiction import diagnose, read
    from stiction.apps.output import note, say, track
    from stiction.records import summarise

    try:
        records = read(file, **options)
    except RecordError as error:
        return [], [Failure(file, None, in_options(str(error)))]
    if single and len(records) > 1:
        tags = ", ".join(record.tag for record in records)
        raise ParameterError(f"{single[0]} is for one loop, {file} holds {len(records)} ({tags}); name one with --tag.")
    (note if as_json else say)(in_options(summarise(records).summary()))
    diagnoses: list[Diagnosis] = []
    failures: list[Failure] = []
    for record in track(records, "Diagnosing"):
        try:
            diagnoses.append(diagnose(record))
        except StictionError as error:
            failures.append(Failure(file, record.tag, str(error)))
        except Exception as error:
            failures.append(fault(file, record.tag, error))
    advices: list[Advice] = []
    for found in diagnoses:
        try:
            advices.append(_advice(file, found, _tried(found, controller, settings)))
        except StictionError:
            raise
        except Exception as error:
            failures.append(fault(file, found.record.tag, error))
    return advices, failures


def advise_loop(loop: Loop, tag: str, settings: Mapping[str, Any]) -> Advice:
    """Advise on a loop whose parameters are given."""
    return _advice(None, None, _tried(loop, None, settings, tag))


def _tried(
    source: Diagnosis | Loop, controller: PID | None, settings: Mapping[str, Any], tag: str = ""
) -> CompensationTrial:
    from stiction import compensate
    from stiction.apps.output import gauge
    from stiction.diagnosis import Diagnosis

    tag = source.record.tag if isinstance(source, Diagnosis) else tag
    with gauge(tag) as progress:
        trial = compensate(source, controller=controller, progress=progress, **settings)
    reason = in_options(trial.reason.removeprefix(f"{tag}: "))
    return replace(trial, tag=tag, reason=reason[:1].upper() + reason[1:])


def _advice(file: str | None, found: Diagnosis | None, trial: CompensationTrial) -> Advice:
    from stiction import work_order
    from stiction.compensation import recommended_text

    text = order = None
    if trial.twin is not None and trial.recommended and trial[trial.recommended].remedy.compensator is not None:
        low, high = trial.twin.loop.controller.op_limits
        # Settings found for an OP in deviations or another unit mean nothing to a control system.
        if trial.twin.around is None or math.isfinite(low):
            text = recommended_text(trial, (max(low, 0.0), min(high, 100.0)))
    if found is not None and found.verdict != "no_stiction":
        order = work_order(found, trial).to_text()
    return Advice(file, found, trial, text, order)
