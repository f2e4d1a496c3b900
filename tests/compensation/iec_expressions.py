"""Words and expressions of structured text, IEC 61131-3: tokens, types, operators, standard functions.

Stricter than the third edition where older compilers are: no conversion happens unasked, not even from INT to LREAL,
and both sides of AND and OR are evaluated, as the order is up to the compiler.
"""

from __future__ import annotations

import math
import operator
import re

TOKEN = re.compile(
    r"""(?P<space>\s+|\(\*(?:(?!\(\*)[\s\S])*?\*\)|//[^\n]*)
      |(?P<real>\d(?:_?\d)*\.\d(?:_?\d)*(?:[eE][+-]?\d+)?(?![\w.]))
      |(?P<int>(?:2\#[01](?:_?[01])*|8\#[0-7](?:_?[0-7])*|16\#[\dA-Fa-f](?:_?[\dA-Fa-f])*|\d(?:_?\d)*)(?![\w#]|\.\d))
      |(?P<typed>[A-Za-z]+\#)
      |(?P<name>[A-Za-z_]\w*)
      |(?P<sign>:=|<=|>=|<>|\*\*|\.\.|[-+*/=<>()&;:,])""",
    re.X,
)
BITS = {"SINT": 8, "INT": 16, "DINT": 32, "LINT": 64}
RANGE = {kind: (-(1 << bits - 1), (1 << bits - 1) - 1) for kind, bits in BITS.items()}
RANGE |= {f"U{kind}": (0, (1 << bits) - 1) for kind, bits in BITS.items()}
TYPES = {*RANGE, "BOOL", "LREAL"}
WORDS = """
    AND ANDN ANY ARRAY AT BOOL BY BYTE CAL CALC CASE CONFIGURATION CONSTANT CTD CTU CTUD DATE DATE_AND_TIME DINT DIV
    DO DT DWORD ELSE ELSIF EN ENO EQ EXIT EXPT F_TRIG FALSE FOR FROM FUNCTION FUNCTION_BLOCK GE GT IF INITIAL_STEP INT
    INTERVAL JMP JMPC LD LDN LE LINT LREAL LT LWORD METHOD MOD MOVE MUL NE NEG NON_RETAIN NOT NULL OF ON OR ORN OVERLAP
    PRIORITY PROGRAM R R_TRIG REAL REF_TO REPEAT RESOURCE RET RETAIN RETURN ROL ROR RS S SHL SHR SINGLE SINT SR ST STEP
    STN STRING STRUCT SUB TASK THEN THIS SUPER TIME TIME_OF_DAY TO TOD TOF TON TP TRANSITION TRUE TYPE UDINT UINT ULINT
    UNTIL USINT VAR VAR_INPUT VAR_OUTPUT VAR_TEMP VAR_IN_OUT VAR_GLOBAL VAR_EXTERNAL WHILE WITH WORD WSTRING XOR XORN
    ABS SQRT LN LOG EXP SIN COS TAN ASIN ACOS ATAN ATAN2 TRUNC MIN MAX LIMIT SEL MUX ADD LEN LEFT RIGHT MID CONCAT FIND
    END_IF END_CASE END_FOR END_WHILE END_REPEAT END_VAR END_FUNCTION_BLOCK END_FUNCTION END_PROGRAM"""
RESERVED = set(WORDS.split())
FORMAL = {"MIN": ("IN1", "IN2"), "MAX": ("IN1", "IN2"), "LIMIT": ("MN", "IN", "MX"), "SEL": ("G", "IN0", "IN1")}


class TextError(Exception):
    """The text breaks a rule of the language."""


class RunError(Exception):
    """The text is well formed, but running it breaks a limit: overflow, division by zero, a loop without an end."""


def arithmetic(kind, compute):
    """`compute` of two operands, held to the range of an integer type."""
    if kind not in RANGE:
        return lambda a, b: lambda v: compute(a(v), b(v))
    low, high = RANGE[kind]

    def operation(a, b):
        def run(v):
            result = compute(a(v), b(v))
            if not low <= result <= high:
                raise RunError(f"{result} leaves {kind}")
            return result

        return run

    return operation


