"""Loops whose valve is good or only plays, each of a kind that could pass for a sticky one.

`_ext` stands for an oscillation from outside, which is the commonest reason for a good valve to be suspected: then the
controller answers with a shape that a sticky valve could make as well. All times are in samples.
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
    hunting,
    kick,
    lagged,
    lagged_process,
    length,
    level,
    log_uniform,
    noise,
    plain,
    pump,
    recorded,
    steps,
    sticking,
    tightened,
    tuned,
    wave,
    white,
)
from adverse_plant import MIDDLE, Controller, Process, Transmitter, Valve, run

GOOD = Kinds()
"""Kinds by name; `add` takes a function of a random generator in."""


@GOOD.add
def eqpct_ext(rng) -> Adverse:
    """A wave from outside on an equal percentage trim: its gain differs over the swing, which bends the wave."""
    n, pi, process = plain(rng)
    period, op_start = rng.uniform(20.0, 120.0), rng.uniform(35.0, 65.0)
    trim = Valve(trim="equal percentage", number=50.0)
    load = rng.uniform(3.0, 12.0) * wave(rng.choice(["sine", "tri", "square", "saw"]), n, period)
    return recorded(run(n, pi, process, trim, op_start=op_start, load=load, noise=noise(rng, n, 0.0, 0.3)))


@GOOD.add
def ph_cycle(rng) -> Adverse:
    """A pH loop tuned too tight: it cycles on the steep middle of the titration curve, and the PV's tops are flat."""
    n, pi, process = plain(rng)
    pi = tightened(pi, rng.uniform(1.8, 4.0))
    load = kick(n, 10, 5.0) + 0.3 * lagged(rng, n, 50.0)
    curve = Transmitter("titration", rng.uniform(1.0, 5.0))
    return recorded(run(n, pi, process, None, curve, load=load, noise=noise(rng, n, 0.0, 0.05)))


@GOOD.add
def sqrt_flow(rng) -> Adverse:
    """A pump that goes on and off, seen through the square root of a head: up and down have different slopes."""
    n, pi, process = plain(rng)
    load = rng.uniform(3.0, 10.0) * pump(rng, n, rng.uniform(30.0, 150.0))
    return recorded(run(n, pi, process, None, Transmitter("head", 20.0), load=load, noise=noise(rng, n, 0.05, 0.3)))


@GOOD.add
def split_gain(rng) -> Adverse:
    """Split range with two gains that meet where the loop works: each period has a kink."""
    n, pi, process = plain(rng)
    pi = tightened(pi, rng.uniform(0.8, 2.0))
    trim = Valve(trim="split range", number=rng.uniform(1.5, 4.0))
    load = driven(rng, n, (2.0, 8.0), ["sine"], (40.0, 150.0)) + lagged(rng, n, 20.0)
    return recorded(run(n, pi, process, trim, load=load, noise=white(rng, n, 0.1)))


@GOOD.add
def split_gap(rng) -> Adverse:
    """Split range with a gap in which neither valve is open: the OP crosses it without effect, as a deadband."""
    n, pi, process = plain(rng)
    trim = Valve(trim="split gap", number=rng.uniform(1.0, 4.0))
    load = rng.uniform(0.5, 3.0) * lagged(rng, n, 60.0)
    return recorded(run(n, pi, process, trim, load=load, noise=noise(rng, n, 0.0, 0.1)))


@GOOD.add
def gap_ctrl(rng) -> Adverse:
    """A level whose controller rests within a gap: the OP stands still and the PV runs on, as with a stuck stem."""
    n, gap = length(rng), rng.uniform(1.0, 4.0)
    pi = Controller(rng.uniform(1.0, 3.0), rng.choice([math.inf, 100.0, 300.0]), gap=gap)
    load = driven(rng, n, (3.0, 10.0), ["sine", "saw", "square"], (100.0, 300.0)) + 2.0 * lagged(rng, n, 50.0)
    return recorded(run(n, pi, level(2.0, 3.0), load=load, noise=noise(rng, n, 0.0, 0.2)), loop_type="level")


@GOOD.add
def err_sq(rng) -> Adverse:
    """A level whose controller squares the error: it all but rests near the set point and turns sharply far from it."""
    n = length(rng)
    pi = Controller(rng.uniform(1.0, 4.0), rng.uniform(100.0, 400.0), square=rng.uniform(3.0, 10.0))
    load = driven(rng, n, (3.0, 10.0), ["sine", "saw", "square"], (100.0, 300.0)) + lagged(rng, n, 50.0)
    return recorded(run(n, pi, level(2.0, 3.0), load=load, noise=noise(rng, n, 0.0, 0.1)), loop_type="level")


