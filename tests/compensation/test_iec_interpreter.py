"""The tests' own interpreter of structured text: it runs what the standard says and refuses what it forbids."""

from __future__ import annotations

import math

import pytest
from tests.compensation.iec_expressions import RunError, TextError
from tests.compensation.iec_interpreter import FunctionBlock

FRAME = """FUNCTION_BLOCK Frame
VAR_INPUT A, B : DINT; X, Y : LREAL; P, Q : BOOL; END_VAR
VAR_OUTPUT N : DINT; Z : LREAL; T : BOOL; END_VAR
VAR CONSTANT HALF : LREAL := 0.5; END_VAR
VAR I : DINT; TOTAL : LREAL := -1.5E-1; SMALL : SINT; END_VAR
{}
END_FUNCTION_BLOCK
"""


def run(body: str, a=0, b=0, x=0.0, y=0.0, p=False, q=False):
    n, z, t = FunctionBlock(FRAME.format(body)).instance()(a, b, x, y, p, q)
    return {"N": n, "Z": z, "T": t}


@pytest.mark.parametrize(
    ("body", "given", "name", "value"),
    [
        ("N := 2 + 3 * 4;", {}, "N", 14),
        ("N := (2 + 3) * 4;", {}, "N", 20),
        ("N := A / B;", {"a": -7, "b": 2}, "N", -3),
        ("N := A MOD B;", {"a": -7, "b": 2}, "N", -1),
        ("N := A MOD B;", {"a": 7, "b": 0}, "N", 0),
        ("N := 10 - 4 - 3;", {}, "N", 3),
        ("Z := -X ** 2.0;", {"x": 3.0}, "Z", 9.0),
        ("Z := X / Y * Y;", {"x": 6.0, "y": 3.0}, "Z", 6.0),
        ("T := P OR Q AND P XOR Q;", {"p": True, "q": True}, "T", True),
        ("T := NOT P AND Q;", {"q": True}, "T", True),
        ("T := X < Y = P;", {"x": 1.0, "y": 2.0, "p": True}, "T", True),
        ("T := X <> Y;", {"x": 1.0, "y": 1.0}, "T", False),
        ("Z := LIMIT(0.0, X, 100.0);", {"x": 120.0}, "Z", 100.0),
        ("Z := LIMIT(MX := 100.0, IN := X, MN := 5.0);", {"x": -1.0}, "Z", 5.0),
        ("Z := SEL(P, X, Y);", {"x": 1.0, "y": 2.0, "p": True}, "Z", 2.0),
        ("Z := MAX(X, Y, 0.5) - MIN(X, Y);", {"x": 1.0, "y": -2.0}, "Z", 3.0),
        ("Z := SQRT(ABS(X));", {"x": -9.0}, "Z", 3.0),
        ("N := TRUNC(X);", {"x": -2.7}, "N", -2),
        ("N := LREAL_TO_DINT(X);", {"x": 2.5}, "N", 2),
        ("Z := DINT_TO_LREAL(A) * HALF;", {"a": 3}, "Z", 1.5),
        ("N := 16#FF + 2#1010 + 1_000;", {}, "N", 1265),
        ("SMALL := SINT#-128; T := SMALL < 0;", {}, "T", True),
        ("Z := total; (* names know no case *)", {}, "Z", -0.15),
        ("z := 1.0; // to the end of the line\nz := Z + 1.0;", {}, "Z", 2.0),
        ("IF A > 1 THEN N := 1; ELSIF A > 0 THEN N := 2; ELSE N := 3; END_IF;", {"a": 1}, "N", 2),
        ("CASE A OF 1, 2: N := 10; 3..5: N := 20; N := N + 1; -1: N := 30; ELSE N := 40; END_CASE;", {"a": 4}, "N", 21),
        ("CASE A OF 1, 2: N := 10; -1: N := 30; ELSE N := 40; END_CASE;", {"a": 7}, "N", 40),
        ("FOR I := 1 TO 5 DO N := N + I; END_FOR;", {}, "N", 15),
        ("FOR I := 5 TO 1 BY -2 DO N := N * 10 + I; END_FOR;", {}, "N", 531),
        ("FOR I := 1 TO 9 DO IF I > 3 THEN EXIT; END_IF; N := I; END_FOR;", {}, "N", 3),
        ("REPEAT N := N + 1; UNTIL N >= 4 END_REPEAT;", {}, "N", 4),
        ("N := 1; RETURN; N := 2;", {}, "N", 1),
        (
            ";;N := ABS(A); I := B; WHILE I <> 0 DO SMALL := 0; N := N; I := I - 1; END_WHILE;",
            {"a": -2, "b": 3},
            "N",
            2,
        ),
    ],
)
def test_runs_as_the_standard_says(body, given, name, value):
    assert run(body, **given)[name] == value