def divide(a, b):
    if b == 0:
        raise RunError("division by zero")
    return a / b if isinstance(a, float) else int(math.copysign(abs(a) // abs(b), a * b))


def modulo(a, b):
    """IN1 - (IN1 / IN2) * IN2, and 0 when IN2 = 0."""
    return a - divide(a, b) * b if b else 0


COMPUTE = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": divide, "MOD": modulo}
COMPARE = {
    "<": operator.lt, ">": operator.gt, "<=": operator.le, ">=": operator.ge, "=": operator.eq, "<>": operator.ne,
}  # fmt: skip
LOGIC = {"OR": operator.or_, "XOR": operator.xor, "AND": operator.and_, "&": operator.and_}
LEVELS = (("OR",), ("XOR",), ("AND", "&"), ("=", "<>"), ("<", ">", "<=", ">="), ("+", "-"), ("*", "/", "MOD"))
"""Binary operators from the weakest to the strongest."""


class Expressions:
    """Recursive descent over the tokens, as far as expressions go."""

    def __init__(self, text, variables):
        self.variables, self.tokens, self.at = variables, [], 0
        place = 0
        while place < len(text):
            found = TOKEN.match(text, place)
            if found is None:
                raise TextError(f"line {text.count(chr(10), 0, place) + 1}: cannot read {text[place : place + 12]!r}")
            if found.lastgroup != "space":
                word = found.group().upper() if found.lastgroup in ("name", "typed") else found.group()
                self.tokens.append((found.lastgroup, word, text.count("\n", 0, place) + 1))
            place = found.end()
        self.tokens.append(("end", "end of text", text.count("\n") + 1))

    @property
    def word(self):
        return self.tokens[self.at][1]

    @property
    def sort(self):
        return self.tokens[self.at][0]

    def wrong(self, what):
        return TextError(f"line {self.tokens[self.at][2]}: {what}, at {self.word!r}")

    def take(self, *words):
        """The next token when it is one of `words`, else None."""
        if self.sort in ("name", "sign") and self.word in words:
            self.at += 1
            return self.tokens[self.at - 1][1]
        return None

    def need(self, word):
        if self.take(word) is None:
            raise self.wrong(f"{word} expected")

    def fits(self, given, wanted):
        """An integer literal is ANY_INT until it meets a variable; all else must be of the type that is wanted."""
        if given != wanted and not (given == "ANY_INT" and wanted in RANGE):
            raise self.wrong(f"{given} where {wanted} is needed")

    def in_range(self, value, kind):
        if kind in RANGE and not RANGE[kind][0] <= value <= RANGE[kind][1]:
            raise self.wrong(f"{value} leaves {kind}")

    def common(self, a, b):
        if a == "ANY_INT" and b in RANGE:
            return b
        self.fits(b, a)
        return a

    def boolean(self):
        kind, value = self.expression()
        self.fits(kind, "BOOL")
        return value

    def integer(self, kind):
        given, value = self.expression()
        self.fits(given, kind)
        return value

    def expression(self, level=0):
        if level == len(LEVELS):
            return self.power()
        kind, value = self.expression(level + 1)
        while sign := self.take(*LEVELS[level]):
            other, right = self.expression(level + 1)
            kind, value = self.binary(sign, kind, value, other, right)
        return kind, value

    def binary(self, sign, a, left, b, right):
        kind = self.common(a, b)
        if sign in LOGIC:
            self.fits(kind, "BOOL")
            return "BOOL", arithmetic("BOOL", LOGIC[sign])(left, right)
        if kind == "BOOL" and sign not in ("=", "<>"):
            raise self.wrong(f"{sign} of BOOL")
        if sign in COMPARE:
            return "BOOL", arithmetic("BOOL", COMPARE[sign])(left, right)
        if sign == "MOD" and kind == "LREAL":
            raise self.wrong("MOD of LREAL")
        return kind, arithmetic(kind, COMPUTE[sign])(left, right)

    def power(self):
        kind, value = self.unary()
        while self.take("**"):
            other, exponent = self.unary()
            self.fits(kind, "LREAL")
            self.fits(other, "LREAL")
            value = arithmetic("LREAL", operator.pow)(value, exponent)
        return kind, value

    def unary(self):
        if self.take("NOT"):
            kind, value = self.unary()
            self.fits(kind, "BOOL")
            return "BOOL", lambda v: not value(v)
        if sign := self.take("-", "+"):
            kind, value = self.unary()
            if kind == "BOOL":
                raise self.wrong("sign of BOOL")
            return kind, (lambda v: -value(v)) if sign == "-" else value
        return self.primary()

    def primary(self):
        sort, word = self.sort, self.word
        if self.take("("):
            result = self.expression()
            self.need(")")
            return result
        if sort == "typed":
            return self.typed_literal()
        if sort in ("int", "real"):
            self.at += 1
            number = whole(word) if sort == "int" else float(word.replace("_", ""))
            return ("ANY_INT" if sort == "int" else "LREAL"), lambda _: number
        if self.take("TRUE", "FALSE"):
            return "BOOL", lambda _: word == "TRUE"
        variable = self.variables.get(word) if sort == "name" else None
        if variable is not None:
            self.at += 1
            place = variable.place
            return variable.kind, lambda v: v[place]
        if sort == "name" and self.tokens[self.at + 1][1] == "(":
            self.at += 1
            return self.call(word)
        raise self.wrong("neither a declared variable nor a function")

    def typed_literal(self):
        kind = self.word[:-1]
        self.at += 1
        if kind not in TYPES - {"BOOL"}:
            raise self.wrong(f"no literal of type {kind}")
        number = self.signed(kind)
        return kind, lambda _: number

    def signed(self, kind):
        """A literal of `kind` with or without a sign."""
        sign = -1 if self.take("-") else 1
        if self.sort != ("real" if kind == "LREAL" else "int"):
            raise self.wrong(f"a literal of {kind} expected")
        value = sign * (float(self.word.replace("_", "")) if kind == "LREAL" else whole(self.word))
        self.in_range(value, kind)
        self.at += 1
        return value

    def call(self, name):
        from_to = re.fullmatch(r"(\w+)_TO_(\w+)", name)
        arguments = self.arguments(name)
        kinds, values = [kind for kind, _ in arguments], [value for _, value in arguments]
        if from_to and {*from_to.groups()} <= TYPES - {"BOOL"} and len(values) == 1:
            self.fits(kinds[0], from_to[1])
            convert = float if from_to[2] == "LREAL" else round
            return from_to[2], arithmetic(from_to[2], lambda a, _: convert(a))(values[0], values[0])
        if name == "SEL" and len(values) == 3:
            self.fits(kinds[0], "BOOL")
            which, low, high = values
            return self.common(*kinds[1:]), lambda v: (low(v), high(v))[which(v)]
        if name in ("MIN", "MAX", "LIMIT", "ABS", "SQRT", "TRUNC") and "BOOL" not in kinds:
            return self.numeric(name, kinds, values)
        raise self.wrong(f"no function {name} of {', '.join(kinds)}")

    def numeric(self, name, kinds, values):
        kind = kinds[0]
        for other in kinds[1:]:
            kind = self.common(kind, other)
        if name in ("MIN", "MAX") and len(values) >= 2:
            choose = min if name == "MIN" else max
            return kind, lambda v: choose([value(v) for value in values])
        if name == "LIMIT" and len(values) == 3:
            low, value, high = values
            return kind, lambda v: min(max(value(v), low(v)), high(v))
        if name in ("ABS", "SQRT", "TRUNC") and len(values) == 1:
            value = values[0]
            if name == "ABS":
                return kind, lambda v: abs(value(v))
            self.fits(kind, "LREAL")
            return ("LREAL", lambda v: math.sqrt(value(v))) if name == "SQRT" else ("DINT", lambda v: int(value(v)))
        raise self.wrong(f"{name} with {len(values)} arguments")

    def arguments(self, name):
        """Arguments in order, whether given by place or by formal name."""
        self.need("(")
        named = {}
        while not self.take(")"):
            key = len(named)
            if self.sort == "name" and self.tokens[self.at + 1][1] == ":=":
                if self.word not in FORMAL.get(name, ()) or FORMAL[name].index(self.word) in named:
                    raise self.wrong(f"no such parameter of {name}")
                key = FORMAL[name].index(self.word)
                self.at += 2
            named[key] = self.expression()
            if self.word != ")":
                self.need(",")
                if self.word == ")":
                    raise self.wrong("an argument expected")
        if sorted(named) != list(range(len(named))) or not named:
            raise self.wrong(f"arguments of {name} missing")
        return [named[k] for k in range(len(named))]


def whole(word):
    base, _, digits = word.replace("_", "").rpartition("#")
    return int(digits, int(base or 10))