@GOOD.add
def filt_ext(rng) -> Adverse:
    """A wave from outside and a filter before the controller: no PI controller explains the OP by the recorded PV."""
    n, pi, process = plain(rng)
    pi = replace(pi, lag=rng.uniform(5.0, 30.0))
    load = driven(rng, n, (2.0, 8.0), ["square", "tri", "saw"], (60.0, 200.0))
    return recorded(run(n, pi, process, load=load, noise=noise(rng, n, 0.1, 1.0)))


@GOOD.add
def avg_level(rng) -> Adverse:
    """A slow level above a pump that goes on and off: the PV is a triangle, as with a sticky valve on a level."""
    n, pi = length(rng), Controller(rng.uniform(0.5, 2.0), rng.uniform(500.0, 2000.0))
    load = rng.uniform(5.0, 20.0) * pump(rng, n, rng.uniform(40.0, 300.0))
    return recorded(run(n, pi, level(1.0, 2.0, 0.01), load=load, noise=noise(rng, n, 0.0, 0.2)), loop_type="level")


@GOOD.add
def slave_good(rng) -> Adverse:
    """A slave whose set point wanders and is noisy: it never rests, and what moves it is not a wave."""
    n, process = length(rng), fast_process(rng)
    pi = tuned(rng, process)
    sp = rng.uniform(1.0, 5.0) * lagged(rng, n, rng.uniform(20.0, 100.0)) + noise(rng, n, 0.0, 0.5)
    return recorded(run(n, pi, process, sp=sp, noise=noise(rng, n, 0.1, 0.5)))


@GOOD.add
def slave_cyc(rng) -> Adverse:
    """A slave whose set point cycles, in steps where the master is slower: the oscillation is the master's."""
    n, process = length(rng), fast_process(rng)
    pi = tuned(rng, process)
    period = rng.uniform(30.0, 150.0)
    sp = rng.uniform(1.0, 5.0) * wave(rng.choice(["sine", "tri", "saw", "square"]), n, period)
    hold = int(rng.integers(1, 10))
    sp = np.repeat(sp[::hold], hold)[:n]
    load = rng.uniform(0.0, 0.5) * lagged(rng, n, 10.0)
    return recorded(run(n, pi, process, sp=sp, load=load, noise=noise(rng, n, 0.02, 0.3)))


@GOOD.add
def ponly_ext(rng) -> Adverse:
    """A wave from outside on a proportional controller: OP and PV have the same shape, and no phase between them."""
    n, process = length(rng), lagged_process(rng)
    p = Controller(rng.uniform(0.5, 2.0), math.inf)
    load = driven(rng, n, (2.0, 8.0), ["saw", "tri", "square", "sine", "onoff"], (30.0, 200.0))
    return recorded(run(n, p, process, load=load, noise=noise(rng, n, 0.0, 0.2)))


@GOOD.add
def op_round(rng) -> Adverse:
    """The OP goes in steps: the loop cycles from one to the next with nothing wrong with the valve."""
    n, step, integrating = length(rng), rng.choice([0.2, 0.5, 1.0]), rng.random() < 0.5
    if integrating:
        process = level(2.0, 3.0)
        pi = Controller(rng.uniform(1.0, 4.0), rng.uniform(60.0, 200.0))
        load, most = rng.uniform(0.0, 1.0) * lagged(rng, n, 100.0), 0.05
    else:
        process = lagged_process(rng)
        pi = tuned(rng, process)
        load, most = rng.uniform(0.3, 3.0) * lagged(rng, n, 50.0), 0.1
    return recorded(run(n, replace(pi, step=step), process, load=load, noise=noise(rng, n, 0.0, most)))


@GOOD.add
def valve_res(rng) -> Adverse:
    """A stem that goes in steps, the same ones up and down: it jumps, yet it has no deadband."""
    n, pi, process = plain(rng)
    valve = Valve(step=rng.choice([0.5, 1.0, 2.0]))
    load = rng.uniform(0.3, 3.0) * lagged(rng, n, 50.0)
    return recorded(run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.0, 0.1)))


