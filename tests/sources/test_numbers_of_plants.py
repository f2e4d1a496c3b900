"""Units of OP and of the valve position, and thousands parted by marks, against the numbers that were written."""

from __future__ import annotations

import numpy as np
import pytest

from stiction.errors import RecordError


@pytest.mark.parametrize(
    ("header", "zero", "span", "options"),
    [
        ("time_s,OP [mA],ZT [mA]", 4.0, 0.16, {}),
        ("time_s,OP_mA,POS_mA", 4.0, 0.16, {}),
        ("time_s,OP,ZT [0-1]", 0.0, 0.01, {}),
        ("time_s,OP [counts],ZT [counts]", 0.0, 40.95, {"op_range": (0, 4095)}),
        ("time_s,OP,ZT", 0.0, 40.95, {"op_range": (0, 4095), "mv_range": (0, 4095)}),
    ],
)
def test_a_position_comes_to_percent_by_its_own_unit(header, zero, span, options, signals, table, read_text):
    t, _, op, _ = signals
    mv = np.roll(op, 1)
    raw = op if header.startswith("time_s,OP,ZT [") else zero + span * op
    [record] = read_text(table(header, t, raw, zero + span * mv), **options)
    np.testing.assert_allclose(record.op, op, rtol=1e-12)
    np.testing.assert_allclose(record.mv, mv, rtol=1e-12)


@pytest.mark.parametrize(
    ("raw_op", "raw_mv", "options", "remedy"),
    [
        ((0.0, 1.0), (4.0, 0.16), {}, "signal of 4 to 20"),
        ((0.0, 1.0), (0.0, 0.01), {}, "signal of 0 to 1"),
        ((4.0, 0.16), (4.0, 0.16), {"op_range": (4, 20)}, "signal of 4 to 20"),
        ((0.0, 40.95), (0.0, 40.95), {"op_range": (0, 4095)}, "signal of 0 to 4095"),
        ((0.0, 1.0), (0.0, 655.35), {}, "(mv_range), low to high"),
    ],
)
def test_a_position_in_another_range_is_converted_where_op_shows_it(
    raw_op, raw_mv, options, remedy, signals, table, read_text
):
    t, _, op, _ = signals
    mv = np.roll(op, 1)
    raw = raw_mv[0] + raw_mv[1] * mv
    [record] = read_text(table("time_s,OP,ZT", t, raw_op[0] + raw_op[1] * op, raw), **options)
    np.testing.assert_allclose(record.mv, mv if "signal of" in remedy else raw, rtol=1e-9)
    assert any(remedy in note for note in record.provenance.assumptions)


def test_a_position_in_percent_is_no_guess(signals, table, read_text):
    t, _, op, _ = signals
    for mv in (np.roll(op, 1), np.full(len(t), 5.0), np.linspace(0.0, 1.0, len(t)), np.full(len(t), "")):
        assert (
            read_text(table("time_s,OP,ZT", t, op, mv), columns={"pv": "OP", "op": "OP"})[0].provenance.assumptions
            == ()
        )


def test_thousands(signals, table, read_text):
    t, _, op, _ = signals
    big = 1000.5 + np.arange(len(t))
    english = [f'"{x:,.1f}"' for x in big]
    [record] = read_text(table("time_s,PV,OP", t, english, op))
    np.testing.assert_array_equal(record.pv, big)
    [record] = read_text(table("time_s,PV,OP", t, [f'"{x:,.0f}"' for x in 3000 + t], op))
    np.testing.assert_array_equal(record.pv, 3000 + t)
    assert any("'3,000' is read as 3000" in note for note in record.provenance.assumptions)
    german = [f"{x:,.1f}".replace(",", " ").replace(".", ",").replace(" ", ".") for x in big]
    [record] = read_text(table("time_s;PV;OP", t, german, op, delimiter=";", decimal=","))
    np.testing.assert_array_equal(record.pv, big)


def parted(x, mark, decimals=0):
    """A number with marks between its thousands."""
    english = f"{x:,.{decimals}f}"
    return english if mark == "," else english.replace(",", "_").replace(".", ",").replace("_", ".")


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_decimal_commas_beside_a_decimal_point_are_reported_where_they_are_read_as_thousands(
    delimiter, signals, table, read_text
):
    t, pv, op, _ = signals
    three = [[f"{x:.3f}".replace(".", ",") for x in values] for values in (pv, op)]
    [record] = read_text(table(delimiter.join(("time_s", "PV", "OP")), t, *three, delimiter=delimiter))
    assert any(f"{three[0][0]!r} is read as {1000 * pv[0]:.0f}; if" in note for note in record.provenance.assumptions)


