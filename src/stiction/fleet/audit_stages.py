"""The stages of an audit: plan, screen, diagnosis, groups. They alone write to the ledger and the signals."""

from __future__ import annotations

import contextlib
import json
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.diagnosis.evidence.version import judging_version
from stiction.errors import RecordError
from stiction.fleet.audit_options import RUN_OPTIONS
from stiction.fleet.batch import Batch, LoopTask
from stiction.fleet.block_means import common_clock
from stiction.fleet.engine import Engine, ProcessEngine
from stiction.fleet.ledger import ResultKey, StoredResult
from stiction.fleet.loop_work import WorkSettings, cut_time
from stiction.fleet.oscillation_groups import group_oscillations
from stiction.fleet.progress import LoopRate, Progress
from stiction.fleet.rank import is_judged
from stiction.fleet.root_cause import LoopVerdict
from stiction.fleet.signals import clock_from_dict, clock_to_dict, read_signals, remove_unused_parts, write_signals
from stiction.fleet.source_parts import LoopPlace, place_to_dict, read_loop
from stiction.fleet.warm_up import warm_kernels

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Iterator
    from datetime import datetime

    from stiction.fleet.audit_options import AuditOptions
    from stiction.fleet.batch import Outcome
    from stiction.fleet.block_means import BlockMeans, Clock
    from stiction.fleet.ledger import Ledger

__all__ = ["AuditStages", "EmptyRangeError"]

BATCH_LOOPS = 16
"""Loops of one batch, which is written to the ledger at once [-]."""
SORTED_LOOPS = 32
"""Batches whose loops are sorted by their file, so that a file is not opened for each loop [-]."""
MAX_PROBED_PARTS = 32
"""Parts of the source of which a loop is read to find the common clock [-]."""


class EmptyRangeError(RecordError):
    """No loop has samples in the time that is asked for."""


