"""The main question, asked of whatever holds the record: a path, a data frame, or records."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.diagnosis import pipeline
from stiction.diagnosis.evidence.one_loop import order_records
from stiction.diagnosis.verdict.decision import DEFAULT_SMALLEST_S, Costs
from stiction.errors import ParameterError
from stiction.sources.one_loop import records_of_loop

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from stiction.diagnosis.verdict.diagnosis import Diagnosis
    from stiction.records.record import LoopRecord

__all__ = ["diagnose"]


def diagnose(
    record: LoopRecord | Sequence[LoopRecord] | Sequence[str | os.PathLike[str]] | Any,
    *,
    tag: str | None = None,
    prior: float = 0.25,
    costs: Costs | None = None,
    smallest_S: float = DEFAULT_SMALLEST_S,
    methods: bool = True,
) -> Diagnosis:
    """Say whether the valve of a loop sticks, how much, how sure that is, and what to do.

    Parameters
    ----------
    record : LoopRecord or sequence of LoopRecord
        A record of one loop, OP and PV at least, or several of the same loop; or a path, several paths, or a data frame
        that holds one loop. Long records are cut into windows, which are judged one by one and pooled.
    tag : str, optional
        The loop, where the path or frame holds several.
    prior : float
        Share of sticky valves where the record comes from [-].
    costs : Costs, optional
        What a false alarm, a missed sticky valve and an open question cost; 1, 1 and 0.3 when not given.
    smallest_S : float
        Smallest S that matters [% of span]: no valve is called good whose stiction of this size would not have shown.
    methods : bool
        Whether the published methods are applied as well, for comparison: `Diagnosis.evidence`. They take a tenth of
        the time, and no other number depends on them.

    Returns
    -------
    Diagnosis
        Verdict with probability, reason and action; the evidence; the identified valve and process. A record that
        cannot be judged is `undecided`, with the reason.

    Raises
    ------
    RecordError
        When a record has no PV at all, or the path or frame cannot be read; or when records are not of one loop, or
        contradict each other.
    ParameterError
        When the path or frame holds several loops and `tag` names none of them, `costs` are no `Costs`, the prior is
        not between 0 and 1, or `smallest_S` is not positive.

    Notes
    -----
    The stages are those of `diagnosis/pipeline.py`, each a function of the results before it. See
    docs/understand/verdict.md.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> st.diagnose(st.simulate(loop, sp=10.0, duration=2000.0, loop_type="flow")).verdict
    'stiction'
    """
    records = order_records(records_of_loop(record, tag))
    if costs is not None and not isinstance(costs, Costs):
        raise ParameterError(f"costs = {costs!r} is not a Costs; give Costs(false_alarm=1.0, missed=1.0, ask=0.3).")
    return pipeline.diagnose(records, prior=prior, costs=costs, smallest_S=smallest_S, methods=methods)
