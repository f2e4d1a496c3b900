"""Loops whose valve sticks, each of a kind in which that is hard to see.

By default S is 1 to 6 % and J at least half of it, a kick makes the stem slip first, and the noise of the PV is at most
a twentieth of S. All times are in samples.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from adverse_draws import (
    Adverse,
    Kinds,
    by_historian,
    driven,
    fast_process,
    kicked,
    lagged,
    lagged_process,
    length,
    level,
    log_uniform,
    noise,
    plain,
    recorded,
    steps,
    sticking,
    tuned,
    wave,
    white,
)
from adverse_plant import Controller, Process, Signals, Transmitter, Valve, run

STICKY = Kinds()
"""Kinds by name; `add` takes a function of a random generator in."""


@STICKY.add
def st_units(rng) -> Adverse:
    """A plain sticky valve, recorded in any unit and at any sampling period: nothing may depend on either."""
    n, pi, process = plain(rng, 400.0, 6000.0)
    valve = sticking(rng, 0.5, 8.0, 0.3)
    dt, scale = log_uniform(rng, 0.1, 300.0), 10.0 ** rng.uniform(-6.0, 6.0)
    load = kicked(rng, n, valve.S)
    signals = run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.0, 0.05, valve.S))
    return recorded(signals, valve, dt=dt, scale=scale)


@STICKY.add
def st_asym(rng) -> Adverse:
    """Less friction on the way down than up: no single S and J explain both halves of a period."""
    n, pi, process = plain(rng, 800.0, 4000.0)
    S, down = rng.uniform(2.0, 6.0), rng.uniform(0.3, 0.8)
    valve = Valve(S, S * rng.uniform(0.4, 1.0), down=down)
    load = kicked(rng, n, S)
    return recorded(run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.0, 0.05, S)), valve)


@STICKY.add
def st_posdep(rng) -> Adverse:
    """Friction that grows with the stem's position, over which a slow load moves it: no single S holds throughout."""
    n, pi, process = plain(rng, 800.0, 4000.0)
    valve = sticking(rng, 2.0, 5.0, 0.4)
    valve = replace(valve, slope=rng.uniform(1.0, 3.0))
    load = kicked(rng, n, valve.S) + 8.0 * wave("sine", n, n / 3.0)
    return recorded(run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.0, 0.05, valve.S)), valve)


@STICKY.add
def st_irregular(rng) -> Adverse:
    """Friction that is another one whenever the stem stops, by a tenth to a third: no two slips are alike."""
    n, pi, process = plain(rng, 800.0, 4000.0)
    valve = sticking(rng)
    friction = np.clip(1.0 + rng.uniform(0.1, 0.35) * rng.normal(size=n), 0.2, 2.5)
    load, noises = kicked(rng, n, valve.S), noise(rng, n, 0.0, 0.05, valve.S)
    return recorded(run(n, pi, process, valve, friction=friction, load=load, noise=noises), valve)


@STICKY.add
def st_eqpct(rng) -> Adverse:
    """A sticky valve with an equal percentage trim: its jumps differ in the PV."""
    n, pi, process = plain(rng, 800.0, 4000.0)
    valve = replace(sticking(rng, least_jump=0.4), trim="equal percentage", number=50.0)
    op_start, load = rng.uniform(40.0, 75.0), kicked(rng, n, valve.S)
    error = noise(rng, n, 0.0, 0.05, valve.S)
    return recorded(run(n, pi, process, valve, op_start=op_start, load=load, noise=error), valve)


@STICKY.add
def st_level(rng) -> Adverse:
    """A level: its process hides the jumps, which are mere corners of the PV."""
    n, valve = length(rng, 1000.0, 5000.0), sticking(rng, least_jump=0.3)
    process = level(rng.uniform(0.0, 5.0), rng.uniform(1.0, 5.0))
    pi, load = Controller(rng.uniform(1.0, 4.0), rng.uniform(50.0, 200.0)), kicked(rng, n, valve.S)
    signals = run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.0, 0.05, valve.S))
    return recorded(signals, valve, loop_type="level")


@STICKY.add
def st_level_sine(rng) -> Adverse:
    """A level driven by a wave, which sets the period: the valve only bends what would oscillate without it."""
    n, valve = length(rng, 1000.0, 5000.0), sticking(rng, least_jump=0.4)
    pi = Controller(rng.uniform(1.0, 4.0), rng.uniform(200.0, 600.0))
    load = driven(rng, n, (0.5, 2.0), ["sine", "tri"], (100.0, 300.0), valve.S)
    signals = run(n, pi, level(1.0, 2.0, 0.01), valve, load=load, noise=noise(rng, n, 0.0, 0.02, valve.S))
    return recorded(signals, valve, loop_type="level")