def test_remembers_from_call_to_call():
    block = FunctionBlock(
        "FUNCTION_BLOCK Count VAR_INPUT UP : BOOL; END_VAR VAR_OUTPUT N : INT; END_VAR VAR_TEMP K : INT; END_VAR "
        "IF UP THEN N := N + 1; END_IF; K := K + 1; N := N + K - 1; END_FUNCTION_BLOCK"
    )
    one, other = block.instance(), block.instance()
    assert [one(True), one(False), one(True)] == [[1], [1], [2]]
    assert other(True) == [1]
    assert block.names("VAR_INPUT") == ("UP",)


@pytest.mark.parametrize(
    "body",
    [
        "N := M;",  # not declared
        "N := X;",  # LREAL to DINT
        "Z := A;",  # DINT to LREAL, unasked
        "Z := 1;",  # integer literal to LREAL
        "Z := P;",  # BOOL to LREAL
        "T := X;",  # LREAL to BOOL
        "T := P + Q;",
        "T := P AND X;",
        "T := P > Q;",
        "T := NOT X;",
        "T := X = P;",
        "N := A + X;",
        "Z := X MOD Y;",
        "N := A + SMALL;",
        "Z := ABS(P);",
        "Z := SQRT(4);",
        "Z := SEL(X, Y, Y);",
        "Z := SEL(P, X, A);",
        "Z := LIMIT(X, Y);",
        "Z := LIMIT(MN := X, IN := Y, TOP := Y);",
        "Z := MIN(X, Y,);",
        "Z := CLAMP(X);",
        "IF X THEN N := 1; END_IF;",
        "IF P THEN N := 1; END_IF",  # no semicolon
        "IF P N := 1; END_IF;",
        "IF P THEN N := 1;",
        "CASE X OF 1: N := 1; END_CASE;",
        "FOR X := 1.0 TO 2.0 DO N := 1; END_FOR;",
        "WHILE A DO N := 1; END_WHILE;",
        "EXIT;",
        "N = 1;",
        "A := 1;",  # input
        "HALF := 1.0;",  # constant
        "N := 1",
        "Z := 1.;",
        "Z := .5;",
        "Z := 1e-3;",
        "N := 1__0;",
        "N := 7 $ 2;",
        "N := 1; (* one (* two *) *)",
        "X + Y;",
        "SMALL := SINT#128;",
    ],
)
def test_refuses_what_the_standard_forbids(body):
    with pytest.raises(TextError, match=r"line \d+"):
        run(body)


@pytest.mark.parametrize(
    "declared",
    [
        "DT : LREAL",
        "_A : LREAL",
        "A_ : LREAL",
        "A__B : LREAL",
        "A : WORDS",
        "A : LREAL; a : LREAL",
        "Limit : LREAL",
        "A : SINT := 200",
        "A : LREAL := TRUE",
    ],
)
def test_refuses_a_declaration(declared):
    with pytest.raises(TextError):
        FunctionBlock(f"FUNCTION_BLOCK F VAR {declared}; END_VAR END_FUNCTION_BLOCK")


@pytest.mark.parametrize(
    "body", ["N := A * A;", "SMALL := 127; SMALL := SMALL + 1;", "N := A / B;", "WHILE TRUE DO N := 0; END_WHILE;"]
)
def test_stops_where_the_run_goes_wrong(body):
    with pytest.raises(RunError):
        run(body, a=100_000)


def test_an_input_of_the_wrong_type_is_refused():
    with pytest.raises(RunError, match="BOOL"):
        run("N := 0;", p=math.pi)
