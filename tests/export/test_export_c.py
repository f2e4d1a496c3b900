"""The exported C against the kernels, sample by sample; and the paper's numbers by the exported C."""

from __future__ import annotations

import numpy as np
import pytest
from tests.export.compiled import (
    BUILDS,
    compile_all,
    is_valve,
    models,
    random_op,
    run,
    sampling_period,
)
from tests.reference import physical as reference
from tests.reference.valves import JUMP_ABOVE_S, STEPS
from tests.services import require

import stiction as st
from stiction.models.compensators.component import compensator_at_rest
from stiction.models.dispatch import compensator_step
from stiction.records import LoopRecord

N, N_COMPENSATED = 100_000, 5_000
MODELS = models()
PROCESS = st.FOPDT(3.0, 10.0, 10.0)
LOOPS = {
    "plain": st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), PROCESS, 1.0),
    "pure_dead_time": st.Loop(st.PID(0.05, 10.0), st.He(2.0, 1.0), st.FOPDT(2.0, 0.0, 3.0), 1.0),
    "direct_path": st.Loop(st.PID(0.1, 10.0), st.Stenman(1.0), st.TransferFunction([2.0, 1.0], [3.0, 1.0], 2.5), 1.0),
    "second_order": st.Loop(
        st.PID(0.2, 10.0, 1.0, b=0.5, c=0.0, op_limits=(-5.0, 20.0), integral="forward"), st.Srinivasan(2.0, 1.0, 0.1),
        st.SOPDT(3.0, 10.0, 3.0, 1.0), 0.5, compensator=st.Knocker(1.5, 2.0, 5.0),
    ),
    "two_move": st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), PROCESS, 1.0, compensator=st.TwoMove(3.0, 1.0, 1.0)),
    "cuadros": st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), PROCESS, 1.0, compensator=st.Cuadros(1.5, 2.0, 5.0, 2.0)),
}  # fmt: skip


@pytest.fixture(scope="module")
def truth() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Model -> inputs and outputs of the kernel."""
    found = {}
    for name, model in MODELS.items():
        if is_valve(model):
            op = random_op(N)
            found[name] = op[:, np.newaxis], st.stroke(model, op, sampling_period(model)).mv[:, np.newaxis]
            continue
        op, noise = random_op(N_COMPENSATED), np.random.default_rng(1).normal(0.0, 0.3, N_COMPENSATED)
        sp = np.where(np.arange(N_COMPENSATED) < 0.8 * N_COMPENSATED, 50.0, 52.0)
        pv = 50.0 + 3.0 * np.sin(np.arange(N_COMPENSATED) / 9.0) + noise
        state, packed, outputs = compensator_at_rest(op[0], sp[0]), model.pack(1.0), []
        for row in zip(op, sp, pv, strict=True):
            state = compensator_step(model.code, *row, state, packed)
            outputs.append((state.valve_signal, state.hold, state.track))
        found[name] = np.stack([op, sp, pv], axis=1), np.array(outputs)
    return found


@pytest.mark.parametrize(("compiler", "level"), BUILDS)
def test_c_is_the_kernel_bit_for_bit(compiler, level, truth, tmp_path):
    library = compile_all(MODELS, tmp_path, compiler, level)
    for name, (inputs, outputs) in truth.items():
        start = [inputs[0, 0], inputs[0, 0]] if is_valve(MODELS[name]) else inputs[0, :2]
        found = run(library, name, start, inputs, outputs.shape[1])
        assert np.ptp(outputs[:, 0]) > 1.0, f"{name} hardly moves in this test"
        assert np.array_equal(found, outputs), name


@pytest.mark.parametrize(("compiler", "level"), BUILDS[1:3])
def test_an_exported_loop_is_simulate(compiler, level, tmp_path):
    n = 4_000
    rng = np.random.default_rng(2)
    sp, load, pv_load = (
        1.0 + 10.0 * (np.arange(n) // 1000 % 2),
        np.cumsum(rng.normal(0.0, 0.1, n)),
        rng.normal(0, 0.1, n),
    )
    library = compile_all(LOOPS, tmp_path, compiler, level)
    for name, loop in LOOPS.items():
        record = st.simulate(
            loop, sp, n * loop.dt, load, pv_disturbance=pv_load, pv_start=1.0, op_start=2.0, mv_start=3.0
        )
        found = run(library, name, [sp[0], 1.0, 2.0, 3.0], np.stack([sp, load, pv_load], axis=1), 3)
        for column, signal in enumerate(("pv", "op", "mv")):
            assert np.array_equal(found[:, column], getattr(record, signal)), (name, signal)


@pytest.fixture
def exported_stroke(tmp_path):
    """`stroke` by the exported C."""
    calls = []

    def stroke(valve, op, dt, mv_start=None):
        name = f"model{len(calls)}"
        calls.append(name)
        folder = tmp_path / name
        library = compile_all({name: valve}, folder, "gcc", "-O2", dt)
        op = np.asarray(op, dtype=np.float64)
        mv = run(library, name, [op[0], op[0] if mv_start is None else mv_start], op[:, np.newaxis], 1)[:, 0]
        return LoopRecord("exported", dt, op=op, mv=mv)

    yield stroke
    require(calls, "the exported C was not used")


@pytest.mark.parametrize("row", [*STEPS, *JUMP_ABOVE_S], ids=str)
def test_worked_numbers(row, exported_stroke):
    op = [0.0] + [10.0] * 5 if row in STEPS else [0.0, 2.5]
    assert exported_stroke(row.given["valve"], op, 1.0).mv[-1] == row.expected


def test_table_1_and_figure_2(exported_stroke, monkeypatch):
    """Break-away of Table I, stairs of figure 2b and steady motion of figure 2c."""
    from stiction.paper import fig2

    monkeypatch.setattr(fig2, "stroke", exported_stroke)
    figure = fig2.figure2()
    for row in reference.STAIRS:
        panel = figure.panel("2b", row.given["set"][-1].upper())
        assert (panel.behaviour, panel.slips) == ("staircase", row.expected["slips"])
        assert panel.first_break == pytest.approx(row.expected["first"], rel=row.tolerance)
        assert panel.slip == pytest.approx(row.expected["slip"], rel=row.tolerance)
    for row in reference.FOLLOW:
        panel = figure.panel("2c", row.given["set"][-1].upper())
        assert (panel.behaviour, panel.slips) == ("follow", 0)
        assert panel.slowest == pytest.approx(row.expected["slowest"], rel=row.tolerance)