@STICKY.add
def st_slave(rng) -> Adverse:
    """A slave whose noisy set point keeps moving it: there is no limit cycle to go by."""
    n, process = length(rng, 800.0, 4000.0), fast_process(rng)
    pi, valve = tuned(rng, process), sticking(rng, 1.0, 5.0, 0.4)
    size = rng.uniform(0.5, 2.0) * valve.S
    sp = size * lagged(rng, n, rng.uniform(20.0, 100.0)) + noise(rng, n, 0.0, 0.1, valve.S)
    return recorded(run(n, pi, process, valve, sp=sp, noise=noise(rng, n, 0.01, 0.1, valve.S)), valve)


@STICKY.add
def st_ponly(rng) -> Adverse:
    """A proportional controller, with which no valve cycles by itself; a wave from outside moves the loop."""
    n, process = length(rng, 800.0, 4000.0), lagged_process(rng)
    valve, p = sticking(rng, 1.0, 5.0, 0.4), Controller(rng.uniform(1.0, 2.5), math.inf)
    load = driven(rng, n, (1.0, 3.0), ["sine", "tri", "saw"], (60.0, 200.0), valve.S)
    return recorded(run(n, p, process, valve, load=load, noise=noise(rng, n, 0.0, 0.05, valve.S)), valve)


@STICKY.add
def st_slow(rng) -> Adverse:
    """A slow actuator: what should be a jump is a ramp of 3 to 15 samples."""
    n, pi, process = plain(rng, 800.0, 4000.0)
    valve = sticking(rng, 2.0)
    valve = replace(valve, rate=valve.J / rng.uniform(3.0, 15.0))
    load = kicked(rng, n, valve.S)
    return recorded(run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.0, 0.05, valve.S)), valve)


@STICKY.add
def st_mid(rng) -> Adverse:
    """A valve that begins to stick within the record, which is cut there and goes on from rest at the OP reached."""
    n, pi, process = plain(rng, 1500.0, 5000.0)
    valve, first = sticking(rng, 2.0), int(n * rng.uniform(0.3, 0.6))
    error, load = noise(rng, n, 0.005, 0.05, valve.S), 0.3 * lagged(rng, n, 30.0)
    before = run(first, pi, process, load=load[:first], noise=error[:first])
    load[first : first + 30] += valve.S
    after = run(n - first, pi, process, valve, load=load[first:], noise=error[first:])
    shift = before.op[-1] - after.op[0]
    after = after._replace(op=after.op + shift, mv=after.mv + shift)
    return recorded(Signals(*map(np.concatenate, zip(before, after, strict=True))), valve)


@STICKY.add
def st_delay(rng) -> Adverse:
    """Mostly dead time: the loop answers late, in shapes that dead time alone gives as well."""
    n, dead_time = length(rng, 800.0, 4000.0), rng.uniform(10.0, 40.0)
    valve, tau = sticking(rng, least_jump=0.3), rng.uniform(1.0, 8.0)
    pi = Controller(0.3, 0.3 * dead_time / rng.uniform(0.4, 0.8))
    process, load = Process(tau, dead_time), kicked(rng, n, valve.S)
    return recorded(run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.0, 0.05, valve.S)), valve)


@STICKY.add
def st_gap(rng) -> Adverse:
    """A controller with a gap, in which the loop rests although the stem is stuck."""
    n, pi, process = plain(rng, 800.0, 4000.0)
    valve = sticking(rng)
    pi = replace(pi, gap=valve.S * rng.uniform(0.1, 0.4))
    load = kicked(rng, n, valve.S) + valve.S * lagged(rng, n, 60.0)
    return recorded(run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.0, 0.05, valve.S)), valve)


@STICKY.add
def st_ext(rng) -> Adverse:
    """A wave from outside sets the period, and the valve bends it: both are to blame."""
    n, pi, process = plain(rng, 800.0, 4000.0)
    valve = sticking(rng)
    load = driven(rng, n, (0.5, 3.0), ["sine", "square", "saw"], (40.0, 200.0), valve.S)
    return recorded(run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.0, 0.05, valve.S)), valve)


@STICKY.add
def st_spsq(rng) -> Adverse:
    """A set point that goes to and fro: its steps, not the valve, make most of what OP and PV do."""
    n, pi, process = plain(rng, 800.0, 4000.0)
    valve = sticking(rng)
    sp = driven(rng, n, (0.5, 4.0), ["square"], (100.0, 500.0), valve.S)
    return recorded(run(n, pi, process, valve, sp=sp, noise=noise(rng, n, 0.0, 0.05, valve.S)), valve)


