"""A slow, obvious twin of the physical valve: closed form while it sticks, an adaptive solver while it slips."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp


def ramp(valve, rate, duration):
    """Times and positions [m] of every stop on a ramp from 0 %, at `rate` [% of span / s], by events alone."""
    per_second = 0.01 * valve.force_span * rate
    excess = valve.static - valve.coulomb
    t, x, stops = 0.0, 0.0, []
    while True:
        t += max(0.0, (valve.static - (per_second * t - valve.spring_rate * x)) / per_second)
        if t >= duration:
            return stops, x

        def slide(time, state):
            position, v = state
            friction = valve.coulomb + excess * math.exp(-((v / valve.stribeck_velocity) ** 2))
            force = per_second * time - valve.spring_rate * position - valve.viscous * v - friction
            return [v, force / valve.mass]

        def stop(time, state):
            return state[1]

        stop.terminal, stop.direction = True, -1
        # A hair of speed starts the slide: at the break itself the forces balance.
        found = solve_ivp(slide, (t, duration), [x, 1e-9], "LSODA", events=stop, rtol=1e-9, atol=1e-12)
        t, x = found.t[-1], found.y[0, -1]
        if t >= duration or not found.t_events[0].size:
            return stops, x
        stops.append((t, x))


def energy(valve, x, v):
    """Kinetic energy and that of the spring about its balance without air [J], arrays of shape (n_samples,)."""
    return 0.5 * valve.mass * np.square(v) + 0.5 * valve.spring_rate * np.square(x)
