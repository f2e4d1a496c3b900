"""Configurations: what is wrong is told with file, line, key, value and remedy."""

from __future__ import annotations

import itertools
from dataclasses import fields

import pytest

from stiction.errors import RecordError
from stiction.watch.configuration import AlarmSettings
from stiction.watch.read_configuration import read_configuration

GOOD = """\
folder = "results"
window = "8h"

[[source]]
address = "opc.tcp://plant:4840"
tags = ["FIC*", "LIC*"]
sampling = "0s"

[[source]]
address = "data"
reading = {dt = 5.0}

[alarms]
raise_at = 0.9
findings = ["sticks"]

[[channel]]
kind = "webhook"
url = "https://host/hook"

[metrics]
port = 9464
"""


def read(tmp_path, text):
    path = tmp_path / "plant.toml"
    path.write_text(text)
    return read_configuration(path)


def test_a_file_is_read_with_its_defaults(tmp_path):
    found = read(tmp_path, GOOD)
    assert (found.window_s, found.wait_s, found.prior) == (28_800.0, 1800.0, 0.25)
    assert [one.is_live for one in found.source] == [True, False]
    assert found.source[0].tags == ("FIC*", "LIC*")
    assert found.source[0].sampling_s == 0.0
    assert (found.alarms.raise_at, found.alarms.clear_at) == (0.9, AlarmSettings().clear_at)
    assert found.channel[0].name == "webhook host"
    assert found.metrics.port == 9464
    assert found.folder_beside(tmp_path / "plant.toml") == tmp_path / "results"


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ('window = "8h"', 'windw = "8h"', 2, "windw = '8h': the key is unknown; did you mean window?"),
        ('window = "8h"', "window = 8", 2, "window = 8 is of the wrong type; give a text in quotes."),
        ('window = "8h"', 'window = "5s"', 2, "window = '5s' is shorter than 10s; give a longer one, such as 4h."),
        (
            'window = "8h"',
            'window = "long"',
            2,
            "window = 'long' is not a duration; give for example 10m, 90s or 1.5h.",
        ),
        ('window = "8h"', 'window = "8h', 2, "is not TOML"),
        ("raise_at = 0.9", "raise_at = 1.5", 14, "raise_at = 1.5 is not a probability; give one between 0 and 1."),
        ("raise_at = 0.9", "clear_at = 0.9", 14, "clear_at = 0.9 is not below raise_at = 0.8; give a lower clear_at."),
        ('["sticks"]', '["stick"]', 15, "findings: 'stick' is unknown; give some of sticks, "),
        ('kind = "webhook"', 'kind = "pager"', 18, "kind = 'pager' is unknown; give webhook, smtp or apprise."),
        ('url = "https://host/hook"', "", 17, "url is missing, which a channel of kind webhook needs; give it."),
        ("port = 9464", "port = 94640", 22, "port = 94640 is not a port number; give 1 to 65535."),
        ('address = "data"', 'addres = "data"', 10, "addres = 'data': the key is unknown; did you mean address?"),
        ('address = "data"', "", 9, "address is missing; write it."),
        ('address = "data"', 'address = "data"\npassword = "pw@1"', 11, "password: credentials do not stand here"),
        ("opc.tcp://plant:4840", "opc.tcp://ana:pw@plant:4840", 4, "STICTION_HISTORIAN_PASSWORD"),
    ],
)
def test_what_is_wrong_is_reported_with_its_line(tmp_path, old, new, line, message):
    assert old in GOOD
    with pytest.raises(RecordError) as caught:
        read(tmp_path, GOOD.replace(old, new))
    assert f"plant.toml, line {line}: " in str(caught.value)
    assert message in str(caught.value)
    assert "pw@" not in str(caught.value)


def test_a_file_without_a_source_and_one_that_is_not_there_are_reported(tmp_path):
    with pytest.raises(RecordError, match=r"plant.toml: \[\[source\]\] is missing; write it."):
        read(tmp_path, 'window = "4h"\n')
    with pytest.raises(RecordError, match=r"cannot be read \(No such file or directory\); check the path"):
        read_configuration(tmp_path / "other.toml")


def test_every_key_has_a_docstring():
    import ast
    import inspect

    from stiction.watch import configuration

    for node in ast.parse(inspect.getsource(configuration)).body:
        if isinstance(node, ast.ClassDef):
            cells = node.body
            named = {one.target.id for one in cells if isinstance(one, ast.AnnAssign)}
            told = {
                one.target.id
                for one, following in itertools.pairwise(cells)
                if isinstance(one, ast.AnnAssign)
                and isinstance(following, ast.Expr)
                and isinstance(following.value, ast.Constant)
            }
            assert named == told
            assert named == {one.name for one in fields(getattr(configuration, node.name))}
