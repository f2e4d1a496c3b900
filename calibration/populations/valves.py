"""Sticky valves of every model, with the S and J that are true of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.models import Choudhury, He, HeWang, Kano, Srinivasan, Stenman
from stiction.models.parameter_conversion import convert_bands
from stiction.models.parameter_sets import published_valve
from stiction.models.valves.he_wang import overshoot_factor

if TYPE_CHECKING:
    import numpy as np

    from stiction.models import PhysicalValve, Valve

__all__ = ["MODELS", "PUBLISHED_BODIES", "deadband_valve", "physical_valve", "sticky_valve"]

MODELS = {
    "Kano": 0.4, "Choudhury": 0.12, "He": 0.12, "Srinivasan": 0.1, "Stenman": 0.1, "HeWang": 0.08, "physical": 0.08,
}  # fmt: skip
"""Valve models and how often they come."""
PUBLISHED_BODIES = ("nominal", "graphite_karnopp", "table1_reading_a")
"""Published valves that lend mass, spring and area to the physical ones."""
LEAST_JUMP = 0.1
"""J over S below which a valve has a deadband and does not stick [-]."""


def sticky_valve(rng: np.random.Generator, dt: float, model: str | None = None) -> tuple[Valve, float, float]:
    """Draw a sticky valve: S of 1 to 10 % of span, J of `LEAST_JUMP` S to S; returns the valve, S and J.

    A Stenman valve has J = S. A slip of He and Wang's valve goes K (fs - fd), which is the stick jump sj of its
    stick band fs; so it does in a physical valve, K being the overshoot that its damping ratio gives.
    """
    model = str(rng.choice(list(MODELS), p=list(MODELS.values()))) if model is None else model
    S = float(rng.uniform(1.0, 10.0))
    J = S * float(rng.uniform(LEAST_JUMP, 1.0))
    if model == "Kano":
        return Kano(S, J), S, J
    if model == "Choudhury":
        return Choudhury(S, J), S, J
    if model == "He":
        return He(*convert_bands(S, J, "S, J", "fs, fd")), S, J
    if model == "Srinivasan":
        rate = float(rng.choice([0.0, 0.3 * rng.random() * S / dt]))
        return Srinivasan(*convert_bands(S, J, "S, J", "sb, sj"), rate), S, J
    if model == "Stenman":
        return Stenman(S), S, S
    fs, fd = convert_bands(S, J, "S, J", "fs, fd")
    if model == "HeWang":
        K = float(rng.uniform(1.0, min(2.0, fs / (fs - fd))))
        return HeWang(fs, fd, K), *convert_bands(fs, K * (fs - fd), "sb, sj", "S, J")
    return physical_valve(str(rng.choice(PUBLISHED_BODIES)), fs, fd)


def physical_valve(body: str, fs: float, fd: float) -> tuple[PhysicalValve, float, float]:
    """A published valve with friction bands of its own [% of span]; returns the valve, S and J.

    Its Stribeck velocity is so low that friction has fallen to Coulomb's as soon as the stem moves: with the
    published one a slow stem never gets there, and (S, J) says nothing.
    """
    plain = published_valve(body)
    force = plain.force_span / 100.0
    sj = overshoot_factor(plain.damping_ratio) * (fs - fd)
    if sj > fs:
        fd = fs - (fs - fd) * fs / sj
        sj = fs
    valve = published_valve(
        body, static=fs * force, coulomb=fd * force, stribeck_velocity=2e-4 * plain.stroke,
        velocity_tolerance=2e-5 * plain.stroke, substep=plain.time_constant / 40.0,
    )  # fmt: skip
    return valve, *convert_bands(fs, sj, "sb, sj", "S, J")


def deadband_valve(rng: np.random.Generator) -> tuple[Valve, float, float]:
    """Draw a valve with play: S of 1 to 10 % of span, and J of 0 or less than `LEAST_JUMP` S."""
    S = float(rng.uniform(1.0, 10.0))
    J = S * float(rng.choice([0.0, LEAST_JUMP * rng.random()]))
    made = str(rng.choice(["Kano", "Choudhury", "Srinivasan"], p=[0.5, 0.25, 0.25]))
    if made == "Srinivasan":
        return Srinivasan(*convert_bands(S, J, "S, J", "sb, sj"), 0.0), S, J
    return (Kano if made == "Kano" else Choudhury)(S, J), S, J
