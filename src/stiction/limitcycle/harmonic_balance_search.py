"""Every solution of 1 + L(j omega) N(A) = 0: the limit cycles that the describing function predicts."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import ParameterError
from stiction.limitcycle.describing.staircase import require_families
from stiction.limitcycle.df_branches import DFBranches, branches_of_family, family_names
from stiction.limitcycle.linear import LinearPart
from stiction.limitcycle.nyquist_crossings import find_crossings, frequency_grid, refine_crossing
from stiction.limitcycle.result import LimitCycle
from stiction.models.processes import as_process

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["harmonic_balance"]


def harmonic_balance(
    linear: LinearPart | Any, nonlinearity: Any, families: Iterable[str | float] | None = None
) -> tuple[LimitCycle, ...]:
    """All solutions of 1 + L(j omega) N(A) = 0 and the boundaries at the jumps of N.

    `linear`: the system from the output of the nonlinearity to its input, without the sign of the feedback. `families`:
    families of rest levels, see `describing_function`; by default both symmetric ones of a staircase. Returns by family
    and amplitude, each once. Stability is by Loeb's criterion. Raises ParameterError when the linear part is improper
    or sampled, or a family is unknown.

    The curves are crossed as polylines in the plane of log magnitude and phase, branch by branch, then each
    crossing is refined by Newton's method. At a jump of N from N1 to N2 the segment between them is crossed
    with L: at a crossing the amplitude is a boundary, not a solution.

    Examples
    --------
    >>> import stiction as st
    >>> from stiction.limitcycle import Saturation, harmonic_balance
    >>> cycle, = harmonic_balance(st.TransferFunction([8], [1, 2, 2, 1]), Saturation(1.0))
    >>> round(cycle.amplitude, 5), round(cycle.omega, 5)
    (3.344, 1.41421)
    """
    part = linear if isinstance(linear, LinearPart) else _as_linear_part(linear)
    cycles: list[LimitCycle] = []
    for name in family_names(nonlinearity) if families is None else require_families(families):
        family = branches_of_family(nonlinearity, name)
        cycles += (
            _solve_rate_dependent(part, family) if family.rate_dependent else _solve_rate_independent(part, family)
        )
    return tuple(cycles)


def _solve_rate_independent(linear: LinearPart, family: DFBranches) -> list[LimitCycle]:
    """Solutions and boundaries of one family whose N depends on the amplitude only."""
    branches = family.branches()
    cuts = np.cumsum([a.size for a in branches])[:-1]
    values = np.split(family.evaluate(np.concatenate(branches), None), cuts)
    ends = [(complex(below[-1]), complex(above[0])) for below, above in pairwise(values)]
    share = np.linspace(0.0, 1.0, 17)
    jumps = [
        (share, below + share * (above - below if abs(above - below) > 1e-6 * abs(above) else 0.0))
        for below, above in ends
    ]
    omega = frequency_grid(linear, max(float(np.max(np.abs(n))) for n in values))
    cycles: list[LimitCycle] = []
    curves = [*zip(branches, values, strict=True), *jumps]
    for k, a, w in find_crossings(curves, omega, linear.at(1j * omega)):
        if k < len(branches):
            low, high = branches[k][0], branches[k][-1]
            solved = refine_crossing(lambda x, _w: complex(family.evaluate(x, None)), linear, a, w, low, high)
            if solved is not None and not _is_known(cycles, *solved):
                cycles.append(_make_cycle(linear, family, *solved))
        else:
            jump = k - len(branches)
            cycles += [
                boundary
                for boundary in _find_boundary(linear, family, float(branches[jump + 1][0]), *ends[jump], a, w)
                if not _is_known(cycles, boundary.amplitude, boundary.omega, "boundary")
            ]
    return sorted(cycles, key=lambda cycle: (cycle.amplitude, cycle.period))


def _find_boundary(linear, family, a: float, below: complex, above: complex, share: float, omega: float):
    """The crossing of L with the segment of N at a jump, from a first guess; a list of one or none."""

    def blend(x: float, _w: float) -> complex:
        return below + x * (above - below)

    solved = refine_crossing(blend, linear, share, omega, 0.0, 1.0)
    if solved is None or not 1e-9 < solved[0] < 1.0 - 1e-9:
        return []
    n = blend(*solved)
    drift = -complex(linear.at(1j * solved[1])) * (above - below) / _loop_slope(linear, n, solved[1])
    pv = abs(complex(linear.process_at(1j * solved[1])) * n) * a
    return [
        LimitCycle(
            "describing function", "boundary", family.name, a, 2.0 * math.pi / solved[1], float(pv), float(abs(n) * a),
            (), stable=bool(drift.real < 0.0),
        )
    ]  # fmt: skip


def _solve_rate_dependent(linear: LinearPart, family: DFBranches, points: int = 120) -> list[LimitCycle]:
    """Solutions of a family whose N depends on amplitude and frequency: cells in which both parts change sign."""
    low, high = family.jumps[0], family.largest
    # For a physical valve, with `high` 20 times `low`, each N needs a simulation.
    fine = family.lag >= 0.0 and high > 25.0 * low
    n_a, n_w = (points, points) if fine else (24, 24)
    a = low * (1.0 + np.geomspace(1e-4, high / low - 1.0, n_a))
    omega = frequency_grid(linear, 1.5, n_w)
    if omega.size > 4 * n_w:
        omega = np.interp(np.linspace(0, 1, 4 * n_w), np.linspace(0, 1, omega.size), omega)
    if omega.size < 2:
        return []
    n = family.evaluate(a[:, None], omega[None, :])
    with np.errstate(divide="ignore", invalid="ignore"):
        miss = np.log(-linear.at(1j * omega)[None, :] * n)
    cycles: list[LimitCycle] = []
    for i, j in zip(*_sign_change_cells(miss), strict=True):
        guess = 0.5 * float(a[i] + a[i + 1]), math.sqrt(omega[j] * omega[j + 1])
        solved = refine_crossing(lambda x, w: complex(family.evaluate(x, w)), linear, *guess, float(a[0]), float(a[-1]))
        if solved is not None and not _is_known(cycles, *solved):
            cycles.append(_make_cycle(linear, family, *solved))
    return sorted(cycles, key=lambda cycle: (cycle.amplitude, cycle.period))


def _sign_change_cells(miss: Any) -> tuple[Any, ...]:
    """Grid cells at whose corners real and imaginary part both change sign, phase wraps left out."""
    corners: Any = np.stack([miss[:-1, :-1], miss[1:, :-1], miss[:-1, 1:], miss[1:, 1:]])
    with np.errstate(invalid="ignore"):
        real = (corners.real.min(axis=0) <= 0.05) & (corners.real.max(axis=0) >= -0.05)
        imag = (corners.imag.min(axis=0) <= 0.05) & (corners.imag.max(axis=0) >= -0.05)
        whole = np.ptp(corners.imag, axis=0) < math.pi
    return np.nonzero(real & imag & whole & np.all(np.isfinite(corners), axis=0))


def _make_cycle(linear: LinearPart, family: DFBranches, a: float, omega: float) -> LimitCycle:
    n = complex(family.evaluate(a, omega))
    step = 1e-6 * a
    sides = [x for x in (a - step, a + step) if complex(family.evaluate(x, omega)) != 0.0]
    change = (complex(family.evaluate(sides[-1], omega)) - complex(family.evaluate(sides[0], omega))) / (
        sides[-1] - sides[0] or math.inf
    )
    bend = 0j
    if family.rate_dependent:
        bend = (complex(family.evaluate(a, omega * 1.0001)) - complex(family.evaluate(a, omega * 0.9999))) / (
            0.0002 * omega
        )
    drift = -complex(linear.at(1j * omega)) * change / _loop_slope(linear, n, omega, bend)
    levels = family.levels(a)
    mv = (levels[-1] - levels[0]) / 2.0 if levels else abs(n) * a
    pv = abs(complex(linear.process_at(1j * omega)) * n) * a
    return LimitCycle(
        "describing function", "cycle", family.name, float(a), 2.0 * math.pi / omega, float(pv), float(mv),
        tuple(linear.rest + x for x in levels), stable=bool(drift.real < 0.0),
    )  # fmt: skip


def _loop_slope(linear: LinearPart, n: complex, omega: float, bend: complex = 0j) -> complex:
    """d(L N)/ds at s = j omega; a disturbance in amplitude grows at the rate Re(-L dN/dA / (d(L N)/ds)) (Loeb)."""
    h = 1e-5j * omega
    change = complex(linear.at(1j * omega + h) - linear.at(1j * omega - h)) / (2.0 * h)
    return change * n + complex(linear.at(1j * omega)) * bend / 1j


def _is_known(cycles: list[LimitCycle], a: float, omega: float, kind: str = "cycle") -> bool:
    return any(
        cycle.kind == kind and abs(cycle.amplitude - a) < 1e-6 * a and abs(cycle.omega - omega) < 1e-6 * omega
        for cycle in cycles
    )


def _as_linear_part(system: Any) -> LinearPart:
    """A linear system as the linear part of a loop, its output being the PV."""
    process = as_process(system).state_space()
    if process.D != 0.0 and process.dead_time == 0.0 and process.A.shape[0] == 0:
        raise ParameterError("linear is a constant gain, which cannot oscillate; give a dynamic system.")
    return LinearPart(process.A, process.B, -process.C, -process.D, process.C, process.D, process.dead_time, 0.0)
