"""The errata of the paper, E1 to E8, each with computed numbers that prove it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from stiction.display.json_form import Result
from stiction.limitcycle import describing_function
from stiction.models import Stenman
from stiction.models.parameter_sets import table1_reading_a, table1_reading_b
from stiction.paper.eq5 import equation5
from stiction.paper.eqs1to3 import equations1to3, stribeck_friction
from stiction.paper.eqs6to7 import EXAMPLE_D, df_with_single_roots, measure_df
from stiction.paper.fig2 import pressure_ramp, read_ramp

if TYPE_CHECKING:
    from stiction.models import PhysicalValve

__all__ = ["Erratum", "Proof", "errata"]


@dataclass(frozen=True)
class Proof:
    """One number of a proof."""

    quantity: str
    """What was computed, with its unit."""
    form: str
    """Form of the equation, reading of the units, or independent method."""
    value: float | complex | str
    """The number, or the observed behaviour."""


@dataclass(frozen=True)
class Erratum(Result):
    """One erratum."""

    number: str
    """E1 to E8."""
    where: str
    """Equation, table or section of the paper."""
    printed: str
    """What is printed."""
    correct: str
    """What is correct."""
    why: str
    """The reason, in a sentence."""
    proofs: tuple[Proof, ...]
    """The numbers that prove it."""

    def value(self, quantity: str, form: str) -> float | complex | str:
        """One number by its form and the first words of its quantity."""
        return next(p.value for p in self.proofs if p.quantity.startswith(quantity) and p.form == form)

    def summary(self) -> str:
        """Summary in a line."""
        return f"{self.number}, {self.where}: {self.printed} should be {self.correct}."


def errata() -> tuple[Erratum, ...]:
    """Prove the errata of the paper.

    Returns
    -------
    tuple of Erratum
        E1 to E8.

    References
    ----------
    srinivasan2008; the errata are this project's.

    Examples
    --------
    >>> from stiction.paper import errata
    >>> e6 = errata()[5]
    >>> e6.value("stem", "eq. 5, printed"), e6.value("stem", "eq. 5, repaired")
    (1.0, 9.0)
    """
    return (_e1(), _e2(), _e3(), _e4(), _e5(), _e6(), _e7(), _e8())


def _e1() -> Erratum:
    speeds = (0.05, 0.1, 1.0)
    proofs: list[Proof] = []
    for speed in speeds:
        for form in ("printed", "corrected"):
            friction = stribeck_friction(speed, as_printed=form == "printed")
            value = friction if math.isfinite(friction) else "overflows"
            proofs.append(Proof(f"friction at {speed:g} in/s [lbf]", form, value))
    why = "The text says that this term decreases with the speed of the stem; as printed it grows without bound."
    return Erratum("E1", "eq. 3", "exp((v/vs)²)", "exp(-(v/vs)²)", why, tuple(proofs))


def _e2() -> Erratum:
    motion = equations1to3()
    proofs = [Proof("force on the stem at its first rest after a slip [lbf]", "P A - K x", motion.force_at_rest)]
    for quantity, values in (
        ("friction that answers it [lbf]", motion.friction),
        ("starts from rest on the ramp of slope 4 [-]", motion.starts),
        ("longest rest after the first start [s]", motion.longest_rest),
    ):
        proofs += [Proof(quantity, form, float(values[form])) for form in ("printed", "corrected")]
    why = (
        "Friction at rest must balance the force on the stem, spring included. As printed it exceeds that force and "
        "drives the stem, which chatters instead of resting (time step 0.1 ms; the count depends on it)."
    )
    return Erratum("E2", "eq. 2", "Fe = P A", "Fe = P A - K x (- Pv Av)", why, tuple(proofs))


def _e3() -> Erratum:
    valve = Stenman(EXAMPLE_D)
    proofs = (
        Proof("N at A = d [-]", "printed", complex(describing_function(valve, EXAMPLE_D, as_printed=True))),
        Proof("N at A = d [-]", "corrected", complex(describing_function(valve, EXAMPLE_D))),
        Proof("N at A = d [-]", "measured on the valve", complex(measure_df(1.0)[0])),
    )
    why = "The valve of eq. 4, driven by a sine, has the describing function with the square inside."
    return Erratum("E3", "eq. 6", "√((1 - d/2A)²)", "√(1 - (d/2A)²)", why, proofs)


def _e4() -> Erratum:
    valve, far = Stenman(EXAMPLE_D), 1000.0
    roots = describing_function(valve, 2.0 * EXAMPLE_D, as_printed="roots repaired")
    proofs = (
        Proof("N at A = 2d [-]", "printed, E3 mended", complex(roots)),
        Proof("N at A = 2d [-]", "corrected", complex(describing_function(valve, 2.0 * EXAMPLE_D))),
        Proof("N at A = 2d [-]", "measured on the valve", complex(measure_df(2.0)[0])),
        Proof("real part of N at A = 1000 d [-]", "every root once, as printed", df_with_single_roots(far)),
        Proof("real part of N at A = 1000 d [-]", "corrected", float(describing_function(valve, far * EXAMPLE_D).real)),
    )
    why = (
        "The stem passes every level but the outermost on the way up and on the way down, so its root counts twice. If "
        "every root counted once, N would tend to 1/2 for large amplitudes; a valve with small stairs has N = 1."
    )
    return Erratum("E4", "eq. 6, 3d/2 ≤ A < 5d/2", "(2d/πA)(√₁ + √₃)", "(2d/πA)(2√₁ + √₃)", why, proofs)


def _e5() -> Erratum:
    valve, ratio = Stenman(EXAMPLE_D), 1.1
    proofs: list[Proof] = []
    for family, levels in (("half", "levels ±d/2"), ("integer", "levels 0, ±d")):
        n = complex(describing_function(valve, ratio * EXAMPLE_D, family=family))
        proofs += [
            Proof("N at A = 1.1 d [-]", f"{levels}, closed form", n),
            Proof("N at A = 1.1 d [-]", f"{levels}, measured on the valve", complex(measure_df(ratio, family)[0])),
        ]
    why = "The first rest position of the stem fixes the levels: there is one N, and one set of cycles, per position."
    printed, correct = "the describing function", "the describing function of the rest levels ±d/2, ±3d/2, ... only"
    return Erratum("E5", "eqs. 6 and 7", printed, correct, why, tuple(proofs))


def _e6() -> Erratum:
    replies = equation5()
    proofs = [Proof("stem after a step from 0 to 10 % [% of span]", r.model, r.last) for r in replies.replies]
    proofs += [
        Proof("largest difference, printed against repaired [% of span]", r.name, r.difference)
        for r in replies.responses
    ]
    why = "In the sample after a step du and its sign are 0: as printed the stem stays where its jump ended."
    printed, correct = "jump of sj in the direction of Δu", "jump to sb - sj from u, in the direction of u - x"
    return Erratum("E6", "eq. 5", printed, correct, why, tuple(proofs))


def _e7() -> Erratum:
    light = "3.5 lbm/s"
    readings: tuple[tuple[str, PhysicalValve, float], ...] = (
        ("A: 3 lbf s²/in, 3.5 lbf s/in, psi/s", table1_reading_a(**_FREE_RAMP), 1.0),
        ("B: 3 lbm, 3.5 lbf s/in, psi/min", table1_reading_b(**_FREE_RAMP), 60.0),
        ("3 lbm, 3.5 lbf s/in, psi/s", table1_reading_b(**_FREE_RAMP), 1.0),
        ("3 lbm, 3.5 lbm/s, psi/s", table1_reading_b(viscous=light, **_FREE_RAMP), 1.0),
    )
    proofs: list[Proof] = []
    for name, valve, seconds in readings:
        for slope in (4.0, 9.0):
            ramp = read_ramp(*pressure_ramp(valve, slope / seconds))
            text = f"staircase, {ramp['slips']} slips of {ramp['slip']:.4g} in" if ramp["slips"] > 1 else "follow"
            proofs.append(Proof(f"slope {slope:g}", name, text))
    why = "Two readings give stairs at slope 4 and none at slope 9, as in Figs. 2b and 2c; the other two do not."
    printed, correct = "3 lb, 3.5 lb/s, slopes without unit", "explicit units: reading A or B"
    return Erratum("E7", "Table I and Fig. 2", printed, correct, why, tuple(proofs))


def _e8() -> Erratum:
    proofs = tuple(
        Proof("slip at slope 4 in reading A [in]", f"{tolerance} in/s", float(ramp["slip"]))
        for tolerance in ("1e-2", "1e-3", "1e-4")
        for ramp in [read_ramp(*_ramp_with_tolerance(f"{tolerance} in/s"))]
    )
    why = "As a speed in in/s it is plausible, and values near it give the same slips within 1 %."
    return Erratum("E8", "section II", "velocity tolerance 1e-3", "1e-3 in/s", why, proofs)


_FREE_RAMP: dict[str, Any] = {"hold": "linear", "travel": (-math.inf, math.inf)}


def _ramp_with_tolerance(tolerance: str) -> Any:
    return pressure_ramp(table1_reading_a(velocity_tolerance=tolerance, **_FREE_RAMP), 4.0)
