"""Walk the folders: a page without branch, facts row, published numbers or source is not finished."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import inspect
import re
from pathlib import Path

import pytest

import stiction
from stiction.models import Valve, dispatch

pytestmark = pytest.mark.quick

PACKAGE = Path(stiction.__file__).parent
ROOT = Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "tests" / "reference"


def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8") if path.exists() else ""


KEYS = set(re.findall(r"^@\w+\{([^,\s]+),", text_of(PACKAGE / "references.bib"), re.M))
PUBLISHED = "\n".join(text_of(p) for p in sorted(REFERENCE.rglob("*")) if p.suffix in (".py", ".csv", ".json", ".toml"))


def pages(room: str) -> list[str]:
    return sorted(p.stem for p in (PACKAGE / room).glob("*.py") if not p.stem.startswith("_"))


def valves_of(page: str) -> list[type[Valve]]:
    module = importlib.import_module(f"stiction.models.valves.{page}")
    classes = [t for _, t in inspect.getmembers(module, inspect.isclass) if t.__module__ == module.__name__]
    return [t for t in classes if issubclass(t, Valve)]


VALVES = [valve for page in pages("models/valves") for valve in valves_of(page)]
STUDIED = [valve for valve in VALVES if valve.__name__ != "Ideal"]
"""The ideal valve is nobody's: it has no source."""


def test_there_are_valves():
    assert {v.__name__ for v in VALVES} >= {"Stenman", "Choudhury", "Kano", "He", "Srinivasan", "Ideal"}


def branches() -> set[int]:
    """Codes that the switch asks for by name, and the ideal valve's, which it falls through to."""
    steps = [f for f in ast.parse(inspect.getsource(dispatch)).body if getattr(f, "name", "").endswith("_step")]
    asked = [node for f in steps for node in ast.walk(f) if isinstance(node, ast.Compare)]
    names = [ast.unparse(node.comparators[0]) for node in asked if ast.unparse(node.left) == "model"]
    return {getattr(dispatch, name) for name in names} | {dispatch.IDEAL}


@pytest.mark.parametrize("valve", VALVES, ids=lambda v: v.__name__)
def test_valve_has_a_branch(valve):
    code = vars(valve)["code"]
    if isinstance(code, int):
        assert code in branches()
        assert [v for v in VALVES if vars(v)["code"] == code] == [valve]


@pytest.mark.parametrize("page", pages("models/valves"))
def test_step_is_called_by_the_switch(page):
    steps = re.findall(r"^def ([a-z]\w+_step)\(", text_of(PACKAGE / "models/valves" / f"{page}.py"), re.M)
    called = inspect.getsource(dispatch)
    assert [step for step in steps if f"{step}(" not in called] == []


@pytest.mark.parametrize("valve", VALVES, ids=lambda v: v.__name__)
def test_valve_has_a_facts_row(valve):
    from stiction.models.model_properties import VALVE_PROPERTIES

    assert valve.__name__ in VALVE_PROPERTIES


def test_no_facts_row_without_a_valve():
    from stiction.models.model_properties import VALVE_PROPERTIES

    assert set(VALVE_PROPERTIES) == {valve.__name__ for valve in VALVES}


@pytest.mark.parametrize("valve", STUDIED, ids=lambda v: v.__name__)
def test_valve_has_published_numbers(valve):
    assert re.search(rf"\b{valve.__name__}\b", PUBLISHED), "no row in tests/reference/"


@pytest.mark.parametrize("valve", STUDIED, ids=lambda v: v.__name__)
def test_valve_names_its_source(valve):
    parts = re.split(r"References\n-{10}\n", inspect.getdoc(valve) or "")
    keys = set(re.findall(r"\b[a-z][a-z_]+\d{4}[a-z]?\b", parts[-1].split("\n\n")[0])) if len(parts) > 1 else set()
    assert keys
    assert keys <= KEYS


def compensators() -> dict[str, str]:
    """Compensator -> its page."""
    from stiction.models.compensators import Compensator

    found = {}
    for page in pages("models/compensators"):
        module = importlib.import_module(f"stiction.models.compensators.{page}")
        classes = [t for _, t in inspect.getmembers(module, inspect.isclass) if t.__module__ == module.__name__]
        found |= {t.__name__: page for t in classes if issubclass(t, Compensator) and t is not Compensator}
    return found


@pytest.mark.parametrize("name", compensators())
def test_compensator_is_complete(name):
    """A page with its step, a code of its own, a branch, a facts row with a source, and rows of numbers."""
    from stiction.models import compensators as room
    from stiction.models.compensators.compensator_properties import COMPENSATOR_PROPERTIES

    page = compensators()[name]
    facts = COMPENSATOR_PROPERTIES[name]
    assert f"{page}_step(" in inspect.getsource(dispatch.compensator_step)
    assert [other for other in compensators() if getattr(room, other).code == getattr(room, name).code] == [name]
    assert set(facts.parameters) == {f.name for f in dataclasses.fields(getattr(room, name))}
    assert facts.source in KEYS
    assert facts.source in (inspect.getdoc(getattr(room, name)) or "").split("References")[-1]
    assert getattr(stiction, name) is getattr(room, name)
    assert re.search(rf"\b{name}\b", PUBLISHED), "no row in tests/reference/"
    assert set(COMPENSATOR_PROPERTIES) == set(compensators())


DETECTORS = [
    page
    for page in pages("diagnosis/detection")
    if re.search(rf"^def {page}\(", text_of(PACKAGE / "diagnosis/detection" / f"{page}.py"), re.M)
]
"""A detector's page holds the function of its name."""


@pytest.mark.parametrize("page", DETECTORS)
def test_detector_has_a_facts_row_and_a_source(page):
    from stiction.diagnosis.detection.facts import FACTS

    assert page in FACTS
    assert FACTS[page].function.__name__ == page
    assert FACTS[page].source in KEYS


@pytest.mark.parametrize("page", DETECTORS)
def test_detector_has_a_test_with_numbers(page):
    tests = "".join(text_of(p) for p in sorted((ROOT / "tests").rglob("*.py")) if p.parent.name != "contracts")
    assert re.search(rf"\b{page}\b", tests)
