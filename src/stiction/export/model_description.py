"""The description of an FMU: ``modelDescription.xml`` of FMI 2.0 and 3.0, and the build description of 3.0."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

if TYPE_CHECKING:
    from stiction.export.block import Block
    from stiction.export.variables import Variable

__all__ = ["build_description", "describe_model", "variables"]

_BASE_UNITS = {
    "s": {"s": 1}, "kg": {"kg": 1}, "m": {"m": 1}, "m2": {"m": 2}, "m/s": {"m": 1, "s": -1},
    "N": {"kg": 1, "m": 1, "s": -2}, "N/m": {"kg": 1, "s": -2}, "N s/m": {"kg": 1, "s": -1},
    "Pa": {"kg": 1, "m": -1, "s": -2}, "% of span": {},
}  # fmt: skip
"""Unit -> exponents of the base units; of others only the name is known."""


def variables(block: Block) -> list[tuple[Variable, str]]:
    """All variables in the order of their value references, and what each is for."""
    from stiction.export.variables import Variable

    return [
        *((one, "parameter") for one in block.parameters),
        *((one, "input") for one in block.inputs),
        *((one, "output") for one in block.outputs),
        (Variable("dt", block.dt, "s", "Sampling period of the model."), "constant"),
        (Variable("time", 0.0, "s", "Time."), "independent"),
    ]


def describe_model(block: Block, fmi: str, token: str) -> str:
    """Return ``modelDescription.xml``.

    Parameters
    ----------
    block : Block
        The model.
    fmi : str
        "2.0" or "3.0".
    token : str
        Identifier that the binary checks.
    """
    from stiction import __version__

    two = fmi == "2.0"
    known = variables(block)
    time = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    lines = ['<?xml version="1.0" encoding="UTF-8"?>']
    lines += [
        "<fmiModelDescription"
        + _attributes(fmiVersion=fmi, modelName=block.name, **{"guid" if two else "instantiationToken": token})
        + _attributes(
            description=f"{block.title} {block.source}", version=__version__,
            generationTool=f"stiction {__version__}", generationDateAndTime=time,
            variableNamingConvention="flat",
        )
        + ">"
    ]  # fmt: skip
    more = {} if two else {"fixedInternalStepSize": _number(block.dt), "hasEventMode": "false"}
    more["canGetAndSetFMUstate" if two else "canGetAndSetFMUState"] = "true"
    more["canSerializeFMUstate" if two else "canSerializeFMUState"] = "true"
    lines.append(
        "  <CoSimulation"
        + _attributes(modelIdentifier=block.name, canHandleVariableCommunicationStepSize="true", **more)
        + (">" if two else "/>")
    )
    if two:
        lines += ["    <SourceFiles>", '      <File name="fmu.c"/>', "    </SourceFiles>", "  </CoSimulation>"]
    units = sorted({one.unit for one, _ in known if _unit(one)})
    lines += ["  <UnitDefinitions>", *(_unit_lines(unit) for unit in units), "  </UnitDefinitions>"]
    lines.append('  <DefaultExperiment startTime="0"' + _attributes(stepSize=_number(block.dt)) + "/>")
    lines.append("  <ModelVariables>")
    shown = [row for row in known if not (two and row[1] == "independent")]
    write = _variable_2 if two else _variable_3
    lines += [write(k, one, role) for k, (one, role) in enumerate(shown)]
    lines += ["  </ModelVariables>", "  <ModelStructure>"]
    outputs = [k for k, (_, role) in enumerate(known) if role == "output"]
    if two:
        for part in ("Outputs", "InitialUnknowns"):
            lines += [f"    <{part}>", *(f'      <Unknown index="{k + 1}"/>' for k in outputs), f"    </{part}>"]
    else:
        lines += [f'    <{part} valueReference="{k}"/>' for part in ("Output", "InitialUnknown") for k in outputs]
    lines += ["  </ModelStructure>", "</fmiModelDescription>"]
    return "\n".join(lines) + "\n"


def build_description(block: Block) -> str:
    """Return ``sources/buildDescription.xml`` of FMI 3.0."""
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<fmiBuildDescription fmiVersion="3.0">\n'
        f"  <BuildConfiguration{_attributes(modelIdentifier=block.name)}>\n"
        '    <SourceFileSet language="C99" compilerOptions="-ffp-contract=off">\n'
        '      <SourceFile name="fmu.c"/>\n'
        "    </SourceFileSet>\n"
        "  </BuildConfiguration>\n"
        "</fmiBuildDescription>\n"
    )


def _variable_2(k: int, one: Variable, role: str) -> str:
    head = _attributes(name=one.name, valueReference=str(k), description=f"{one.description} [{one.unit}]")
    kinds = {
        "parameter": {"causality": "parameter", "variability": "fixed", "initial": "exact"},
        "input": {"causality": "input", "variability": "discrete"},
        "output": {"causality": "output", "variability": "discrete", "initial": "calculated"},
        "constant": {"causality": "local", "variability": "constant", "initial": "exact"},
    }
    return f"    <ScalarVariable{head}{_attributes(**kinds[role])}><Real{_value(one, role)}/></ScalarVariable>"


def _variable_3(k: int, one: Variable, role: str) -> str:
    head = _attributes(name=one.name, valueReference=str(k), description=f"{one.description} [{one.unit}]")
    kinds = {
        "parameter": {"causality": "parameter", "variability": "fixed", "initial": "exact"},
        "input": {"causality": "input", "variability": "discrete"},
        "output": {"causality": "output", "variability": "discrete", "initial": "calculated"},
        "constant": {"causality": "local", "variability": "constant", "initial": "exact"},
        "independent": {"causality": "independent", "variability": "continuous"},
    }
    return f"    <Float64{head}{_attributes(**kinds[role])}{_value(one, role)}/>"


def _value(one: Variable, role: str) -> str:
    found = {"unit": one.unit} if _unit(one) else {}
    if math.isfinite(one.low):
        found["min"] = _number(one.low)
    if math.isfinite(one.high):
        found["max"] = _number(one.high)
    if role in ("parameter", "input", "constant"):
        found["start"] = _number(one.value)
    return _attributes(**found)


def _unit(one: Variable) -> str:
    return "" if one.unit == "-" else one.unit


def _unit_lines(unit: str) -> str:
    if unit not in _BASE_UNITS:
        return f"    <Unit{_attributes(name=unit)}/>"
    factor = {"factor": "0.01"} if unit == "% of span" else {}
    base = _attributes(**{name: str(power) for name, power in _BASE_UNITS[unit].items()}, **factor)
    return f"    <Unit{_attributes(name=unit)}><BaseUnit{base}/></Unit>"


def _number(value: float) -> str:
    """A number as XML writes it."""
    return {"inf": "INF", "-inf": "-INF", "nan": "NaN"}.get(repr(value), repr(value))


def _attributes(**pairs: str) -> str:
    return "".join(f" {name}={quoteattr(value)}" for name, value in pairs.items())
