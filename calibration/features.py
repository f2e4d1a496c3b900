"""Everything that a verdict may use of one record, as one row of numbers."""

from __future__ import annotations

import math
from importlib import import_module
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.diagnosis.result import Diagnosis
    from stiction.diagnosis.verdict.findings import Findings
    from stiction.records import LoopRecord

__all__ = ["diagnose_with_findings", "feature_row"]


def diagnose_with_findings(record: LoopRecord) -> tuple[Diagnosis, list[Findings]]:
    """Diagnose a record and keep what was found in it.

    Parameters
    ----------
    record : LoopRecord
        A record with OP and PV.

    Returns
    -------
    tuple of Diagnosis and list of Findings
        The diagnosis; what was found in the whole record, then in each part that was diagnosed by itself.
    """
    module = import_module("stiction.diagnosis.verdict.diagnose")  # the package's attribute is the function
    results: list[Findings] = []
    original = module.findings

    def recording(record: LoopRecord) -> Findings:
        result = original(record)
        results.append(result)
        return result

    module.findings = recording
    try:
        return module.diagnose(record), results
    finally:
        module.findings = original


def feature_row(diagnosis: Diagnosis, results: Sequence[Findings]) -> dict[str, float | str]:
    """Put what was found into one row.

    Parameters
    ----------
    diagnosis : Diagnosis
        The diagnosis.
    results : sequence of Findings
        What was found in the whole record and in its parts.

    Returns
    -------
    dict
        Column -> number; columns that do not apply are missing. Likelihoods are twice their logarithm, natural and
        neither squashed nor clipped; `row_` marks the numbers that the verdict of the package weighs.
    """
    whole = results[0]
    row: dict[str, float | str] = {
        "package_verdict": diagnosis.verdict, "package_probability": diagnosis.probability,
        "samples": len(whole.record), "dt_s": whole.record.dt, "usable": float(whole.quality.usable),
        "swapped": float(whole.swapped), "thinned": float(whole.every),
    }  # fmt: skip
    row |= _signal_columns(whole) | _oscillation_columns(whole) | _controller_columns(whole)
    row |= {f"vote_{one.method}": one.index for one in whole.evidence if one.valid and math.isfinite(one.index)}
    if whole.features is not None:
        row |= {f"row_{name}": value for name, value in whole.features._asdict().items()}
        row |= _valve_columns(whole)
    row |= _part_columns(results)
    return row


def _valve_columns(whole: Findings) -> dict[str, float]:
    """Sizes, intervals, likelihoods and fits of the valve that speaks."""
    from stiction.diagnosis.verdict.windows import windows

    found, swing = whole.found[whole.speaks], _swing(whole.part.op)
    valve, rough = whole.told or found, found.rough or found
    row = {
        "S": valve.S, "J": valve.J, "S_low": valve.S_low, "S_high": valve.S_high, "J_low": valve.J_low,
        "J_high": valve.J_high, "swing": swing, "fit": found.fit, "fit_linear": found.fit_linear,
        "rough_S": rough.S, "rough_J": rough.J, "rough_fit": rough.fit, "rough_fit_linear": rough.fit_linear,
        "likelier_than_play": found.likelier_than_play, "likelier_in_part": found.likelier_in_part,
        "left_out": float(found.left_out) / len(whole.part), "own_samples": float(found.own_samples),
        "rebuilt": float(valve.rebuilt), "S_detectable": found.S_detectable, "lag_s": valve.actuator_lag,
        "gain": found.process.gain, "time_constant_s": found.process.time_constant,
        "dead_time_s": found.process.dead_time, "integrating": float(found.process.integrating),
        "S_bootstrap_low": valve.S_bootstrap[0], "S_bootstrap_high": valve.S_bootstrap[1],
    }  # fmt: skip
    for name, rival in found.rivals.items():
        row |= {f"likelier_{name}": rival.likelier, f"beats_{name}": rival.beats}
    stretches = found.stretches
    row["stretches"] = float(len(stretches))
    if len(stretches) > 1:
        sizes = np.array([one.S for one in stretches])
        row["S_spread"] = float(sizes.std() / max(sizes.mean(), 1e-9))
        row["stretch_gain_min"] = min(one.fit - one.fit_linear for one in stretches)
        row["stretch_gain_max"] = max(one.fit - one.fit_linear for one in stretches)
        row["stretch_likelier"] = max((one.likelier_than_good for one in stretches), default=math.nan)
        shown = windows(whole.part, valve)
        row["sticky_windows"] = float(np.mean([window.verdict == "stiction" for window in shown])) if shown else 0.0
    return row


def _part_columns(results: Sequence[Findings]) -> dict[str, float]:
    """The valve of that part of the record in which stiction is likeliest."""
    parts = [one for one in results[1:] if one.features is not None]
    if not parts:
        return {}
    part = max(parts, key=lambda one: _or_zero(one.found[one.speaks].likelier_than_any))
    found = part.found[part.speaks]
    return {
        "part_likelier_good": found.over("good").likelier, "part_likelier_any": found.likelier_than_any,
        "part_likelier_than_play": found.likelier_than_play, "part_S": found.S, "part_swing": _swing(part.part.op),
        "part_gain": found.fit - found.fit_linear, "part_share": len(part.part) / len(results[0].part),
    }  # fmt: skip


def _signal_columns(whole: Findings) -> dict[str, float]:
    """Noise of OP and PV over their swing, and the share of samples at a limit."""
    part = whole.part
    assert part.pv is not None
    limits = np.mean((part.op <= 0.0) | (part.op >= 100.0))
    return {"op_noise": _noise(part.op), "pv_noise": _noise(part.pv), "at_limit": float(limits)}


def _oscillation_columns(whole: Findings) -> dict[str, float]:
    """The oscillation."""
    one, dt = whole.oscillation, whole.part.dt
    return {
        "oscillating": float(one.oscillating), "period_s": one.period, "regularity": one.regularity,
        "oscillation_share": one.share, "amplitude_op": one.amplitude_op, "periods": len(whole.part) * dt / one.period,
        "samples_per_period": one.period / dt,
    }  # fmt: skip


def _controller_columns(whole: Findings) -> dict[str, float]:
    """The controller."""
    one = whole.controller
    if one is None:
        return {}
    return {
        "Kc": one.Kc, "Ti_s": one.Ti, "controller_explains": one.explained, "controller_exact": float(one.exact),
        "controller_leaves": one.left, "samples_late": float(one.samples_late),
    }  # fmt: skip


def _swing(op: NDArray[np.float64]) -> float:
    """Peak to peak of OP [% of span]."""
    op = op[np.isfinite(op)]
    return float(np.ptp(op)) if op.size else math.nan


def _noise(x: NDArray[np.float64]) -> float:
    """Standard deviation of white noise, by third differences, over the swing [-]."""
    third = np.diff(x[np.isfinite(x)], 3)
    if third.size == 0:
        return math.nan
    sigma = float(np.median(np.abs(third - np.median(third)))) / (0.6745 * math.sqrt(20.0))
    return sigma / max(_swing(x), 1e-12)


def _or_zero(x: float) -> float:
    """The number, 0 for NaN."""
    return x if math.isfinite(x) else 0.0
