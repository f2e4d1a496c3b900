"""Numbers with their unit behind them in each cell, as dashboards write them."""

from __future__ import annotations

import numpy as np
import pytest

from stiction.errors import RecordError


def with_units(values, unit):
    return [f"{value!r}{unit}" for value in values.tolist()]


@pytest.fixture
def grafana(signals, table):
    """A panel's CSV: ``grafana(PV's unit, OP's unit, OP)``."""
    t, pv, op, _ = signals
    times = [f"2026-02-01 13:{int(s) // 60:02d}:{int(s) % 60:02d}" for s in t]

    def write(pv_unit, op_unit, raw=op, pvs=pv, **how):
        columns = [with_units(pvs, pv_unit), with_units(raw, op_unit)]
        if how.get("decimal") == ",":
            columns = [[cell.replace(".", ",") for cell in column] for column in columns]
        return table('"Time"@"FIC-1.PV"@"FIC-1.OP"'.replace("@", how.get("delimiter", ",")), times, *columns, **how)

    return write


@pytest.mark.parametrize("unit", [" bar", "bar", " t/h", "\u00a0m³/h", " °C", " K", " %"])
@pytest.mark.parametrize("how", [{}, {"delimiter": ";", "decimal": ","}])
def test_the_unit_of_the_cells_is_the_column_s(unit, how, signals, grafana, read_text):
    _, pv, op, _ = signals
    [record] = read_text(grafana(unit, " %", **how))
    assert (record.pv.tolist(), record.op.tolist()) == (pv.tolist(), op.tolist())
    assert record.provenance.pv_unit == unit.strip()
    assert not any("missing" in note for note in record.provenance.assumptions)


def test_an_output_in_milliamperes_comes_to_percent(signals, grafana, read_text):
    _, _, op, _ = signals
    [record] = read_text(grafana(" bar", " mA", 4.0 + 0.16 * op))
    np.testing.assert_allclose(record.op, op, rtol=1e-12)
    assert any("4 mA are taken as 0 %" in note for note in record.provenance.assumptions)


@pytest.mark.parametrize("other", [" mm", ""])
@pytest.mark.parametrize("row", [3, 115])
def test_a_column_of_mixed_units_is_refused(other, row, signals, grafana, read_text):
    pv = signals[1].tolist()
    text = grafana(" bar", " %").replace(f",{pv[row]!r} bar", f",{pv[row]!r}{other}", 1)
    where = "1 in mm" if other else "1 without a unit"
    with pytest.raises(RecordError, match=rf"column FIC-1.PV: mixes units \(119 in bar, {where}\); export .* in one"):
        read_text(text)


def test_a_long_table_has_the_units_of_each_tag(signals, read_text):
    t, pv, op, _ = signals
    rows = [
        f"{tag},2026-02-01 13:{int(s) // 60:02d}:{int(s) % 60:02d},{value!r} {unit}"
        for tag, values, unit in (("FIC-1.PV", pv, "bar"), ("FIC-1.OP", 4.0 + 0.16 * op, "mA"))
        for s, value in zip(t, values.tolist(), strict=True)
    ]
    [record] = read_text("\n".join(["Tag,Time,Value", *rows]))
    np.testing.assert_allclose(record.op, op, rtol=1e-12)
    assert record.provenance.pv_unit == "bar"
    value = float(rows[20].split(",")[2].removesuffix(" bar"))
    rows[20] = rows[20].replace(f"{value!r} bar", f"{1000.0 * value!r} mbar")
    [record] = read_text("\n".join(["Tag,Time,Value", *rows]))
    np.testing.assert_allclose(record.pv, pv, rtol=1e-12)
    assert "FIC-1.PV: 1 value in mbar was converted to bar." in record.provenance.assumptions
    rows[20] = rows[20].replace("mbar", "mm")
    with pytest.raises(RecordError, match=r"FIC-1.PV: mixes units"):
        read_text("\n".join(["Tag,Time,Value", *rows]))


def test_units_under_no_header_are_refused(signals, grafana, read_text):
    _, _, rows = grafana(" bar", " mA", 4.0 + 0.16 * signals[2]).partition("\n")
    with pytest.raises(RecordError, match="has numbers in bar but no header; write a header"):
        read_text(rows, columns={"time": 0, "pv": 1, "op": 2})


def test_a_unit_in_the_header_and_another_in_the_cells_is_refused(grafana, read_text):
    text = grafana(" bar", " %")
    assert read_text(text.replace("FIC-1.PV", "FIC-1.PV [BAR]"))[0].provenance.pv_unit == "BAR"
    with pytest.raises(RecordError, match=r"column FIC-1.OP \[mA\]: its header says mA, its numbers say %"):
        read_text(text.replace("FIC-1.OP", "FIC-1.OP [mA]"))


@pytest.mark.parametrize("heading", ["FIC-1.PV Unit", "FIC-1.PV.UOM", "Unit"])
@pytest.mark.parametrize("small", ["l/h", "m3/h"])
def test_units_in_a_column_beside_the_signal_of_a_wide_table_are_converted(heading, small, signals, read_text, table):
    t, pv, op, _ = signals
    is_small = np.arange(len(pv)) % 3 == 0
    large, factor = ("m3/h", 1000.0) if small == "l/h" else ("l/h", 0.001)
    written = np.where(is_small, pv * factor, pv)
    units = np.where(is_small, small, large)
    columns = [[str(one) for one in column] for column in (t, written, units, op)]
    [record] = read_text(table(f"time_s,FIC-1.PV,{heading},FIC-1.OP", *columns))
    np.testing.assert_allclose(record.pv, pv, rtol=1e-12)
    assert record.provenance.pv_unit == large
    assert any(f"converted to {large}" in note for note in record.provenance.assumptions)


def test_unit_column_that_cannot_be_converted_is_refused(signals, read_text, table):
    t, pv, op, _ = signals
    units = ["t/h", *["m3/h"] * (len(pv) - 1)]
    with pytest.raises(RecordError, match=r"mixes units .*m3/h.*t/h"):
        read_text(table("time_s,FIC-1.PV,FIC-1.PV Unit,FIC-1.OP", t, pv, units, op))