@GOOD.add
def posit_hunt(rng) -> Adverse:
    """A positioner hunts about the OP: the stem itself cycles, in triangles, and the loop only answers."""
    n, tau = length(rng), rng.uniform(2.0, 15.0)
    process = Process(tau, rng.uniform(0.5, 5.0))
    pi = tuned(rng, process)
    load = hunting(rng, n, rng.uniform(8.0, 60.0), rng.uniform(0.5, 3.0))
    load += rng.uniform(0.0, 2.0) * lagged(rng, n, 40.0)
    return recorded(run(n, pi, process, load=load, noise=noise(rng, n, 0.0, 0.2)))


@GOOD.add
def play_integ(rng) -> Adverse:
    """A level cycles on the play of its valve: a limit cycle of the valve's own, but without a slip jump."""
    n, valve = length(rng, 1000.0, 4000.0), Valve(S=rng.uniform(1.0, 6.0))
    process = level(rng.uniform(0.0, 5.0), rng.uniform(1.0, 5.0))
    pi = Controller(rng.uniform(1.0, 4.0), rng.uniform(50.0, 150.0))
    load = kick(n, 20, 5.0) + rng.uniform(0.0, 0.5) * lagged(rng, n, 50.0)
    return recorded(run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.0, 0.1)), valve, loop_type="level")


@GOOD.add
def play_load(rng) -> Adverse:
    """A valve with play that a load keeps turning: its deadband is plain to see, and a jump is all that is missing."""
    n, pi, process = plain(rng)
    valve = Valve(S=rng.uniform(0.5, 5.0))
    size, turns = rng.uniform(0.5, 2.0) * valve.S, rng.random() < 0.6
    shapes = ["sine", "tri", "square", "saw"]
    load = size * (wave(rng.choice(shapes), n, rng.uniform(50.0, 200.0)) if turns else lagged(rng, n, 60.0))
    return recorded(run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.0, 0.3)), valve)


@GOOD.add
def delay_tight(rng) -> Adverse:
    """Dead time and a tuning near the limit: the loop cycles by itself, in rounded steps."""
    n, dead_time, tau = length(rng), rng.uniform(10.0, 40.0), rng.uniform(1.0, 8.0)
    Kc = rng.uniform(0.2, 0.5)
    pi = Controller(Kc, Kc * dead_time / rng.uniform(0.9, 1.45))
    load = rng.uniform(0.5, 2.0) * lagged(rng, n, 10.0) + kick(n, 30, 4.0)
    signals = run(n, pi, Process(tau, dead_time), load=load, noise=noise(rng, n, 0.0, 0.2))
    if np.ptp(signals.op[-100:]) > 60.0:  # beyond the limit of stability
        return delay_tight(rng)
    return recorded(signals)


@GOOD.add
def ext_plain(rng) -> Adverse:
    """A wave from outside and nothing else, from short and noise-free records to long and noisy ones."""
    n, process = length(rng, 300.0, 5000.0), lagged_process(rng)
    pi = tuned(rng, process, slowest=5.0)
    shape, size = rng.choice(["sine", "tri", "square", "saw", "onoff"]), rng.uniform(1.0, 8.0)
    load = size * wave(shape, n, log_uniform(rng, 15.0, 200.0))
    return recorded(run(n, pi, process, load=load, noise=white(rng, n, rng.choice([0.0, 0.05, 0.5]))))


@GOOD.add
def sp_square(rng) -> Adverse:
    """A set point that goes to and fro: OP and PV are square as those of a sticky valve are."""
    n, pi, process = plain(rng)
    sp = driven(rng, n, (1.0, 8.0), ["square"], (60.0, 400.0))
    load = rng.uniform(0.0, 0.5) * lagged(rng, n, 20.0)
    return recorded(run(n, pi, process, sp=sp, load=load, noise=white(rng, n, rng.choice([0.0, 0.05, 0.3]))))


@GOOD.add
def noisefree(rng) -> Adverse:
    """Two steps of the load, tuned to ring, without any noise: all but two short times say nothing."""
    n, process = length(rng), lagged_process(rng)
    pi = tuned(rng, process, slowest=0.6, fastest=0.35)
    load = np.zeros(n)
    load[int(0.1 * n) :], load[int(0.5 * n) :] = 5.0, -3.0
    return recorded(run(n, pi, process, load=load))


