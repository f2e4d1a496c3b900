"""``stiction simulate``: simulate a control loop."""

import sys
from typing import Any

from stiction.apps.options import JsonOption, OutOption, TextOption

__all__ = ["simulate"]

DEFAULTS: dict[str, Any] = {
    "process": "3 exp(-10s)/(10s+1)",
    "controller": "pi:Kc=0.2,Ti=10",
    "valve": "kano:S=3,J=1",
    "compensator": "none",
    "sp": "51",
    "disturbance": "0",
    "pv_start": 50.0,
    "op_start": 50.0,
    "noise": 0.0,
    "dt": 1.0,
    "duration": 2000.0,
    "seed": None,
    "tag": "simulated",
}


def simulate(
    *,
    process: TextOption = None,
    controller: TextOption = None,
    valve: TextOption = None,
    compensator: TextOption = None,
    sp: TextOption = None,
    disturbance: TextOption = None,
    pv_start: float | None = None,
    op_start: float | None = None,
    noise: float | None = None,
    dt: float | None = None,
    duration: float | None = None,
    seed: int | None = None,
    tag: str | None = None,
    loop: str | None = None,
    out: OutOption = None,
    as_json: JsonOption = False,
) -> int:
    """Simulate a control loop with a sticky valve; the signals come as CSV.

    Parameters
    ----------
    process
        "3 exp(-10s)/(10s+1)" (the default), fopdt:K=3,tau=10,dead_time=10, sopdt:..., integrating:K=..., or
        tf:num=3,den=10 1,dead_time=10. PV units per % of span, seconds.
    controller
        pi:Kc=0.2,Ti=10 (the default), pid:Kc=..,Ti=..,Td=..,N=.., p:Kc=.. or parallel:Kp=..,Ki=..,Kd=..;
        op_limits=0..100 adds limits.
    valve
        kano:S=3,J=1 (the default), choudhury:S=..,J=.., stenman:d=.., he:fs=..,fd=.., srinivasan:sb=..,sj=..,r=..,
        physical:mass=..., a published set such as nominal, or ideal. % of span.
    compensator
        none (the default), knocker:amplitude=1.5,width=2,interval=5, constant-reinforcement:amplitude=..,
        integral-deadband:band=.., cuadros:.., variable-pulses:.., two-move:S=..,J=..,band=.. or four-move:band=...
    sp
        Set point, or set points with times: 51 (the default) or 50,55@600 (55 from 600 s on).
    disturbance
        Load at the process inlet in % of span, in the same form.
    pv_start
        PV at rest before the start (50).
    op_start
        OP and valve position at rest before the start in % of span (50).
    noise
        Standard deviation of the measurement noise in PV units (0).
    dt
        Sampling period in seconds (1).
    duration
        Length in seconds (2000).
    seed
        Seed of the noise; random when not given.
    tag
        Name of the loop.
    loop
        TOML file with any of these settings under the same names; options override it.
    out
        CSV file to write (time_s, SP, PV, OP, MV: the valve position, and VALVE_SIGNAL: the output of a compensator);
        without it the CSV goes to standard output.
    as_json
        Print period and amplitudes as JSON; the CSV is written only with --out.
    """
    from stiction.apps.output import print_err, print_json, print_out
    from stiction.apps.output_files import check_text, write_csv
    from stiction.apps.parse_loop import make_loop, merge_settings, require_position, runaway_message
    from stiction.apps.parse_signal import parse_levels

    typed = {
        "process": process, "controller": controller, "valve": valve,
        "compensator": compensator, "sp": sp, "disturbance": disturbance, "pv_start": pv_start,
        "op_start": op_start, "noise": noise, "dt": dt, "duration": duration, "seed": seed, "tag": tag,
    }  # fmt: skip
    settings = merge_settings(loop, typed, DEFAULTS)
    target = None if out is None or out == "-" else check_text(out, "--out")
    from stiction.diagnosis.oscillation import find_oscillation
    from stiction.errors import require_positive
    from stiction.simulation import simulate as run

    length = require_positive("duration", settings["duration"], "s")
    step = require_positive("dt", settings["dt"], "s")
    # Before the loop is made: a length of too many samples is told by its name, and not by what of the loop is as long.
    set_point, load = (parse_levels(name, settings[name], length, step) for name in ("sp", "disturbance"))
    made = make_loop(settings)
    record = run(
        made,
        set_point,
        length,
        load,
        settings["seed"],
        pv_start=settings["pv_start"],
        op_start=require_position("op_start", settings["op_start"]),
        tag=str(settings["tag"]),
    )
    rhythm, away = find_oscillation(record), runaway_message(made, record)
    if target is not None or not as_json:
        write_csv(record, target)
    if as_json:
        summary = {"tag": record.tag, "samples": len(record), "dt_s": record.dt, "oscillation": rhythm.to_dict()}
        summary["ran_away"] = bool(away)
        print_json({**summary, "settings": settings, "file": None if target is None else str(target)})
    elif target is not None:
        print_out(f"{len(record)} samples every {record.dt:g} s written to {target}.")
    if away:
        print_err(f"stiction: {away}")
    elif not as_json and (target is not None or sys.stdout.isatty()):
        (print_out if target is not None else print_err)(rhythm.reason)
    return 0