@pytest.mark.parametrize("mark", [".", ","])
@pytest.mark.parametrize("late", [False, True])
def test_thousands_without_decimals_are_refused_where_they_would_be_read_as_decimals(mark, late, table, read_text):
    k = np.arange(400)
    big = np.where(k < 220, 900 + k % 60, 950 + k % 100) if late else 950 + k % 100
    op = [str(40 + i % 7) for i in k]
    text = table("time_s;PV;OP", map(str, k), [parted(x, mark) for x in big], op, delimiter=";")
    if mark == "," and late:
        np.testing.assert_array_equal(read_text(text)[0].pv, big)  # a decimal point is the rule until a cell speaks
        return
    with pytest.raises(
        RecordError,
        match=rf"column PV: the column has '999' and '1\{mark}0.* may be the decimal mark .*decimal=",
    ):
        read_text(text)
    other = "," if mark == "." else "."
    np.testing.assert_array_equal(read_text(text, decimal=other)[0].pv, big)
    assert read_text(text, decimal=mark)[0].pv.min() < 2.0


@pytest.mark.parametrize("mark", [".", ","])
def test_thousands_that_may_be_decimals_are_reported(mark, signals, table, read_text):
    t, _, op, _ = signals
    big = 1100.0 + t
    columns = [str(int(s)) for s in t], [parted(x, mark) for x in big], [f"{x:.0f}" for x in op]
    text = table("time_s;PV;OP", *columns, delimiter=";")
    [record] = read_text(text)
    np.testing.assert_allclose(record.pv, big / 1000)
    other = "," if mark == "." else "."
    assert any(
        f"is read as 1.1; if that is wrong give the decimal mark (decimal) '{other}'" in told
        for told in record.provenance.assumptions
    )
    np.testing.assert_array_equal(read_text(text, decimal=other)[0].pv, big)
    fixed = [f"{x:.3f}".replace(".", mark) for x in op]  # an OP with three decimals says which mark it is
    assert not any(
        "is read as" in told
        for told in read_text(table("time_s;PV;OP", *columns[:2], fixed, delimiter=";"))[0].provenance.assumptions
    )


@pytest.mark.parametrize("first", [1000, 900, 700])
def test_thousands_between_commas_without_quotes_are_refused(first, signals, table, read_text):
    _, _, op, _ = signals
    k = np.arange(4 * len(op))
    pv = [f"{first + i:,.1f}" for i in k]
    with pytest.raises(RecordError, match=r"commas between columns and within numbers, such as 1,0"):
        read_text(table("time_s,PV,OP", map(str, k), pv, np.tile(op, 4)))
    quoted = [f'"{cell}"' for cell in pv]
    np.testing.assert_array_equal(
        read_text(table("time_s,PV,OP", map(str, k), quoted, np.tile(op, 4)))[0].pv, first + k
    )


def test_decimals_beside_whole_numbers_are_no_thousands(signals, table, read_text):
    t, pv, op, _ = signals
    for odd in ("7", "700", "999"):
        cells = [odd if k == 5 else f"{x / 10:.3f}" for k, x in enumerate(pv)]
        read_text(table("time_s;PV;OP", t, cells, op, delimiter=";"))
    short = [f"{1 + k / 100:.2f}" if k % 2 else "999" for k in range(len(pv))]
    assert read_text(table("time_s;PV;OP", t, short, op, delimiter=";"))[0].pv[1] == 1.01
    notes = [f"{x},100,,note" if k == 7 else repr(float(x)) for k, x in enumerate(op)]
    read_text(table("time_s,PV,OP", t, pv, notes))


@pytest.mark.parametrize(("mark", "given", "word"), [(",", ".", "comma"), (".", ",", "point")])
def test_a_decimal_mark_that_is_not_the_one_of_the_numbers_is_refused(mark, given, word, table, read_text):
    k = np.arange(400)
    pv = [f"{150 + np.sin(i / 9):.3f}".rstrip("0").replace(".", mark) for i in k]
    op = [f"{50 + np.cos(i / 9):.3f}".replace(".", mark) for i in k]
    text = table("time_s;PV;OP", map(str, k), pv, op, delimiter=";")
    says = rf"column PV: .* % of its cells, such as 1\d\d\{mark}\d*, are numbers only with a decimal {word}; leave out"
    with pytest.raises(RecordError, match=says):
        read_text(text, decimal=given)
    np.testing.assert_allclose(read_text(text, decimal=mark)[0].pv, 150 + np.sin(k / 9), atol=6e-4)
    pv[7:17] = ["Bad"] * 10  # words are bad values, not numbers of the other mark
    text = table("time_s;PV;OP", map(str, k), pv, op, delimiter=";")
    assert read_text(text, decimal=mark)[0].provenance.bad_values == {"Bad": 10}