class AuditStages:
    """One run of an audit over its loops."""

    def __init__(
        self,
        folder: Path,
        ledger: Ledger,
        key: ResultKey,
        span: tuple[datetime | None, datetime | None],
        options: AuditOptions,
        progress: Callable[[Progress], None],
        stop: threading.Event | None,
    ) -> None:
        self.ledger, self.key, self.span, self.options = ledger, key, span, options
        self.progress, self.stop = progress, stop
        self.signals = folder / "signals" if options.signals is None else Path(options.signals)
        self.places: dict[int, LoopPlace] = {}
        self.fingerprints: dict[int, str] = {}
        self.results = ledger.read_results(key)
        self.known = ledger.read_windows(key.options, judging_version())
        self.began = time.monotonic()
        self.loop_s = 0.0
        self._engine: Engine | None = None

    def run(self, places: list[LoopPlace], missing_tags: dict[str, list[str]]) -> None:
        """Do what is left to do with some loops."""
        numbers = self.ledger.register([(one.tag, json.dumps(place_to_dict(one))) for one in places])
        self.places = {numbers[one.tag]: one for one in places}
        states: dict[str, str] = {}
        prints = {part: part.fingerprint(states) for part in dict.fromkeys(one.part for one in places)}
        self.fingerprints = {k: prints[one.part] for k, one in self.places.items()}
        stored = {path.name for path in self.signals.glob("part-*")}
        self.results = {k: one for k, one in self.results.items() if not one.signals or one.signals in stored}
        clock, used = self._clock(), {name: getattr(self.options, name) for name in RUN_OPTIONS}
        body = {
            "since": self.span[0] and self.span[0].isoformat(),
            "until": self.span[1] and self.span[1].isoformat(),
            "clock": clock_to_dict(clock),
            "loops": sorted(self.places),
            "missing_tags": missing_tags,
            **used,
        }
        settings = WorkSettings(clock, *self.span, **used)
        self._plan(clock)
        number = self.ledger.begin_run(self.key, body)
        for stage in ("screen", "diagnose"):
            self._do(stage, settings)
        if self._is_stopped():
            return
        means = self._means()
        if lost := self._oscillating().keys() - means.keys():  # their parts are damaged
            self.results = {k: one for k, one in self.results.items() if k not in lost}
            for stage in ("screen", "diagnose"):
                self._do(stage, settings)
            means = self._means()
        groups = self._group(means)
        self.ledger.end_run(number, body | {"groups": groups})
        with contextlib.suppress(OSError):
            remove_unused_parts(self.signals, self.ledger.used_signals())

    def _plan(self, clock: Clock) -> None:
        """Compile the kernels, and report what is to do and how long it will take."""
        left = len(set(self._left("screen")) | set(self._left("diagnose")))
        samples, workers = round(clock.count * clock.dt / clock.fast_dt), self._open_engine().workers
        seconds = 0.0
        if left:
            self._report("compile", 0, 0)
            start_s, self.loop_s = warm_kernels(samples, clock.fast_dt)
            seconds = start_s + left * self.loop_s / workers
        parts = len({one.part for one in self.places.values()})
        unreadable = sum(bool(one.failure) for one in self.places.values())
        details = {"loops": len(self.places) - unreadable, "unreadable": unreadable, "parts": parts - unreadable}
        details |= {"samples": samples, "left": left, "workers": workers}
        self._report("plan", 0, 0, details=details | {"seconds": seconds})

    def close(self) -> None:
        """End the workers."""
        if self._engine is not None:
            self._engine.close()

    def _do(self, stage: str, settings: WorkSettings) -> None:
        """Screen or diagnose what is left."""
        left = self._left(stage)
        done = self._total(stage) - len(left)
        rate, total = LoopRate(), self._total(stage)
        self._report(stage, done, total)
        if not left:
            return
        outcomes = self._open_engine().run(self._batches(left, stage, settings), lambda: self._goes_on(stage))
        for found in outcomes:
            self._store(stage, found)
            rate.add(len(found))
            self._report(stage, done + rate.done, total, rate)

    def _left(self, stage: str) -> list[int]:
        """Loops still to screen, or to diagnose, worst first."""
        if stage == "screen":
            return [k for k in self.places if not self._is_done(k)]
        rows = {k: self.results[k].row for k in self.places if k in self.results}
        left = [k for k, row in rows.items() if row.status == "screened"]
        return sorted(left, key=lambda k: (-rows[k].priority, rows[k].tag))

    def _is_done(self, number: int) -> bool:
        """Whether the loop has a row of the present state of its source."""
        stored = self.results.get(number)
        if stored is None or stored.fingerprint != self.fingerprints[number]:
            return False
        return not (self.options.retry and stored.row.failed)

    def _total(self, stage: str) -> int:
        if stage == "screen":
            return len(self.places)
        rows = [self.results[k] for k in self.places if k in self.results]
        return sum(one.row.status == "screened" or one.stage == "diagnose" for one in rows)

    def _goes_on(self, stage: str) -> bool:
        """Whether another batch may begin: nobody stopped the run, and the budget of the diagnosis is left."""
        budget = self.options.budget_s
        if self._is_stopped():
            return False
        return budget is None or stage == "screen" or time.monotonic() - self.began < budget

    def _is_stopped(self) -> bool:
        return self.stop is not None and self.stop.is_set()

    def _batches(self, left: list[int], stage: str, settings: WorkSettings) -> Iterator[Batch]:
        size = BATCH_LOOPS * SORTED_LOOPS if self.options.budget_s is not None and stage == "diagnose" else len(left)
        for first in range(0, len(left), size):
            chosen = sorted(
                left[first : first + size], key=lambda k: (self.places[k].part.names, self.places[k].number)
            )
            for start in range(0, len(chosen), BATCH_LOOPS):
                yield Batch(tuple(self._task(k, stage) for k in chosen[start : start + BATCH_LOOPS]), settings)

    def _task(self, number: int, stage: str) -> LoopTask:
        screened = self.results[number].row if stage == "diagnose" else None
        return LoopTask(number, self.places[number], screened, self.known.get(number) if screened else None)

    def _store(self, stage: str, outcomes: list[Outcome]) -> None:
        """Write the signals of a batch, then its rows in one transaction."""
        means = {one.number: one.means for one in outcomes if one.means is not None}
        part = write_signals(self.signals, means, self.key) if means else ""
        rows = []
        for one in outcomes:
            name = part if one.number in means else ""
            if stage == "diagnose":
                name = self.results[one.number].signals
            rows.append((StoredResult(one.number, self.fingerprints[one.number], stage, name, one.row), one.cpu_s))
        self.ledger.write_windows(
            self.key.options, judging_version(), {one.number: one.windows for one in outcomes if one.windows}
        )
        self.ledger.write_results(self.key, rows)
        self.results |= {row.loop: row for row, _ in rows}

    def _clock(self) -> Clock:
        """The clock of an earlier run with the same key, or one that fits a sample of the loops."""
        for run in reversed(self.ledger.read_runs()):
            if ResultKey.of_run(run) == self.key and self.results:
                return clock_from_dict(run["body"]["clock"])
        first_of_part = {place.part: place for place in reversed(self.places.values())}
        probed = list(first_of_part.values())[::-1]
        step = -(-len(probed) // MAX_PROBED_PARTS)
        records, failure = [], None
        for place in probed[::step] + list(self.places.values())[:4]:
            try:
                record = cut_time(read_loop(place), *self.span)
                records += [record] if len(record) else []
            except RecordError as error:
                failure = error
        if not records:
            raise failure or EmptyRangeError(
                "No loop has samples in this time range; give an earlier since or a later until."
            )
        dated = [one for one in records if one.start is not None]
        return common_clock(dated or records)

    def _oscillating(self) -> dict[int, StoredResult]:
        """Results of the loops that oscillate and have block means."""
        rows = {k: self.results[k] for k in self.places if k in self.results}
        return {k: one for k, one in rows.items() if one.signals and one.row.oscillations}

    def _means(self) -> dict[int, BlockMeans]:
        """Block means of the loops that oscillate, as far as their parts are sound."""
        return read_signals(self.signals, {k: one.signals for k, one in self._oscillating().items()})

    def _group(self, means: dict[int, BlockMeans]) -> list[dict[str, Any]]:
        """Groups of the loops that oscillate, from their block means."""
        chosen = {k: one for k, one in self._oscillating().items() if k in means and is_judged(one.row)}
        self._report("group", 0, len(chosen))
        if len(chosen) < 2:
            return []
        secondary = {place.master: place.tag for place in self.places.values() if place.master}
        loops = [
            replace(one, secondary_tag=secondary.get(one.tag, one.secondary_tag)) for _, one in sorted(means.items())
        ]
        verdicts, oscillations, spans = {}, {}, {}
        for k, one in chosen.items():
            tag = self.places[k].tag
            oscillations[tag] = one.row.oscillations
            if one.row.in_control and one.row.probability is not None and one.row.oscillation_causes:
                verdicts[tag] = LoopVerdict(one.row.probability, one.row.oscillation_causes["tuning"])
            if self.places[k].span is not None:
                spans[tag] = self.places[k].span
        groups = group_oscillations(
            loops, verdicts=verdicts, connections=self.options.links, spans=spans, oscillations=oscillations
        )
        return [group.to_dict() | {"number": k, "summary": group.summary()} for k, group in enumerate(groups, 1)]

    def _open_engine(self) -> Engine:
        if self._engine is None:
            if self.options.dask is None:
                self._engine = ProcessEngine(self.options.workers)
            else:
                from stiction.fleet.dask_engine import DaskEngine

                engine = DaskEngine(self.options.dask, self.options.workers)
                self._engine = engine
                engine.check_workers(next(iter(self.places.values())))
        return self._engine

    def _report(
        self, stage: str, done: int, total: int, rate: LoopRate | None = None, details: dict[str, Any] | None = None
    ) -> None:
        rows = [one.row for one in self.results.values()]
        sticky = sum(row.verdict == "stiction" for row in rows)
        new, per_second, left = (rate.done, rate.per_second, None) if rate else (0, 0.0, None)
        if per_second > 0.0:
            left = (total - done) / per_second
            if stage == "screen":  # then the diagnosis of as large a share of all loops as of those screened so far
                share = sum(row.status == "screened" for row in rows) / max(1, done)
                left += share * total * self.loop_s / self._open_engine().workers
        self.progress(Progress(stage, done, total, new, per_second, left, sticky, details))
