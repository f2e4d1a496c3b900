"""``stiction benchmark``: counts by record and by group against a count by hand, and what can be wrong with labels."""

from __future__ import annotations

import json

import pytest

from stiction.apps.benchmark import _print_scores
from stiction.fleet.verdict_scores import confusion_counts, reliability, score_causes, score_groups


def rows(*triples):
    return [{"group": g, "label": label, "verdict": v} for g, label, v in triples]


SOME = rows(
    ("A", "stiction", "stiction"),
    ("A", "stiction", "stiction"),
    ("A", "stiction", "undecided"),
    ("B", "stiction", "stiction"),
    ("B", "stiction", "no_stiction"),
    ("C", "no_stiction", "stiction"),
    ("D", "no_stiction", "no_stiction"),
    ("E", "no_stiction", "undecided"),
)


def test_counts_by_hand():
    assert confusion_counts(SOME) == {
        "n": 8, "right": 4, "true_alarms": 3, "missed": 1, "false_alarms": 1, "true_rests": 1, "undecided": 2,
    }  # fmt: skip


def test_groups_by_hand():
    """Two of three are a majority, one of two is none."""
    groups = {group["group"]: group["verdict"] for group in score_groups(SOME)}
    assert groups == {
        "A": "stiction", "B": "undecided", "C": "stiction", "D": "no_stiction", "E": "undecided",
    }  # fmt: skip
    assert confusion_counts(score_groups(SOME))["right"] == 2


def test_a_folder_is_judged(run, folder, sticky_csv, healthy_csv):
    place = folder / "set"
    place.mkdir()
    (place / "a.csv").write_text(sticky_csv)
    (place / "b.csv").write_text(healthy_csv)
    (place / "c.csv").write_text("")
    lines = [
        "file,loop,group,label,loop_type,integrating,dt_s,source",
        "a.csv,FIC-1,V1,stiction,flow,false,1.0,simulated",
        "b.csv,AIC-2,V2,no_stiction,concentration,false,1.0,simulated",
    ]
    (place / "labels.csv").write_text("\n".join(lines))
    done = run("benchmark", "set", "--json")
    assert done.code == 0
    assert json.loads(done.out)["groups"]["right"] == 2
    (place / "labels.csv").write_text("\n".join([*lines, "c.csv,FIC-3,V1,stiction,flow,,,empty"]))
    done = run("benchmark", "set", "--json")
    found = json.loads(done.out)
    assert done.code == 1
    assert found["records"]["undecided"] == 1
    assert found["groups"]["right"] == 1
    assert [row["verdict"] for row in found["results"]] == ["stiction", "no_stiction", "undecided"]
    assert "is empty" in found["results"][2]["reason"]


def test_no_probability_is_printed_as_certain(capsys):
    row = {"group": "A", "file": "a.csv", "label": "no_stiction", "cause": "valve", "reason": "It sticks."}
    missed = [{**row, "verdict": "stiction", "probability": p} for p in (0.9956, 0.999, 0.9)]
    cells = {"records": confusion_counts(missed), "groups": confusion_counts(missed), "causes": score_causes(missed)}
    bins = reliability(missed[:2])
    _print_scores({**cells, "reliability": bins, "calibration_error": 0.5, "seconds_per_record": 0.1}, missed, [])
    told = capsys.readouterr().out
    assert told.count(">0.99") == 3
    assert "1.00" not in told
    assert "0.90" in told
    assert "trained on simulated loops alone" in told


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (None, "has no labels.csv"),
        ("", "has no rows"),
        ("file,label\n", "has no rows"),
        ("name,label\na.csv,stiction\n", "no column file"),
        ("file,verdict\na.csv,stiction\n", "no column label"),
        ("file,label\nnone.csv,stiction\n", "line 2: there is no file"),
        ("file,label\na.csv,sticky\n", 'label "sticky" is unknown'),
        ("file,label,loop_type\na.csv,stiction,steam\n", 'loop_type "steam" is unknown'),
        ("file,label,integrating\na.csv,stiction,maybe\n", 'integrating "maybe"'),
        ("file,label,dt_s\na.csv,stiction,often\n", 'dt_s "often"'),
        ("file,label,group\na.csv,stiction,V\na.csv,no_stiction,V\n", "have different labels"),
        ("file,label\na.csv,stiction\n", "no record could be used"),
    ],
)
def test_labels_that_cannot_be_used(text, says, run, folder):
    (folder / "a.csv").write_text("")
    if text is not None:
        (folder / "labels.csv").write_text(text)
    done = run("benchmark", str(folder))
    assert done.code == 3
    assert says in done.err
    assert done.out == ""
