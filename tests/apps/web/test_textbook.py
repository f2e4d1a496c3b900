"""The functions of the textbook screen against closed forms, the paper's numbers and the library."""

from __future__ import annotations

import math

import numpy as np
import pytest

import stiction as st
from stiction.apps.web.textbook import draw_nyquist, drive_by_sine, simulate_jump, simulate_ramps
from stiction.apps.web.textbook_settings import TextbookSettings
from stiction.errors import ParameterError
from stiction.limitcycle import predict_limit_cycles

STEP = 20.0 / 800


def test_on_a_ramp_each_model_shows_its_own_bands() -> None:
    answer = simulate_ramps(TextbookSettings(S=5.0, J=2.0, r=0.5, rate=0.1, height=20.0), width=4000)
    op, position = answer["op"], answer["position"]
    kano = position["Kano, Choudhury (S, J)"]
    top = op.argmax()
    assert kano[:top].max() == pytest.approx(20.0 - (5.0 - 2.0) / 2.0, abs=2 * STEP)
    back = np.flatnonzero(kano[top:] < kano[top])[0] + top
    assert op[top] - op[back] == pytest.approx(5.0, abs=2 * STEP)
    assert np.diff(kano[: top + 1]).max() == pytest.approx(2.0, abs=2 * STEP)
    assert np.diff(position["He (fs, fd)"][: top + 1]).max() == pytest.approx(2.0, abs=2 * STEP)
    assert np.diff(position["Stenman (one parameter)"][: top + 1]).max() == pytest.approx(3.5, abs=2 * STEP)
    np.testing.assert_array_equal(position["Ideal"], op)
    first = np.flatnonzero(position["Physical (Table I)"] > 0.0)[0]
    assert op[first] == pytest.approx(3.5, abs=2 * STEP)


def test_the_rate_decides_between_stairs_and_following() -> None:
    slow = simulate_ramps(TextbookSettings(S=5.0, J=2.0, r=0.5, rate=0.4))["behaviour"]
    fast = simulate_ramps(TextbookSettings(S=5.0, J=2.0, r=0.5, rate=0.6))["behaviour"]
    three = "Three parameters (eq. 5)"
    assert slow[three] == "The stem goes in stairs of 2 %."
    assert fast[three] == "The stem sticks, jumps by 2 % and follows."
    assert slow["Kano, Choudhury (S, J)"] == fast["Kano, Choudhury (S, J)"] == fast[three]
    assert slow["Ideal"] == "The stem follows OP."
    short = simulate_ramps(TextbookSettings(S=5.0, J=2.0, height=1.0))["behaviour"]
    assert short["Stenman (one parameter)"].startswith("The stem does not move")


@pytest.mark.parametrize("model", ["stenman", "kano", "he"])
@pytest.mark.parametrize("amplitude", [0.8, 0.95, 1.7])
def test_N_is_the_fundamental_of_the_stem_that_is_drawn(model: str, amplitude: float) -> None:
    answer = drive_by_sine(TextbookSettings(model=model, S=1.0, J=0.5, amplitude=amplitude))
    angle, position = np.radians(answer["phase"][:-1]), answer["position"][:-1]
    N = 2.0 * np.mean(position * np.exp(-1j * angle)) * 1j / amplitude
    assert complex(*answer["N"]) == pytest.approx(N, abs=0.01)
    assert complex(*answer["inverse"]) == pytest.approx(-1.0 / N, rel=0.03)
    drawn = 2.0 * np.mean(answer["fundamental"][:-1] * np.exp(-1j * angle)) * 1j / amplitude
    assert drawn == pytest.approx(complex(*answer["N"]), abs=1e-6)


def test_a_small_sine_does_not_move_the_stem() -> None:
    answer = drive_by_sine(TextbookSettings(S=1.0, J=1.0, amplitude=0.3))
    assert answer["inverse"] is None
    assert answer["sentence"] == "At A = 0.3 % the stem does not move: N = 0."


def test_the_nyquist_plot_of_the_example_has_the_cycles_of_the_paper() -> None:
    answer = draw_nyquist(TextbookSettings())
    periods = [float(row[3]["text"]) for row in answer["table"]["rows"] if row[0]["text"] == "cycle"]
    assert periods == pytest.approx([21.11, 16.28, 17.66, 15.66], abs=0.01)
    assert answer["sentence"].startswith("4 stable limit cycles")
    names = [series["name"] for series in answer["figure"]["panels"][0]["series"]]
    assert {"L(jω)", "-1/N(A), family half", "stable cycle", "boundary"} <= set(names)


def test_a_loop_without_a_cycle_is_drawn_and_explained(monkeypatch) -> None:
    asked = []

    def predict(loop):
        asked.append((repr(loop), predict_limit_cycles(loop)))
        return asked[-1][1]

    monkeypatch.setattr("stiction.limitcycle.predict_limit_cycles", predict)
    answer = draw_nyquist(TextbookSettings(model="kano", S=1.0, J=0.0, gain_factor=0.05))
    loop = st.Loop(
        st.PID.parallel(0.5, 1.0, 0.1), st.Kano(1.0, 0.0), st.TransferFunction([0.05], [5.0, 6.0, 1.0]), dt=0.01
    )
    assert asked == [(repr(loop), ())]
    assert answer["sentence"].startswith("No limit cycle")
    assert answer["figure"]["panels"][0]["series"][0]["name"] == "L(jω)"


def test_a_pulse_as_in_figure_8_moves_the_loop_and_a_small_one_does_not() -> None:
    moved = simulate_jump(TextbookSettings(pulse=1.0, length=5.0))
    assert "moves the loop from one limit cycle (period 21.1 s, 2 rest levels)" in moved["sentence"]
    assert "16.2" in moved["sentence"]
    assert "4 rest levels" in moved["sentence"]
    assert moved["pulse"] == [200.0, 205.0]
    # The smallest pulse of this length that moves the loop, at the best instant, is 0.135 % (figure 8).
    assert "does not move the loop" in simulate_jump(TextbookSettings(pulse=0.1, length=5.0))["sentence"]


@pytest.mark.parametrize("name", list(TextbookSettings.quantities()))
def test_a_number_outside_its_limits_is_refused(name: str) -> None:
    quantity = TextbookSettings.quantities()[name]
    with pytest.raises(ParameterError) as error:
        TextbookSettings.from_mapping({name: quantity.high + 1.0})
    assert str(error.value).startswith(f"{quantity.label} = ")


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"model": "ideal"}, "use one of stenman"),
        ({"Q": 1}, "not a setting of the textbook"),
        ({"S": "x"}, "must be a number"),
    ],
)
def test_settings_that_cannot_be_are_refused(values: dict[str, object], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        TextbookSettings.from_mapping(values)


def test_J_above_S_is_refused_where_no_model_has_it() -> None:
    with pytest.raises(ParameterError, match="lower J, or raise S"):
        simulate_ramps(TextbookSettings(S=1.0, J=2.0))
    assert math.isfinite(drive_by_sine(TextbookSettings(S=1.0, J=2.0))["N"][0])
