"""Which column is which signal of which loop: names, tag letters, descriptions, data and the user's choice."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from stiction.errors import ParameterError, RecordError
from stiction.sources.options import ReadOptions
from stiction.sources.roles.assign import assign_roles
from stiction.sources.roles.by_data import find_roles_by_data
from stiction.sources.roles.cascade import find_secondary_tags
from stiction.sources.roles.column_names import header_names, parse_column_name
from stiction.sources.table import Origin, RawTable, TagColumn

pytestmark = pytest.mark.quick

N = 400


def make_columns(names, values=None, descriptions=None, units=None):
    """Columns of one table; the first column of the table is the time."""
    table = RawTable(Origin("plant.csv", "plant"), [["Time", *names]], [], len(names) + 1, lambda _: pl.DataFrame(), 2)
    values = values or [np.zeros(N)] * len(names)
    return [
        TagColumn(
            name,
            table,
            None,
            lambda x=x: pl.Series([repr(float(v)) for v in x]),
            position=k + 1,
            unit=units[k] if units else "",
            description=descriptions[k] if descriptions else "",
        )
        for k, (name, x) in enumerate(zip(names, values, strict=True))
    ]


def assigned(names, *, values=None, descriptions=None, **options):
    loops = assign_roles(make_columns(names.split(","), values, descriptions), ReadOptions(**options))
    return {loop.tag: {role: column.name for role, column in loop.roles.items()} for loop in loops}


def one_loop(names, **how):
    columns = make_columns(names.split(","), how.pop("values", None), how.pop("descriptions", None))
    [loop] = assign_roles(columns, ReadOptions(**how))
    return loop


@pytest.mark.parametrize(
    ("names", "tag"),
    [
        ("FIC101.Val_PV,FIC101.Val_SP,FIC101.Val_CVOut", "FIC101"),  # Rockwell PlantPAx
        ("FIC101.ScaledInput,FIC101.Setpoint,FIC101.Output", "FIC101"),  # Siemens PID_Compact
        ("FIC101.PV,FIC101.SP,FIC101.OUTP", "FIC101"),
        ("FIC101.Val_PV,FIC101.PSet_SP,FIC101.Val_CV", "FIC101"),
        ("FT4101.PV,FIC4101.SP,FV4101.OP", "FIC4101"),
        ("FT-4101,FIC-4101.SP,FV-4101", "FIC-4101"),
        ("12-LT-7.PV,12-LIC-7.SP,12-LY-7.OP", "12-LIC-7"),
        ("PT4101,PIC4101.SP,PV4101", "PIC4101"),
        ("TT31.PV,TIC31.SP,TV31A.OP", "TIC31"),
        ("FIC4101,FIC4101.SP,FIC4101.OUT", "FIC4101"),
        ("Reflux flow PV (m3/h),Reflux flow SP (m3/h),Reflux valve OP (%)", "Reflux flow"),
        ("Column 3 reflux flow PV,Column 3 reflux flow SP,Reflux control valve OP", "Column 3 reflux flow"),
        ("Tank level PV,Tank level SP,Inlet valve OP", "Tank level"),
        ("Débit reflux PV,Débit reflux SP,Vanne reflux OP", "Débit reflux"),
    ],
)
def test_pv_sp_and_op_of_one_loop(names, tag):
    pv, sp, op = names.split(",")
    assert assigned(names) == {tag: {"pv": pv, "sp": sp, "op": op}}


def test_pairs_of_several_loops_stay_apart():
    names = "FT1.PV,FV1.OP,FT2.PV,FV2.OP,Reflux flow PV,Reboiler temperature PV,Reflux valve OP,Reboiler steam valve OP"
    loops = assigned(names)
    assert loops["FT1"] == {"pv": "FT1.PV", "op": "FV1.OP"}
    assert loops["FT2"] == {"pv": "FT2.PV", "op": "FV2.OP"}
    assert loops["Reflux flow"] == {"pv": "Reflux flow PV", "op": "Reflux valve OP"}
    assert loops["Reboiler temperature"] == {"pv": "Reboiler temperature PV", "op": "Reboiler steam valve OP"}


@pytest.mark.parametrize("position", ["FV4101.ZT", "FV4101.PV", "ZT4101", "ZI4101.PV", "FZT4101.PV", "FV4101 Position"])
def test_the_position_of_the_valve_of_one_number(position):
    loop = one_loop(f"FIC4101.PV,FIC4101.SP,FIC4101.OP,{position}")
    assert loop.roles["mv"].name == position
    assert any(position in note and "--column" in note for note in loop.notes)


@pytest.mark.parametrize(
    "names",
    [
        "FIC1.PV,LIC2.SP,LIC2.OP",
        "FIC1.PV,FV2.OP",
        "FIC4101.SP,FV4101.PV",
        "Reflux flow PV,Feed flow PV,Steam valve OP,Water valve OP",
        "FIC-1.CV,FIC-1.MV,FIC-1.SP",
        "Flow,Valve,Ctrl",
    ],
)
def test_what_belongs_to_no_loop_is_refused_with_the_remedy(names):
    with pytest.raises(RecordError, match=r"plant.csv, line 1: no loop with OP and PV .* columns=.*map"):
        assigned(names)


def test_a_refusal_of_ten_thousand_columns_is_short():
    names = [f"Pump {k} {'PV' if k % 2 else 'SP'}" for k in range(10_000)]
    with pytest.raises(RecordError) as caught:
        assign_roles(make_columns(names), ReadOptions())
    assert len(str(caught.value)) < 1500


def test_a_position_that_two_loops_could_have_is_named_and_not_used():
    loops = assign_roles(make_columns(["FIC7.PV", "FIC7.OP", "LIC7.PV", "LIC7.OP", "ZT7.PV"]), ReadOptions())
    assert all("mv" not in loop.roles for loop in loops)


def test_descriptions_give_tag_and_role():
    described = ["Reflux flow PV", "Reflux flow set point", "Reflux valve OP"]
    loop = one_loop("AI0231,AV0231,AO0117", descriptions=described)
    assert {role: column.name for role, column in loop.roles.items()} == {
        "pv": "AI0231",
        "sp": "AV0231",
        "op": "AO0117",
    }
    assert loop.tag == "Reflux flow"
    assert any("by its description" in note for note in loop.notes)


def pi_loop(seed=1):
    rng = np.random.default_rng(seed)
    pv = 150.0 + np.convolve(rng.normal(size=N + 40), np.ones(40) / 8, "valid")[:N] + 0.2 * rng.normal(size=N)
    sp = np.full(N, 150.0)
    op = 50.0 + 0.4 * (sp - pv) + 0.02 * np.cumsum(sp - pv)
    return np.round(pv, 3), sp, np.round(op, 3)


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
def test_the_data_show_the_controller(order):
    signals = pi_loop()
    loop = one_loop("A,B,C", values=[signals[k] for k in order])
    names = ["A", "B", "C"]
    assert {role: column.name for role, column in loop.roles.items()} == {
        role: names[order.index(k)] for k, role in enumerate(("pv", "sp", "op"))
    }
    assert any("by the data" in note for note in loop.notes)


def test_data_without_a_controller_show_nothing():
    rng = np.random.default_rng(3)
    columns = make_columns(["A", "B"], [rng.normal(size=N), rng.normal(size=N)])
    assert find_roles_by_data(columns, {}) == ({}, "")
    pv, _, op = pi_loop()
    # A copy of the PV explains OP as well as the PV does.
    assert find_roles_by_data(make_columns(["A", "B", "C"], [pv, op, pv]), {}) == ({}, "")


def test_unused_columns_beside_a_signal_are_named():
    loop = one_loop("FIC1.PV,Batch,FIC1.OP,FIC1.ALM,FT1.PV,TI9.PV,Operator")
    assert loop.unused == ["Batch", "FIC1.ALM", "FT1.PV", "Operator"]
    assert any("TI9" in note for note in loop.notes)


@pytest.mark.parametrize("flag", ["Quality", "Confidence", "Status", "QualityDetail"])
def test_a_flag_after_each_signal_is_that_signals(flag):
    loop = one_loop(f"FIC1.PV,{flag},FIC1.OP,{flag}")
    assert [loop.roles[role].position for role in ("pv quality", "op quality")] == [2, 4]


def test_several_flags_after_a_signal():
    loop = one_loop("FIC1.PV,Good,Questionable,Substituted,FIC1.OP,Good,Questionable,Substituted")
    assert [loop.roles[role].position for role in ("pv quality", "pv bad", "pv bad 2", "op bad 2")] == [2, 3, 4, 8]
    assert one_loop("PV,OP,Quality").roles["quality"].position == 3


def test_the_user_overrules_the_names():
    names = "FIC-1.PV,FIC-1.SP,FIC-1.OP,FIC-1.OUT,LIC-2.PV,LIC-2.OP"
    with pytest.raises(RecordError, match=r"'FIC-1.OP' and 'FIC-1.OUT' are both the OP of one loop"):
        assigned(names, tag="FIC-1")
    assert assigned(names, columns={"op": "fic-1.out"})["FIC-1"]["op"] == "FIC-1.OUT"
    assert assigned(names, columns={"pv": 5, "op": 3})[""] == {"pv": "LIC-2.PV", "op": "FIC-1.OP"}
    with pytest.raises(RecordError, match=r"no column 'x' for PV; its columns are FIC-1.PV, "):
        assigned(names, columns={"pv": "x"})
    with pytest.raises(RecordError, match=r"no column 9 for OP; they are numbered 0 to 6"):
        assigned(names, columns={"op": 9})
    with pytest.raises(ParameterError, match="'valve' is not a signal"):
        assigned(names, columns={"valve": 1})
    with pytest.raises(RecordError, match=r"no loop 'XIC'; its loops are LIC-2"):
        assigned("LIC-2.PV,LIC-2.OP", tag="XIC")


def test_one_loop_with_two_outputs_does_not_refuse_the_others():
    loops = assign_roles(make_columns(["F1.PV", "F1.OP", "F1.OUT", "F2.PV", "F2.OP"]), ReadOptions())
    assert [loop.tag for loop in loops] == ["F2"]
    assert any("Left out" in note and "'F1.OUT'" in note for note in loops[0].notes)


def test_header_rows_give_names_units_and_descriptions():
    found = header_names([["", "FIC-1", ""], ["Time", "PV", "OP"], ["s", "t/h", "%"]])
    assert found.names == ["Time", "FIC-1.PV", "FIC-1.OP"]
    rows = [["Time", "FIC-1.PV", "FIC-1.OP"], ["min", "t/h", "%"], ["Local", "Feed flow of unit 3", "Feed valve"]]
    assert header_names(rows) == (rows[0], rows[1], rows[2])


@pytest.mark.parametrize("name", ["CO_ppm", "Stack CO %", "FLOW", "", "2026"])
def test_names_that_are_no_signal(name):
    assert parse_column_name(name) is None


def test_masters_of_the_map_overrule_the_data():
    from stiction.records import LoopRecord

    op = np.arange(60.0) % 17
    records = [
        LoopRecord("T1", 1.0, op=op, sp=np.full(60, 5.0)),
        LoopRecord("F2", 1.0, op=op[::-1], sp=4.0 + 0.5 * op),
        LoopRecord("F3", 1.0, op=op[::-1], sp=np.full(60, 2.0)),
    ]
    assert find_secondary_tags(records) == ["F2", "", ""]
    assert find_secondary_tags(records, {"F3": "T1"}) == ["F3", "", ""]
    with pytest.raises(RecordError, match="'T9' as a master"):
        find_secondary_tags(records, {"F3": "T9"})


def test_a_column_named_by_the_tag_alone_is_the_pv():
    roles = assigned("HEATER,HEATER.OP,TANK,TANK.OP")
    assert roles == {tag: {"op": f"{tag}.OP", "pv": tag} for tag in ("HEATER", "TANK")}


@pytest.mark.parametrize("tags", ["FT101,FV101", "FI101.PV,FV101.OUT", "FIC-101.PV,FIC-101.OP"])
def test_naming_one_signal_keeps_the_guesses_of_the_others(tags):
    pv, op = tags.split(",")
    loop = one_loop(f"{tags},Target", columns={"sp": "Target"})
    assert {role: column.name for role, column in loop.roles.items()} == {"pv": pv, "op": op, "sp": "Target"}
    loop = one_loop(f"{tags},Level", columns={"pv": "Level"})
    assert {role: column.name for role, column in loop.roles.items()} == {"pv": "Level", "op": op}
    assert not any(f"{pv} = PV" in note for note in loop.notes)


def test_one_named_signal_of_two_loops_is_refused():
    with pytest.raises(RecordError, match=r"recognised: .*Target = SP"):
        one_loop("FT101,FV101,FT102,FV102,Target", columns={"sp": "Target"})
