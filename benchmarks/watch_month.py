"""Thirty days of a plant under watch, as fast as it goes: `python benchmarks/watch_month.py FOLDER --loops 200`.

A tenth of the valves begins to stick (S above 2 % of span), half of these are repaired. Loads, set points and noise
change from day to day; loops are in manual for a while, the plant is shut down for a day, the source fails for a day.
The script prints how many sticking valves were alarmed within five days, the false alarms, and the repairs confirmed.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from calibration.historian.data_faults import add_manual_period
from calibration.histories import HistoryPlan
from calibration.populations.histories import try_history
from stiction.records.parquet_writer import to_parquet
from stiction.watch.alarm import read_alarms
from stiction.watch.judge import SAMPLES_FOLDER, judge_window
from stiction.watch.read_configuration import read_configuration
from stiction.watch.store import WatchStore

DAYS = 30
SAMPLES = 1440
BEGIN = datetime(2026, 3, 1, tzinfo=UTC)
SHUTDOWN_DAY, FAILED_DAY = 17, 23
OTHERS = {"good": 0.7, "external": 0.15, "tight": 0.1, "sensor": 0.05}
"""What is wrong with the loops whose valves do not stick, and how often [-]."""
CONFIG = """\
window = "24h"
workers = {workers}
keep = "3650d"
[[source]]
address = "{data}"
delay = "0s"
[alarms]
max_per_day = 1000
"""


def draw_loop(number: int, seed: int, *, is_sticky: bool, is_repaired: bool):
    """Records of all days, S of each, and the days of onset and repair."""
    for attempt in range(200):
        rng = np.random.default_rng([60, seed, number, attempt])
        onset = int(rng.integers(3, 11)) if is_sticky else DAYS
        repair = int(rng.integers(onset + 7, 25)) if is_repaired else DAYS
        days = np.arange(DAYS)
        shares = np.where((days >= onset) & (days < repair), 1.0, 0.0) if is_sticky else np.ones(DAYS)
        fault = "sticky" if is_sticky else str(rng.choice(list(OTHERS), p=list(OTHERS.values())))
        plan = HistoryPlan(fault, "onset" if is_sticky else "constant", SAMPLES, stored=False, shares=shares)
        windows = list(try_history(plan, rng))
        if len(windows) == DAYS and (not is_sticky or max(one.S for one in windows) > 2.0):
            return fault, onset, repair, [one.record for one in windows]
    raise RuntimeError(f"no history for loop {number}")


def disturb(record, rng: np.random.Generator, day: int):
    """Put a record into a day: in manual for a while, or shut down."""
    if day == SHUTDOWN_DAY:
        n = len(record)
        noise = 0.01 * rng.normal(size=n)
        record = replace(
            record, op=np.zeros(n), pv=record.pv[0] + noise, sp=None, mv=None, valve_signal=None, auto=None
        )
    elif rng.random() < 0.03:
        record = add_manual_period(record, 0.4, int(rng.integers(1 << 30)))
    return record


def main() -> None:
    """Draw, judge day by day, and count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--loops", type=int, default=200)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    data = given.folder / "data"
    data.mkdir(parents=True)
    n_sticky = given.loops // 10
    plant = [
        draw_loop(k, given.seed, is_sticky=k < n_sticky, is_repaired=k < n_sticky // 2) for k in range(given.loops)
    ]
    print(f"{given.loops} loops drawn", flush=True)
    file = given.folder / "plant.toml"
    file.write_text(CONFIG.format(data=data, workers=given.workers))
    config = read_configuration(file)
    folder = config.folder_beside(file)
    for name in (SAMPLES_FOLDER, "parts"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    store = WatchStore(folder)
    began = time.monotonic()
    for day in range(DAYS):
        start = BEGIN + timedelta(days=day)
        records = []
        for k, (_, _, _, days) in enumerate(plant):
            rng = np.random.default_rng([61, given.seed, k, day])
            record = disturb(days[day], rng, day)
            records.append(replace(record, tag=f"FIC-{1000 + k}", start=start + timedelta(hours=2)))
        path = data / "day.parquet"
        path.unlink(missing_ok=True)
        if day != FAILED_DAY:
            to_parquet(records, path)
        first = round(1e6 * start.timestamp())
        store.close_window(first, first + 86_400_000_000, {})
        judge_window(config, folder, store, first, first + 86_400_000_000)
        is_open = len(read_alarms(store, only_open=True))
        print(f"day {day}: {is_open} open alarms, {time.monotonic() - began:.0f} s", flush=True)
    print(json.dumps(count(store, plant, n_sticky), indent=1))
    store.close()


def count(store: WatchStore, plant, n_sticky: int) -> dict:
    """Compare the alarms of valves with the truth."""
    day_of = lambda moment: (datetime.fromtimestamp(moment, UTC) - BEGIN).total_seconds() / 86_400.0  # noqa: E731
    alarms = [one for one in read_alarms(store) if one.kind == "valve"]
    in_time, confirmed, delays, false = 0, 0, [], []
    for k, (fault, onset, repair, _) in enumerate(plant):
        mine = sorted((one for one in alarms if one.loop == f"FIC-{1000 + k}"), key=lambda one: one.raised)
        true = [one for one in mine if onset < day_of(one.raised) <= repair + 1]
        false += [(one.loop, fault, round(day_of(one.raised))) for one in mine if one not in true]
        if k < n_sticky:
            delays.append(day_of(true[0].raised) - onset if true else None)
            in_time += bool(true) and delays[-1] <= 5.0
            if k < n_sticky // 2:
                confirmed += bool(true) and true[-1].cleared is not None and day_of(true[-1].cleared) > repair
    raised = [one for one in delays[: n_sticky // 2] if one is not None]
    return {
        "sticking": n_sticky, "alarmed within five days": in_time, "days to the alarm": delays,
        "repaired and alarmed before": len(raised), "repairs confirmed": confirmed,
        "false alarms of the valve": len(false), "which": false, "loops": len(plant),
        "alarms of other kinds": sum(one.kind != "valve" for one in read_alarms(store)),
    }  # fmt: skip


if __name__ == "__main__":
    main()