@GOOD.add
def very_noisy(rng) -> Adverse:
    """Noise as large as what moves the loop or larger: the OP follows it, and no cycle is to be seen."""
    n, pi, process = plain(rng)
    load = lagged(rng, n, 30.0)
    return recorded(run(n, pi, process, load=load, noise=noise(rng, n, 1.0, 5.0)))


@GOOD.add
def batch(rng) -> Adverse:
    """Large steps or ramps of the set point every 100 samples: the loop is never at one operating point."""
    n, pi, process = plain(rng)
    sp = steps(rng, n, 20.0, 100)
    if rng.random() < 0.5:
        sp = np.convolve(sp, np.ones(40) / 40.0, "same")
    return recorded(run(n, pi, process, sp=sp, noise=noise(rng, n, 0.0, 0.3)))


@GOOD.add
def drift(rng) -> Adverse:
    """A transmitter that drifts far while a wave comes from outside: the OP drifts with it."""
    n, pi, process = plain(rng)
    sensor = np.linspace(0.0, rng.uniform(-30.0, 30.0), n)
    sensor += rng.uniform(0.0, 1.0) * np.cumsum(rng.normal(0.0, 0.1, n))
    load = driven(rng, n, (0.2, 3.0), ["sine"], (30.0, 100.0))
    return recorded(run(n, pi, process, load=load, drift=sensor, noise=noise(rng, n, 0.0, 0.3)))


@GOOD.add
def tight_sat(rng) -> Adverse:
    """An unstable loop whose OP goes from limit to limit: a regular cycle, and an OP that stands still at its turns."""
    n, pi, process = plain(rng)
    pi, width = tightened(pi, rng.uniform(3.0, 6.0)), rng.uniform(3.0, 15.0)
    low, guarded = MIDDLE - width * rng.uniform(0.5, 1.0), bool(rng.random() < 0.7)
    pi = replace(pi, low=low, high=MIDDLE + width, anti_windup=guarded)
    load = kick(n, 20, 3.0) + rng.uniform(0.0, 1.0) * lagged(rng, n, 40.0)
    return recorded(run(n, pi, process, load=load, noise=noise(rng, n, 0.0, 0.2)))


@GOOD.add
def pv_quant(rng) -> Adverse:
    """A PV in steps as large as what moves the loop: it stands still and jumps."""
    n, pi, process = plain(rng)
    transmitter = Transmitter(step=rng.choice([0.1, 0.25, 0.5, 1.0]))
    load = rng.uniform(0.2, 1.5) * lagged(rng, n, 60.0)
    return recorded(run(n, pi, process, None, transmitter, load=load, noise=noise(rng, n, 0.0, 0.1)))


@GOOD.add
def rate_lim(rng) -> Adverse:
    """A slow actuator and a load that jumps: the stem lags the OP by what looks like a band, and ramps."""
    n, pi, process = plain(rng)
    pi = tightened(pi, rng.uniform(0.8, 1.8))
    valve = Valve(rate=rng.uniform(0.05, 0.4))
    load = rng.uniform(2.0, 8.0) * pump(rng, n, rng.uniform(80.0, 300.0))
    return recorded(run(n, pi, process, valve, load=load, noise=noise(rng, n, 0.0, 0.2)))


@GOOD.add
def units_ext(rng) -> Adverse:
    """A wave from outside, recorded in any unit and at any sampling period: nothing may depend on either."""
    n, process = length(rng, 300.0, 4000.0), lagged_process(rng)
    dt, scale = log_uniform(rng, 0.1, 300.0), 10.0 ** rng.uniform(-6.0, 6.0)
    pi = tuned(rng, process)
    shape, size = rng.choice(["sine", "tri", "square"]), rng.uniform(1.0, 6.0)
    load = size * wave(shape, n, rng.uniform(20.0, 100.0)) + rng.uniform(0.0, 1.0) * lagged(rng, n, 20.0)
    signals = run(n, pi, process, load=load, noise=noise(rng, n, 0.0, 0.3))
    return recorded(signals, dt=dt, scale=scale, offset=scale * rng.uniform(-100.0, 100.0))