@STICKY.add
def st_quant(rng) -> Adverse:
    """A PV in steps of up to a third of the jump: it stands still where the stem does and where it creeps."""
    n, pi, process = plain(rng, 800.0, 4000.0)
    valve = sticking(rng)
    transmitter = Transmitter(step=valve.J * rng.uniform(0.05, 0.3))
    load = kicked(rng, n, valve.S)
    error = noise(rng, n, 0.0, 0.03, valve.S)
    return recorded(run(n, pi, process, valve, transmitter, load=load, noise=error), valve)


@STICKY.add
def st_noisy(rng) -> Adverse:
    """Noise of a tenth to half of S, which keeps the OP turning, and at times a filter before the controller."""
    n, pi, process = plain(rng, 1000.0, 6000.0)
    valve = sticking(rng)
    load = kicked(rng, n, valve.S)
    size, lag = valve.S * rng.uniform(0.1, 0.5), rng.choice([0.0, 5.0])
    return recorded(run(n, replace(pi, lag=lag), process, valve, load=load, noise=white(rng, n, size)), valve)


@STICKY.add
def st_sqrt(rng) -> Adverse:
    """A flow seen through the square root of a head, and a filter before the controller."""
    n, pi, process = plain(rng, 800.0, 4000.0)
    valve = sticking(rng)
    pi, load = replace(pi, lag=rng.uniform(1.0, 8.0)), kicked(rng, n, valve.S)
    error = noise(rng, n, 0.0, 0.05, valve.S)
    return recorded(run(n, pi, process, valve, Transmitter("head", 15.0), load=load, noise=error), valve)


@STICKY.add
def st_drift(rng) -> Adverse:
    """A transmitter that drifts and wanders takes the stem along: the cycle has a slope."""
    n, pi, process = plain(rng, 800.0, 4000.0)
    valve = sticking(rng)
    sensor = np.linspace(0.0, rng.uniform(-30.0, 30.0), n) + np.cumsum(rng.normal(0.0, 0.02 * valve.S, n))
    return recorded(run(n, pi, process, valve, drift=sensor, noise=noise(rng, n, 0.0, 0.05, valve.S)), valve)


@STICKY.add
def st_hist(rng) -> Adverse:
    """A slow loop as a slow historian keeps it, in means or in samples: of a jump only one row is left."""
    every = int(rng.choice([5, 10]))
    n, tau = length(rng, 500.0, 2000.0) * every, rng.uniform(20.0, 80.0)
    process = Process(tau, tau * rng.uniform(0.2, 0.8))
    pi, valve = tuned(rng, process), sticking(rng)
    load = kicked(rng, n, valve.S)
    signals = run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.01, 0.05, valve.S))
    return recorded(by_historian(rng, signals, every), valve, dt=float(every))


@STICKY.add
def st_rest(rng) -> Adverse:
    """Stenman's valve, which never follows the OP but jumps to it, and a wave from outside."""
    n, pi, process = plain(rng, 800.0, 4000.0)
    S = rng.uniform(1.0, 6.0)
    valve, load = Valve(S, S, rests=True), kicked(rng, n, S)
    load += driven(rng, n, (0.2, 2.0), ["sine"], (60.0, 300.0), S)
    return recorded(run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.0, 0.05, S)), valve)


@STICKY.add
def st_smallJ(rng) -> Adverse:
    """A jump of a tenth to a quarter of S: all but play, and a load that hides the rest."""
    n, pi, process = plain(rng, 800.0, 4000.0)
    valve = sticking(rng, 2.0, 8.0, 0.1, 0.25)
    load = kicked(rng, n, valve.S)
    load += rng.uniform(0.2, 1.0) * valve.S * lagged(rng, n, 80.0)
    return recorded(run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.0, 0.1, valve.J)), valve)


@STICKY.add
def st_round(rng) -> Adverse:
    """The OP goes in steps, which give the loop a second reason to cycle."""
    n, pi, process = plain(rng, 800.0, 4000.0)
    valve = sticking(rng)
    pi, load = replace(pi, step=rng.choice([0.1, 0.2, 0.5])), kicked(rng, n, valve.S)
    return recorded(run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.0, 0.05, valve.S)), valve)


@STICKY.add
def st_batch(rng) -> Adverse:
    """Large steps of the set point every 150 samples: next to the OP's swing the band is small."""
    n, pi, process = plain(rng, 800.0, 4000.0)
    valve, sp = sticking(rng), steps(rng, n, 10.0, 150)
    return recorded(run(n, pi, process, valve, sp=sp, noise=noise(rng, n, 0.0, 0.05, valve.S)), valve)


@STICKY.add
def st_long(rng) -> Adverse:
    """A record of many thousand samples, in which small doubts add up."""
    n, process = int(rng.choice([12000, 20000])), lagged_process(rng)
    pi, valve = tuned(rng, process), sticking(rng)
    load = kicked(rng, n, valve.S)
    return recorded(run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.01, 0.1, valve.S)), valve)
