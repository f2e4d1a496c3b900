"""The physical valve: mass, spring, diaphragm and friction, eqs. 1 to 3 with their errata E1 and E2 corrected."""
# ruff: noqa: RUF009 - a Quantity is a descriptor, made once for the class

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from stiction.errors import ParameterError, require_positive
from stiction.models.component import TIE_TOLERANCE, Valve
from stiction.models.physical_stem import PhysicalParameters, physical_at_rest, physical_parameters, physical_step
from stiction.models.positioner import Positioner
from stiction.models.quantities import Quantity, to_si

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["PhysicalValve", "physical_at_rest", "physical_parameters", "physical_step"]

SUBSTEPS = {"karnopp": 500.0, "lugre": 2500.0}
"""Sub-steps in the longer of 1 / omega and F_v / K [-]: positions good to 0.1 % of travel."""


@dataclass(frozen=True)
class PhysicalValve(Valve):
    r"""Spring-and-diaphragm valve with friction in its packing.

    .. math::

        m \ddot x + F_v \dot x + K x &= A P - F_0 - P_v A_v - F_f \\
        F(v) &= \left[F_c + (F_s - F_c)\,e^{-(v/v_s)^2}\right] \operatorname{sgn} v

    The stem rests while the force on it, spring included, is at most the static friction. Every quantity is an SI
    number, or text with a unit such as "300 lbf/in"; a bare "lb" raises an error, because it can be a mass or a force.

    Parameters
    ----------
    mass : float or str
        Mass of stem and plug, m [kg].
    spring_rate : float or str
        Spring rate, K [N/m].
    viscous : float or str
        Viscous coefficient, F_v (b in the paper) [N s/m].
    coulomb, static : float or str
        Coulomb friction F_c and static friction F_s [N].
    stribeck_velocity : float or str
        Stribeck velocity, v_s [m/s].
    area : float or str
        Effective diaphragm area, A [m2].
    stroke : float or str
        Stem travel from 0 to 100 % [m].
    friction : str
        "karnopp" or "lugre".
    pressure_range : tuple of float or str, optional
        Pressures that are 0 and 100 % OP (100 and 0 % where air closes) [Pa]; by default from 0 to the pressure that
        moves the stem over its stroke, K stroke / A.
    preload : float or str, optional
        Force of the spring where it is least compressed, F_0 [N]; by default it puts the stem at 0 % for 0 % OP.
    fluid_force : float or str
        Force of the fluid against the air, P_v A_v [N].
    air_to_open : bool
        Whether air opens the valve. If air closes the valve, the OP is still the opening.
    lag : float or str
        Time constant of I/P converter and actuator [s].
    positioner : Positioner, optional
        Positioner on the stem position.
    velocity_tolerance : float or str, optional
        Karnopp's tolerance: the speed below which static friction can stop the stem [m/s]; by default a
        thousandth of the Stribeck velocity.
    bristle_stiffness : float or str, optional
        LuGre's sigma_0 [N/m]; by default static friction bends the bristles by 1e-4 of the stroke.
    bristle_damping : float or str, optional
        LuGre's sigma_1 [N s/m]; by default 2 sqrt(sigma_0 m), critical damping of the mass on its bristles.
    hold : str
        "zero": the input is held through the sample and the position is taken at the end of the sample, as with a DCS.
        "linear": the input moves in a straight line from the last sample to this one, as in a ramp test.
    substep : float, optional
        Sub-step within a sample [s]; by default 1/500 (LuGre: 1/2500) of the longer of 1/omega and
        F_v / K.

    Raises
    ------
    ParameterError
        When a quantity is outside its limits or its unit is missing, wrong or ambiguous, or when static friction
        is below Coulomb friction.

    Notes
    -----
    The end stops are `travel`, 0 and 100 % by default, and the signal to the actuator keeps to 0 and 100 % on the
    side that has a stop. Write ``travel=(-inf, inf)`` for a loop in deviations. In a held sample a fast stem comes
    to rest before the next one, so that with a slow DCS and no `lag` any ramp gives stairs.

    References
    ----------
    srinivasan2008, eqs. 1-3 with E1 and E2; karnopp1985; canudas1995.

    Examples
    --------
    >>> import stiction as st
    >>> valve = st.PhysicalValve("3 lbm", "300 lbf/in", "3.5 lbf*s/in", "320 lbf", "384 lbf", "0.01 in/s",
    ...                          "100 in**2", "6 in")
    >>> round(valve.damping_ratio, 3)
    1.146
    >>> st.stroke(valve, [0.0, 20.0, 22.0], dt=1.0).mv.round(2).tolist()
    [0.0, 0.0, 4.22]
    """

    code: ClassVar[int] = 10

    mass: Quantity = Quantity("kg")
    spring_rate: Quantity = Quantity("N/m")
    viscous: Quantity = Quantity("N*s/m", zero=True)
    coulomb: Quantity = Quantity("N", zero=True)
    static: Quantity = Quantity("N", zero=True)
    stribeck_velocity: Quantity = Quantity("m/s")
    area: Quantity = Quantity("m**2")
    stroke: Quantity = Quantity("m")
    friction: str = "karnopp"
    _: KW_ONLY
    travel: tuple[float, float] = (0.0, 100.0)
    pressure_range: tuple[float | str, float | str] | None = None
    preload: float | str | None = None
    fluid_force: Quantity = Quantity("N", 0.0, negative=True)
    air_to_open: bool = True
    lag: Quantity = Quantity("s", 0.0, zero=True)
    positioner: Positioner | None = None
    velocity_tolerance: float | str | None = None
    bristle_stiffness: float | str | None = None
    bristle_damping: float | str | None = None
    hold: str = "zero"
    substep: float | str | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.static < self.coulomb:
            raise ParameterError(
                f"static = {self.static:g} N is below coulomb = {self.coulomb:g} N; static friction is at least "
                "Coulomb friction."
            )
        for name, choices in (("friction", ("karnopp", "lugre")), ("hold", ("zero", "linear"))):
            if getattr(self, name) not in choices:
                raise ParameterError(
                    f"{name} = {getattr(self, name)!r} is unknown; use {' or '.join(map(repr, choices))}."
                )
        if self.friction == "lugre" and self.coulomb == 0.0:
            raise ParameterError("coulomb = 0 N is too small for LuGre friction; give a value above 0.")
        for name, unit in _OPTIONAL.items():
            if getattr(self, name) is not None:
                number = to_si(name, getattr(self, name), unit)
                object.__setattr__(self, name, number if name == "preload" else require_positive(name, number, unit))
        object.__setattr__(self, "pressure_range", self._read_pressures())

    def _pressures(self) -> tuple[float, float]:
        """Pressures at the ends of the OP, read when the valve was made [Pa]."""
        return self.pressure_range  # type: ignore[return-value]

    def _read_pressures(self) -> tuple[float, float]:
        if self.pressure_range is None:
            return (0.0, self.spring_rate * self.stroke / self.area)
        try:
            low, high = self.pressure_range
        except (TypeError, ValueError):
            raise ParameterError(
                f"pressure_range = {self.pressure_range!r} is not a pair; give the pressures (lowest, highest)."
            ) from None
        low, high = (to_si("pressure_range", end, "Pa") for end in (low, high))
        if not low < high:
            raise ParameterError(f"pressure_range = ({low:g}, {high:g}) Pa is an empty range; give lowest < highest.")
        return (low, high)

    @property
    def force_span(self) -> float:
        """Force of the diaphragm over the full span of the OP, A dP [N]."""
        low, high = self._pressures()
        return self.area * (high - low)

    @property
    def gain(self) -> float:
        """Steady travel per OP, A dP / (K stroke) [-]."""
        return self.force_span / (self.spring_rate * self.stroke)

    @property
    def offset(self) -> float:
        """OP at which the stem is about to leave 0 % of travel, friction aside [% of span]."""
        return -100.0 * self._rest_force() / self.force_span

    @property
    def damping_ratio(self) -> float:
        """Damping ratio of mass, spring and viscous friction, F_v / (2 sqrt(K m)) [-]."""
        return self.viscous / (2.0 * math.sqrt(self.spring_rate * self.mass))

    @property
    def natural_frequency(self) -> float:
        """Angular frequency of mass and spring without damping, sqrt(K / m) [rad/s]."""
        return math.sqrt(self.spring_rate / self.mass)

    @property
    def time_constant(self) -> float:
        """Time constant of the stem: the longer of 1 / omega and F_v / K [s]."""
        return max(1.0 / self.natural_frequency, self.viscous / self.spring_rate)

    def _rest_force(self) -> float:
        """Force in the direction of opening with the air at 0 % OP and the stem at 0 % of travel [N]."""
        if self.preload is None:
            return 0.0
        low, high = self._pressures()
        preload = float(self.preload)
        if self.air_to_open:
            return self.area * low - preload - self.fluid_force
        return self.spring_rate * self.stroke + preload + self.fluid_force - self.area * high

    def _bristles(self) -> tuple[float, float]:
        """Stiffness [N/m] and damping [N s/m] of the bristles."""
        stiffness, damping = self.bristle_stiffness, self.bristle_damping
        stiffness = 1e4 * max(self.static, self.coulomb) / self.stroke if stiffness is None else float(stiffness)
        damping = 2.0 * math.sqrt(stiffness * self.mass) if damping is None else float(damping)
        return stiffness, damping

    def parameters(self, dt: float) -> tuple[float, ...]:
        """`PhysicalParameters` for the sampling period `dt` [s]."""
        longest = self.time_constant / SUBSTEPS[self.friction] if self.substep is None else float(self.substep)
        n = max(1.0, math.ceil(dt / longest * (1.0 - 1e-9)))
        h = dt / n
        low, high = self._pressures()
        bottom, top = self.travel
        area = self.area if self.air_to_open else -self.area
        pressure, per_percent = (low, 0.01 * (high - low)) if self.air_to_open else (high, -0.01 * (high - low))
        stiffness, damping = self._bristles() if self.friction == "lugre" else (1.0, 0.0)
        tolerance = 1e-3 * self.stribeck_velocity if self.velocity_tolerance is None else float(self.velocity_tolerance)
        keep, keep_sample = (math.exp(-t / self.lag) if self.lag else 0.0 for t in (h, dt))
        positioner = self.positioner or Positioner(0.0)
        return tuple(
            PhysicalParameters(
                lugre=float(self.friction == "lugre"),
                ramped=float(self.hold == "linear"),
                n=n,
                h=h,
                keep=keep,
                keep_sample=keep_sample,
                keep_mean=(1.0 - keep_sample) * self.lag / dt,
                mass=self.mass,
                spring_rate=self.spring_rate,
                viscous=self.viscous,
                coulomb=self.coulomb,
                static=self.static * (1.0 + TIE_TOLERANCE),
                per_velocity=1.0 / self.stribeck_velocity,
                ease=1.0 / (self.mass + h * self.viscous),
                tolerance=tolerance,
                stiffness=stiffness,
                damping=damping,
                scale=0.01 * self.stroke,
                bottom=0.01 * self.stroke * bottom,
                top=0.01 * self.stroke * top,
                rest_force=self._rest_force() - area * pressure,
                area=area,
                pressure=pressure,
                per_percent=per_percent,
                low=0.0 if math.isfinite(bottom) else -math.inf,
                high=100.0 if math.isfinite(top) else math.inf,
                gain=positioner.gain,
                per_second=1.0 / positioner.integral_time,
                deadband=positioner.deadband,
            )
        )

    def pack(self, dt: float) -> NDArray[np.float64]:
        """Parameters as the kernels take them; the step itself applies the end stops, shape (31,)."""
        return np.array([-math.inf, math.inf, *self.parameters(dt)], dtype=np.float64)


_OPTIONAL = {
    "preload": "N",
    "velocity_tolerance": "m/s",
    "bristle_stiffness": "N/m",
    "bristle_damping": "N*s/m",
    "substep": "s",
}
