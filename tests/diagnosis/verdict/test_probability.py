"""From features to a probability: a slow twin that reads the tables by itself, and what must hold of any row."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.verdict import probability as page
from stiction.diagnosis.verdict.features import Features
from stiction.diagnosis.verdict.probability import causes, counted

TABLES = Path(st.__file__).parent / "diagnosis" / "verdict"


def table(name):
    with (TABLES / f"{name}.csv").open() as file:
        assert file.readline().startswith("# Found by tests/diagnosis/verdict/calibrate.py on 20")
        return list(csv.DictReader(file))


def odds(name, values):
    """Log odds of each outcome by a table, term by term."""
    out = {}
    for line in table(name):
        if line["feature"] == "constant":
            out[line["outcome"]] = float(line["slope"])
            continue
        low, high, usual, knot, slope, bend = (
            float(line[key]) for key in ("low", "high", "usual", "knot", "slope", "bend")
        )
        x = min(max(values[line["feature"]], low), high)
        out[line["outcome"]] += slope * (x - usual) + bend * (max(x - knot, 0.0) - max(usual - knot, 0.0))
    return out


def twin(row):
    """P(stiction), as the page's docstring has it."""
    values = row._asdict()
    second = odds("causes", values)
    if values["coarse"] <= 0.02 and values["still"] <= 0.1 and values["spikes"] <= 0.0:
        second.pop("sensor")
    if values["at_limit"] <= 0.0 and values["saturated"] <= 0.0:
        second.pop("saturation")
    whole = sum(math.exp(score) for score in second.values())
    share = {cause: math.exp(score) / whole for cause, score in second.items()}
    jump = (1.0 - page.JUMP) * (second["stiction"] - second["deadband"]) + page.JUMP * odds("jumps", values)["jump"]
    play = (share["stiction"] + share["deadband"]) / (1.0 + math.exp(jump))
    alike = (share["stiction"] + share["deadband"] - play) / (1.0 - play)
    fourth = odds("plant", values)
    kept = 1.0 / (1.0 + math.exp(-fourth["plant"]))
    total = (1.0 - page.LESS * kept) * odds("sticks", values)["stiction"]
    total += (1.0 - kept) * page.OTHERS * math.log(alike / (1.0 - alike)) + kept * page.PLANT * fourth["stiction"]
    return (1.0 - play) / (1.0 + math.exp(-total)), play


def rows(n):
    """Rows whose features lie about what is usual, some beyond the bounds of a table."""
    rng = np.random.default_rng(5)
    told = {line["feature"]: line for line in table("causes") if line["low"]}
    assert set(told) == set(Features._fields)
    low, high, usual = (
        np.array([float(told[name][key]) for name in Features._fields]) for key in ("low", "high", "usual")
    )
    for _ in range(n):
        yield Features(*(usual + 0.15 * (high - low) * rng.uniform(-1.0, 1.0, usual.size)).tolist())


def test_a_probability_is_what_its_page_says():
    told = []
    for row in rows(300):
        expected, play = twin(row)
        if not (1e-3 < play < 0.99 and expected > 1e-4):
            continue  # where a share is held, the twin has no rule
        found = causes(row)
        assert found["stiction"] == pytest.approx(expected, rel=1e-9)
        assert found["deadband"] == pytest.approx(play, rel=1e-9)
        told.append(expected)
    assert len(told) > 50
    assert min(told) < 0.1 < 0.5 < max(told)


def test_shares_and_log_odds_sum():
    for row in rows(100):
        found = causes(row)
        assert sum(found.values()) == pytest.approx(1.0)
        assert min(found.values()) >= 0.0
        share = found["stiction"] / (1.0 - found["deadband"])
        told = sum(one.log_odds for one in counted(row))
        assert share == pytest.approx(1.0 / (1.0 + math.exp(-told)), abs=1e-9)


def test_the_fourth_table_counts_as_far_as_a_record_looks_like_a_plants():
    for row in rows(20):
        values = row._asdict()
        kept = 1.0 / (1.0 + math.exp(-odds("plant", values)["plant"]))
        told = {one.feature: one.log_odds for one in counted(row)}
        assert told["plant"] == pytest.approx(kept * page.PLANT * odds("plant", values)["stiction"])
        assert told["usual"] == pytest.approx((1.0 - kept * page.LESS) * odds("sticks", values | usual())["stiction"])


def usual():
    """The usual value of each feature of the first table, where it adds nothing."""
    return {line["feature"]: float(line["usual"]) for line in table("sticks") if line["usual"]}
