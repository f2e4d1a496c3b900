"""`diagnose_all` and its result: the diagnoses of all loops of a source, by number or tag."""

from __future__ import annotations

from typing import Any

from stiction.diagnosis.evidence.one_loop import order_records
from stiction.diagnosis.loop_state import HEADLINES
from stiction.diagnosis.pipeline import diagnose
from stiction.diagnosis.verdict.diagnosis import Diagnosis
from stiction.display.finding_words import FINDINGS
from stiction.display.frames import as_native
from stiction.display.number_format import count_noun
from stiction.display.tagged import TaggedList
from stiction.errors import RecordError

__all__ = ["Diagnoses", "diagnose_all"]

COLUMNS = (
    "tag", "finding", "finding_text", "next_step", "verdict", "probability", "S", "S_low", "S_high", "J", "J_low",
    "J_high", "period_s", "S_detectable", "file",
)  # fmt: skip
"""Columns of the frame."""


class Diagnoses(TaggedList[Diagnosis]):
    """The diagnoses of many loops, a list that also takes a tag as index.

    Parameters
    ----------
    iterable : iterable of Diagnosis
        The items.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> found = st.diagnose_all([st.simulate(loop, sp=10.0, duration=2000.0, tag="FIC-101")])
    >>> found
    <Diagnoses: 1 loop, stiction in 1>
    >>> found["FIC-101"].verdict, found.to_frame()["finding_text"].to_list()
    ('stiction', ['Valve stiction'])
    """

    failures: tuple[str, ...] = ()
    """Why other loops of the source could not be read, a sentence each."""

    @staticmethod
    def _tag(item: Diagnosis) -> str:
        return item.record.tag

    def __repr__(self) -> str:
        """The number of loops, and of those whose valve sticks, in one line."""
        sticky = sum(one.verdict == "stiction" for one in self)
        left = f", {len(self.failures)} not read" if self.failures else ""
        return f"<Diagnoses: {count_noun(len(self), 'loop')}, stiction in {sticky}{left}>"

    def summary(self) -> str:
        """One line for each loop: finding and next step."""
        return "\n".join(f"{one.record.tag}: {_words(one)}. {one.next_step or one.action}" for one in self)

    def to_frame(self, native: str = "polars") -> Any:
        """Make a data frame of "polars", "pandas" or "pyarrow": one row for each loop.

        Columns `tag`, `finding`, `finding_text`, `next_step`, `verdict`, `probability` [-], `S` and `J` with their 95 %
        intervals [% of span; null where neither stiction nor play is found], `period_s` [s; null without an
        oscillation], `S_detectable` [% of span] and `file`.
        """
        import polars as pl

        rows = [_row(one) for one in self]
        return as_native(pl.DataFrame(rows, schema=list(COLUMNS), orient="row", infer_schema_length=None), native)

    def _repr_html_(self) -> str:
        from stiction.display.notebook import diagnoses_html

        return diagnoses_html(self, [(one.record.tag, _words(one), one.next_step or one.action) for one in self])


def diagnose_all(source: Any, *, prior: float = 0.25, methods: bool = False, **options: Any) -> Diagnoses:
    """Diagnose every loop of a source, one after the other; several records of one tag count as one loop.

    Parameters
    ----------
    source
        Records, or what `stiction.read` takes: a file, a folder, a pattern, a frame, the URL of a database.
    prior : float
        Share of sticky valves where the records come from [-].
    methods : bool
        Whether the published methods are applied as well.
    **options
        Options of `stiction.read`.

    Returns
    -------
    Diagnoses
        The diagnoses, by number or tag; `failures` says what could not be read. For a plant use `stiction.audit`, which
        works in many processes, goes on where it stopped, and groups shared oscillations.

    Raises
    ------
    RecordError
        When no loop can be read.
    ParameterError
        When an option is unknown or outside its limits.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> record = st.simulate(loop, sp=10.0, duration=2000.0, tag="FIC-101")
    >>> [one.finding for one in st.diagnose_all(record.to_frame(), tag="FIC-101")]
    ['sticks']
    """
    from stiction.records.record import LoopRecord
    from stiction.sources.read import open_loops

    failures: tuple[str, ...] = ()
    if isinstance(source, LoopRecord):
        records = [source]
    elif isinstance(source, (list, tuple)) and all(isinstance(one, LoopRecord) for one in source):
        records = list(source)
    else:
        loops = open_loops(source, **options)
        records, failed = loops.read_all()
        if not records and failed:
            raise failed[0].error
        failures = tuple(str(one.error) for one in failed)
    of_tag: dict[str, list[LoopRecord]] = {}
    for record in records:
        if record.pv is None:
            failures += (f"{record.tag} has no PV.",)
        else:
            of_tag.setdefault(record.tag, []).append(record)
    found = Diagnoses()
    for of_loop in of_tag.values():
        try:
            found.append(diagnose(order_records(of_loop), prior=prior, methods=methods))
        except RecordError as error:
            failures += (f"{of_loop[0].tag}: {error}",)
    found.failures = failures
    return found


def _words(one: Diagnosis) -> str:
    return FINDINGS[one.finding] if one.loop_state.in_control else HEADLINES[one.loop_state.state]


def _row(one: Diagnosis) -> tuple[Any, ...]:
    found = one.identification if one.shows_size else None
    sizes = (None,) * 6 if found is None else (found.S, found.S_low, found.S_high, found.J, found.J_low, found.J_high)
    period = one.oscillation.period if one.oscillation.oscillating else None
    source = one.record.provenance.source
    words = (one.finding, _words(one), one.next_step or one.action, one.verdict, one.probability)
    return (one.record.tag, *words, *sizes, period, one.S_detectable, source)
