"""The page of the paper: its parts in order, printed values and simulated values apart."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.report import labels
from stiction.report.blocks import Block, Cell, Heading, SideBySide, Table, Text
from stiction.report.figures import paper as figures

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from stiction.limitcycle import LimitCycle

__all__ = ["PARTS", "SOURCE", "TITLE", "paper_blocks"]

PARTS = {
    "table1": "Table I",
    "figure2": "Fig. 2",
    "figure3": "Fig. 3",
    "figure4": "Fig. 4",
    "figure5": "Fig. 5",
    "section5": "Section V",
    "equation5": "Eq. 5",
    "figure6": "Fig. 6",
    "equations6and7": "Eqs. 6-7",
    "figure7": "Fig. 7",
    "figure8": "Fig. 8",
    "errata": "Errata",
}
"""Function of `stiction.paper` -> its name in the paper, in the order of the paper."""
TITLE = "Issues in Modeling Stiction in Process Control Valves"
SOURCE = "R. Srinivasan, R. Rengaswamy, U. Nallasivam, V. Rajavelu, American Control Conference, 2008"

LEAD = (
    "A walk through the paper in its order: what it says, what its models do when they are run as printed and as "
    "corrected, and the errata with the numbers that prove them."
)
ORIGIN = (
    "From the paper come its equations, parameters, ramp rates and what it says it saw. Every curve here is simulated: "
    "the recorded data of its laboratory valve, flow loop and level loop are not available, and none are made up."
)

DERIVED = (
    "Derived here; the critical rates by bisection on simulated ramps from rest. Under Stribeck friction, stick-slip "
    "persists slightly above the closed-form rate below which a steady slide is unstable."
)


def paper_blocks(parts: Mapping[str, Any]) -> list[Block]:
    """Return the blocks of the computed parts: function of `stiction.paper` -> its result."""
    blocks: list[Block] = [Text(LEAD, kind="lead"), Text(ORIGIN)]
    return blocks + [block for part, data in parts.items() for block in _SECTIONS[part](data)]


def _table1(data: Any) -> list[Block]:
    names = [f"Reading {reading.name}" for reading in data.readings]
    rows = [[f"{p.symbol}  {p.meaning}".strip(), p.printed, *p.readings.values()] for p in data.parameters]
    quantities: tuple[tuple[str, Callable[[Any], float | str]], ...] = (
        ("Static friction band fS = 100 Fs / (A ΔP) [% of span]", lambda r: r.fs),
        ("Dynamic friction band fD = 100 Fc / (A ΔP) [% of span]", lambda r: r.fd),
        ("Deadband plus stickband S = fS + fD [% of span]", lambda r: r.S),
        ("Slip jump J = fS - fD [% of span]", lambda r: r.J),
        ("First break, Fs / A [psi]", lambda r: r.first_break),
        ("Damping ratio [-]", lambda r: r.damping_ratio),
        ("Natural frequency [rad/s]", lambda r: r.natural_frequency),
        ("Critical rate: stairs below, follows above [psi/s]", lambda r: r.critical_pressure),
        ("Rate below which a steady slide is unstable [psi/s]", lambda r: r.slide_pressure),
        ("Speed of the stem there [in/s]", lambda r: r.critical_speed),
        ("What makes the stairs", lambda r: {"inertial": "inertia", "stribeck": "Stribeck"}[r.critical.mechanism]),
    )
    derived = [[name, *(_number(value(reading)) for reading in data.readings)] for name, value in quantities]
    return [
        Heading("Section II: the mechanistic valve"),
        Text(
            "A stem with mass, spring and friction (eqs. 1 to 3). The paper's “3 lb” and “3.5 lb/s” do not fit its "
            "equations, and its slopes have no unit. Two readings give its Fig. 2: A takes the raw numbers as one "
            "consistent set with slopes in psi/s, B takes 3 pounds of mass with slopes in psi/min."
        ),
        Table(["Table I", "Printed", *names], rows, "Table I as printed and with explicit units."),
        Table(["What follows", *names], derived, DERIVED),
    ]


def _figure2(data: Any) -> list[Block]:
    rows = [
        [p.name, p.reading, f"{p.slope:g} {p.slope_unit}", p.behaviour, p.first_break, p.slips,
         p.slip, p.spacing]
        for p in data.panels
    ]  # fmt: skip
    columns = ["Panel", "Reading", "Slope", "Behaviour", "First break [psi]", "Slips", "Slip [in]", "Spacing [psi]"]
    return [
        Heading("Fig. 2: ramps of the pressure"),
        Text(
            "At slope 4 the stem goes in stairs, at slope 9 it breaks once and follows: in both readings, for other "
            "reasons in each. About 5 stairs in the printed Fig. 2b would mean A, about 22 would mean B."
        ),
        *(
            SideBySide([figures.fig2(panel) for panel in data.panels if panel.name == name])
            for name in ("2a", "2b", "2c")
        ),
        Table(columns, rows, "Read off the simulated ramps, 0 to 18 psi."),
    ]  # fmt: skip


def _lab(number: int, data: Any) -> list[Block]:
    text = {
        3: "Above the rate r the valve sticks, jumps once and follows. From the paper: 5 to 15 %, the two rates, what "
        "was seen, a static friction of about 5 %. Assumed: a jump of 2 %, which its text does not give.",
        4: "Below r it goes in stairs. The rates say that r lies between 0.0125 and 0.0167 %/s; the three-parameter "
        "model has r between them, the two others have no r to set.",
    }[number]
    models = list(data[0].behaviour)
    rows = [
        [f"{ramp.rate:g}", ramp.paper]
        + [Cell(ramp.behaviour[m], mark="good" if ramp.behaviour[m] == ramp.paper else "alert") for m in models]
        for ramp in data
    ]
    return [
        Heading(f"Section III, Fig. {number}: the laboratory valve"),
        Text(text),
        SideBySide([figures.lab_ramp(f"{number}{part}", ramp) for part, ramp in zip("ab", data, strict=True)]),
        Table(["Rate [%/s]", "Seen in the paper", *models], rows, "What each model makes of the ramp."),
    ]


def _figure5(data: Any) -> list[Block]:
    flow, travel = figures.fig5(data)
    return [
        Heading("Section III, Fig. 5: a flow loop in a refinery"),
        Text(
            "The paper's record varies in stick band and jump over the travel. Its text gives no numbers, so the table "
            "of sb and sj, the rate, the sensor and its noise are this project's; the way down is added because a flow "
            "alone shows the stick band only when both are seen."
        ),
        SideBySide([flow, travel]),
    ]


def _section5(data: Any) -> list[Block]:
    rows = [[Cell(p.name), p.quantity, *(_answer(p.answers[model]) for model in data.models)] for p in data.phenomena]
    said = [a for p in data.phenomena for a in p.answers.values() if a.paper is not None]
    agree = sum(a.paper == a.shown for a in said)
    return [
        Heading("Section V: which model shows what"),
        Text(
            f"Each cell is measured on the model. The paper speaks of {len(said)} of the cells, and {agree} of those "
            "agree with what it says. The first model is Table I in reading A on the slopes of Fig. 2, the others are "
            "the laboratory valve; the last has tables of sb and sj over travel and rate."
        ),
        Table(["Phenomenon", "Measured", *data.models], rows, "Shown or not, with the number that says so."),
    ]


def _equation5(data: Any) -> list[Block]:
    rows = [[reply.model, reply.last] for reply in data.replies]
    return [
        Heading("Eq. 5: the three-parameter model, printed and repaired"),
        Text(
            "As printed the stem jumps by sj in the direction of Δu: it keeps what the OP went beyond sb, and after a "
            "step, where Δu is 0 from the next sample on, it stays where it is for ever. Repaired it jumps to sb - sj "
            "behind the OP. Here sb = 2 %, sj = 1 %."
        ),
        SideBySide(
            [figures.stem_response(response) for response in data.responses if response.name != "ramp up and down"]
        ),
        Table(["Model", "Stem after a step from 0 to 10 % [% of span]"], rows, "All models but the printed one agree."),
    ]


def _figure6(data: Any) -> list[Block]:
    cycles = [[c.family or "-", *_cycle(c)] for c in data.cycles]
    columns = ["Rest levels", "Stable", "Period [s]", "OP amplitude [%]", "PV amplitude [%]"]
    return [
        Heading("Fig. 6: a level loop that cycles"),
        Text(data.note),
        figures.fig6(data),
        Table(columns, cycles, "The limit cycles of this loop, solved exactly."),
    ]


def _equations6and7(data: Any) -> list[Block]:
    names = {"printed": "printed, letter by letter", "roots repaired": "printed, roots mended (E3)",
             "corrected": "corrected (E3, E4)", "integer": "levels 0, ±d (E5)"}  # fmt: skip
    rows = [[names[form], f"{apart:.2g}"] for form, apart in data.worst.items()]
    return [
        Heading("Eqs. 6 and 7: the describing function of eq. 4"),
        Text(
            "Eq. 6 is misprinted twice: its roots, and a factor 2 on the inner root of its second branch. Eq. 7 is "
            "right. Both hold for rest levels ±d/2, ±3d/2, ...; with levels 0, ±d, ... the same valve has another N."
        ),
        SideBySide([figures.df_component(data, "real"), figures.df_component(data, "imaginary")]),
        Table(["Form", "Largest distance from N measured on the valve [-]"], rows, "Both parts together."),
    ]


def _figure7(data: Any) -> list[Block]:
    rows = [["as printed, roots mended", "half", *_cycle(c), "", ""] for c in data.printed]
    for c in data.corrected:
        exact = (f"{c.exact.period:.5g}", f"{c.exact.amplitude:.3g}") if c.exact is not None else ("", "")
        form = "corrected" if c.method == "describing function" else "exact only"
        rows.append([form, c.family, *_cycle(c), *exact])
    columns = ["Form", "Rest levels", "Stable", "Period [s]", "OP amplitude [%]", "PV amplitude",
               "Exact period [s]", "Exact OP amplitude [%]"]  # fmt: skip
    return [
        Heading("Fig. 7: the limit cycles of the example loop"),
        Text(
            "Gp = 1 / (5s² + 6s + 1), Gc = (0.1s² + 0.5s + 1) / s, d = 0.5. The paper finds A and C stable and B "
            "unstable. B is where N jumps: it parts A from C and is no oscillation. The factor that eq. 6 misses puts "
            "C off."
        ),
        SideBySide([figures.fig7(data, printed=True), figures.fig7(data, printed=False)]),
        Table(columns, rows, "Every crossing, beside the exact cycle of the loop where it has one."),
    ]


def _figure8(data: Any) -> list[Block]:
    text = "The paper does not give its disturbance: here it is a pulse at the process inlet, of our choice."
    if data.smallest is not None:
        text += f" The smallest pulse of that length that moves the loop from A to C is {abs(data.smallest[0]):.3g} %."
    return [Heading("Fig. 8: a disturbance moves the loop"), Text(text), figures.fig8(data)]


def _errata(data: Any) -> list[Block]:
    overview = [[Cell(e.number, href=f"#{e.number}"), e.where, e.printed, e.correct] for e in data]
    blocks: list[Block] = [
        Heading("Errata"),
        Table(["", "Where", "Printed", "Correct"], overview, "What was found while implementing the paper."),
    ]
    for e in data:
        rows = [[proof.quantity, proof.form, _number(proof.value)] for proof in e.proofs]
        blocks += [
            Heading(f"{e.number}, {e.where}", level=3, anchor=e.number),
            Text(e.why),
            Table(["Quantity", "Form", "Value"], rows),
        ]
    return blocks


def _cycle(cycle: LimitCycle) -> list[str]:
    stable = "boundary" if cycle.kind == "boundary" else {True: "stable", False: "unstable", None: "?"}[cycle.stable]
    return [stable, f"{cycle.period:.4g}", f"{cycle.amplitude:.4g}", f"{cycle.amplitude_pv:.3g}"]


def _answer(answer: Any) -> Cell:
    word = "yes" if answer.shown else "no"
    number = f" ({labels.format_number(answer.value)})" if answer.value == answer.value else ""
    return Cell(f"{word}{number}", mark="good" if answer.shown else "alert")


def _number(value: float | complex | str) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, complex):
        return f"{value.real:.4f} {'-' if value.imag < 0 else '+'} {abs(value.imag):.4f}j"
    return f"{value:.3e}" if abs(value) >= 1e5 else labels.format_number(float(value), significant=4)


_SECTIONS: dict[str, Callable[[Any], Sequence[Block]]] = {
    "table1": _table1,
    "figure2": _figure2,
    "figure3": lambda data: _lab(3, data),
    "figure4": lambda data: _lab(4, data),
    "figure5": _figure5,
    "section5": _section5,
    "equation5": _equation5,
    "figure6": _figure6,
    "equations6and7": _equations6and7,
    "figure7": _figure7,
    "figure8": _figure8,
    "errata": _errata,
}