@GOOD.add
def hist_good(rng) -> Adverse:
    """A load from outside as a slow historian keeps it, in means or in samples: the controller's own are gone."""
    every = int(rng.choice([5, 10, 30]))
    n, pi, process = plain(rng, 500.0, 2000.0)
    n *= every
    size, wanders = rng.uniform(1.0, 5.0), rng.random() < 0.5
    shapes = ["sine", "saw"]
    load = lagged(rng, n, 60.0 * every) if wanders else wave(rng.choice(shapes), n, rng.uniform(15.0, 60.0) * every)
    signals = run(n, pi, process, load=size * load, noise=noise(rng, n, 0.1, 0.5))
    return recorded(by_historian(rng, signals, every), dt=float(every))


@GOOD.add
def inverse(rng) -> Adverse:
    """A process that first answers the wrong way, as a boiler's level does, and a wave from outside."""
    n, tau = length(rng), rng.uniform(5.0, 20.0)
    process = Process(tau, 2.0, tau * 0.8, inverse=rng.uniform(0.3, 1.5))
    pi = Controller(rng.uniform(0.2, 0.6), tau * 1.5)
    load = driven(rng, n, (1.0, 5.0), ["sine", "square", "saw"], (40.0, 150.0))
    return recorded(run(n, pi, process, load=load, noise=noise(rng, n, 0.0, 0.2)))


@GOOD.add
def analyser(rng) -> Adverse:
    """An analyser that shows a new value every few samples: the PV is a staircase, and the OP has its steps."""
    n, hold, tau = length(rng), int(rng.integers(3, 20)), rng.uniform(10.0, 40.0)
    pi = tuned(rng, Process(tau, 1.5 * hold))
    process = Process(tau, rng.uniform(2.0, 10.0))
    size, wanders = rng.uniform(1.0, 4.0), rng.random() < 0.5
    load = size * (lagged(rng, n, 60.0) if wanders else wave("sine", n, rng.uniform(8.0, 20.0) * hold))
    signals = run(n, pi, process, None, Transmitter(hold=hold), load=load, noise=noise(rng, n, 0.0, 0.3))
    return recorded(signals, loop_type="analyser")


@GOOD.add
def seat(rng) -> Adverse:
    """A valve all but shut, on whose seat the OP goes on without effect: what comes back late is no band."""
    n, pi, process = plain(rng)
    op_start, valve = rng.uniform(8.0, 14.0), Valve(seat=rng.uniform(6.0, 10.0))
    load = driven(rng, n, (2.0, 6.0), ["sine", "saw", "tri"], (60.0, 200.0))
    return recorded(run(n, pi, process, valve, op_start=op_start, load=load, noise=noise(rng, n, 0.0, 0.2)))


@GOOD.add
def mid_ext(rng) -> Adverse:
    """A wave from outside that begins within the record: before it nothing moves, as with a stem that still rests."""
    n, pi, process = plain(rng)
    load = driven(rng, n, (2.0, 8.0), ["sine", "tri", "square", "saw"], (20.0, 80.0))
    load[: int(n * rng.uniform(0.3, 0.7))] = 0.0
    load += 0.3 * lagged(rng, n, 20.0)
    return recorded(run(n, pi, process, load=load, noise=noise(rng, n, 0.0, 0.3)))


@GOOD.add
def neighbour(rng) -> Adverse:
    """A good loop that the sticky valve of another one drives: its load has the shape that stiction makes."""
    n, sticky = length(rng), sticking(rng, 2.0, 6.0, 0.3)
    through = rng.uniform(0.3, 1.0)
    other, own = lagged_process(rng), lagged_process(rng)
    pi_other, pi_own = tuned(rng, other), tuned(rng, own)
    noise_other, noise_own = white(rng, n, 0.1), white(rng, n, 0.1)
    load_own = 0.5 * lagged(rng, n, 30.0)
    load_other = 0.5 * lagged(rng, n, 30.0) + kick(n, 20, sticky.S)
    cycle = run(n, pi_other, other, sticky, load=load_other, noise=noise_other).mv - MIDDLE
    return recorded(run(n, pi_own, own, load=load_own + through * cycle, noise=noise_own))


@GOOD.add
def sawload_level(rng) -> Adverse:
    """A tight level with a wave of sharp corners from outside: the PV's corners are those of a valve that slips."""
    n, pi = length(rng), Controller(rng.uniform(2.0, 5.0), rng.uniform(30.0, 150.0))
    load = driven(rng, n, (2.0, 8.0), ["saw", "tri", "square", "onoff"], (30.0, 150.0))
    return recorded(run(n, pi, level(1.0, 2.0), load=load, noise=noise(rng, n, 0.0, 0.1)), loop_type="level")
