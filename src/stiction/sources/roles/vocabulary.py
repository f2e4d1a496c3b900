"""The words that plants use, in one table to edit: column names, status texts, modes, units, tag letters.

All words are upper case; a column name is compared after trimming, upper-casing and cutting a unit in brackets.
"""

from __future__ import annotations

import re

SIGNAL_WORDS: dict[str, tuple[str, ...]] = {
    "pv": (
        *("PV", "PROCESS VARIABLE", "PROCESS VALUE", "MEASUREMENT", "MEASURED VALUE", "ISTWERT"),
        *("PV.CV", "PV.F_CV", "PV.VALUE", "PV_IN", "PV_OUT", "MEAS", "MESURE"),  # DeltaV, fieldbus, PCS 7, I/A
        *("VAL_PV", "SCALEDINPUT", "SCALED INPUT"),  # Rockwell PlantPAx, Siemens PID_Compact
        *("VARIABLE DE PROCESO", "VALOR DE PROCESO", "VARIABILE DI PROCESSO", "VALORE DI PROCESSO", "MISURA"),
        *("VARIÁVEL DE PROCESSO", "VARIAVEL DE PROCESSO", "VALOR DE PROCESSO", "ÄRVÄRDE", "MITTAUS", "OLOARVO"),
        "ACTUAL VALUE",
    ),
    "sp": (
        *("SP", "SETPOINT", "SET POINT", "SETPT", "SOLLWERT", "CONSIGNE"),
        *("SP.CV", "SP.F_CV", "SP.VALUE", "SP_INT", "SV", "SPT"),  # DeltaV, fieldbus blocks, PCS 7, CENTUM, I/A
        *("VAL_SP", "CURRENTSETPOINT", "CURRENT SETPOINT"),  # Rockwell PlantPAx, Siemens PID_Compact
        *("CONSIGNA", "PUNTO DE CONSIGNA", "PONTO DE AJUSTE", "BÖRVÄRDE", "ASETUSARVO"),
    ),
    "op": (
        *("OP", "OUT", "CO", "OUTPUT", "CONTROLLER OUTPUT", "CONTROL OUTPUT", "STELLGRÖSSE", "STELLGRAD", "SORTIE"),
        *("OUT.CV", "OUT.F_CV", "OUT.VALUE", "OP.VALUE", "LMN", "CVEU"),  # DeltaV, fieldbus, PCS 7, Rockwell PIDE
        *("VAL_CVOUT", "OUT_CV", "OUTP"),  # Rockwell PlantPAx, Schneider
        *("STELLWERT", "SALIDA", "USCITA", "SAÍDA", "SAIDA", "STYRSIGNAL", "UTSIGNAL", "OHJAUS"),
    ),
    "mv": (
        *("MV", "VALVE POSITION", "VALVE_POSITION", "POSITION", "STEM POSITION", "STEM", "TRAVEL", "VALVE TRAVEL"),
        *("POS", "ZT", "ZI", "READBACK", "POSITION FEEDBACK", "ACTUAL POSITION"),
    ),
    "valve_signal": ("VALVE_SIGNAL", "VALVE SIGNAL"),
    "mode": (
        *("MODE", "MODE.ACTUAL", "MODE.ACT", "MODE_ACTUAL", "MODE ACTUAL", "MD", "AUTO", "AUTO/MAN", "A/M", "MA"),
        "VAL_MODE",
    ),
    "bad": ("BAD", "IS BAD", "ISBAD", "BAD FLAG", "QUESTIONABLE", "SUBSTITUTED"),  # the last two: PI Web API
    "quality": (
        *("QUALITY", "QUAL", "OPC QUALITY", "QUALITY CODE", "STATUS", "VALIDITY", "STATUS CODE", "STATUSCODE"),
        "CONFIDENCE",  # PHD: 0 is bad, 100 is good
        *("QUALITYDETAIL", "QUALITY DETAIL", "OPCQUALITY", "QUALITYSTATUS"),  # Wonderware
        *("IP_TREND_QSTATUS", "IP_TREND_QLEVEL", "QSTATUS", "QLEVEL", "QUALITYCODE"),  # IP.21, WinCC
        *("GOOD", "IS GOOD", "ISGOOD"),  # PI Web API
    ),
}
"""Signal -> its names, alone (`PV`) or after a tag (`FIC-101.PV`, `FIC-101/PID1/PV.CV`). The quality of one signal
stands after it (`FIC-101.PV.Quality`)."""

FALLBACK_SIGNAL_WORDS = {
    **dict.fromkeys(("WSP", "SP_OUT", "SET_SP", "PSET_SP"), "sp"),
    **dict.fromkeys(("CV", "VAL_CV", "OUT_CVEU", "OUTPUT_PER"), "op"),
    **dict.fromkeys(("ACTUAL", "INPUT", "INPUT_PER"), "pv"),
}
"""Words that count only where the loop has no plainer one: the working set point (ABB, Eurotherm, PCS 7); the output
of a Rockwell PID, which needs a PV and no valve position, since CV is the controlled variable of others; Actual and
Input, which need an OP, since a mode or a valve has one too."""

BLOCK_PAIRS = ((".DACA", ".PIDA"),)
"""Blocks of one point of which the first holds the PV and the second the controller (Experion)."""

TAG_WORDS = (
    *("TAG", "TAGNAME", "TAG NAME", "TAG_NAME", "POINT", "POINT NAME", "POINTNAME", "SIGNAL", "VARIABLE", "LOOP"),
    *("LOOP NAME", "CONTROLLER", "NAME", "VARNAME", "SERIES", "METRIC", "ITEM", "ITEM NAME", "POINT PARAMETER"),
    "_FIELD",  # InfluxDB
)
"""A column that names the tag of each row."""

LOOP_NAME_WORDS = ("_MEASUREMENT",)
"""A column that names the loop, as one of `TAG_WORDS` may, where the row's tag is only PV or OP."""

VALUE_WORDS = ("VALUE", "VAL", "READING", "VARVALUE", "VVALUE", "IP_TREND_VALUE", "_VALUE")
"""A column of values of the tag that the row or a heading names."""

PERCENT_UNITS = ("%", "PCT", "PERCENT")
"""Percent of span."""

UNIT_WORDS = (
    *(*PERCENT_UNITS, "MA", "BAR", "BARG", "MBAR", "KPA", "MPA", "PSI", "DEGC", "DEGF", "°C", "°F"),
    *("T/H", "KG/H", "KG/S", "M3/H", "L/MIN", "L/H", "L/S", "GPM", "MM", "CM", "RPM"),
)
"""Units that stand after a signal without brackets: `OP_mA`, `PV bar`. None of them is a unit of concentration, since
`CO ppm` is a gas and no controller output."""

CELL_UNITS = (
    *(*UNIT_WORDS, "PSIG", "PA", "HPA", "K", "M", "KG", "T/D", "KG/MIN", "M³/H", "M³/S", "M3/S", "M/S", "ML/MIN"),
    *("V", "VDC", "W", "KW", "MW", "HZ", "PPM", "PH"),
)
"""Units that stand after the number in each cell: `52.3 %`, `12.5 bar`."""

OTHER_OUTPUT_UNITS = (*(set(UNIT_WORDS) - {*PERCENT_UNITS, "MA"}), "PSIG", "V", "VDC", "HZ", "COUNTS")
"""Units of a controller output that is not in % of span."""

OUTPUT_IF_NO_OTHER = ("MV",)
"""Valve position where the loop has an OP, but the controller output where it has no other (CENTUM, GE)."""

TIME_WORDS = (
    *("TIME", "TIMESTAMP", "TIME STAMP", "DATETIME", "DATE TIME", "DATE/TIME", "DATE", "T", "ELAPSED", "CLOCK"),
    *("LOCAL TIME", "UTC", "TIME UTC", "EPOCH", "ZEIT", "ZEITSTEMPEL", "DATUM", "UHRZEIT", "HEURE", "FECHA", "HORA"),
    "HORODATAGE",
    *("TS", "T STAMP", "TIMESTRING", "TIME STRING", "IP TREND TIME"),  # Ignition, WinCC, IP.21
    *("UNIX", "UNIXTIME", "UNIX TIME", "UNIX TIMESTAMP", "EPOCH TIME", "ELAPSED TIME"),
    *("SECONDS", "SECS", "SEC", "MINUTES", "HOURS", "MILLISECONDS", "MSEC", "MS"),  # by its unit alone
    *("TIMESTAMP LOCAL", "TIMESTAMP UTC", "LOCAL TIMESTAMP", "UTC TIMESTAMP", "UTC TIME"),
    *("DATE & TIME", "DATE AND TIME"),
    *("SOURCETIMESTAMP", "SOURCE TIMESTAMP", "SERVERTIMESTAMP", "SERVER TIMESTAMP"),  # OPC UA
)
INDEX_WORDS = ("", "SAMPLE", "INDEX", "N", "K", "ROW", "NO", "NO.", "#", "SAMPLE NO", "SAMPLE INDEX")

TIME_UNITS: dict[str, float] = {
    **dict.fromkeys(("S", "SEC", "SECS", "SECOND", "SECONDS"), 1.0),
    **dict.fromkeys(("MS", "MSEC", "MILLISECONDS"), 1e-3),
    **dict.fromkeys(("US", "USEC", "MICROSECONDS"), 1e-6),
    **dict.fromkeys(("MIN", "MINUTE", "MINUTES"), 60.0),
    **dict.fromkeys(("H", "HR", "HRS", "HOUR", "HOURS"), 3600.0),
    **dict.fromkeys(("D", "DAY", "DAYS"), 86400.0),
}
"""Unit of a time column of numbers, in the header or in a units row -> seconds."""

FRACTION_UNITS = ("FRACTION", "FRAC", "0-1", "0..1", "0...1", "P.U.", "PU", "PER UNIT")
"""Units that say that OP is a fraction of span."""

MISSING_WORDS = ("", "NAN", "NA", "N/A", "#N/A", "NULL", "NONE", "-", "--", "?")
"""An empty cell, in the words of different programs."""

STATUS_TEXTS = (
    *("BAD", "BAD INPUT", "I/O TIMEOUT", "NO DATA", "SCAN OFF", "PT CREATED", "POINT CREATED", "SHUTDOWN"),
    *("COMM FAIL", "NOT CONNECTED", "CONFIGURE", "INTF SHUT", "UNDER RANGE", "OVER RANGE", "NO SAMPLE", "CALC FAILED"),
    *("UNCERTAIN", "QUESTIONABLE", "ARC OFF-LINE", "DOUBTFUL", "ERROR", "#VALUE!", "#REF!", "TRUE", "FALSE"),
)
"""Historian texts in the place of a number. Any other text counts as missing too; these tell data from header."""

GOOD_STATUS_WORDS = ("GOOD", "OK", "G", "VALID", "NORMAL")
"""Status of a good value; a number may be one as well (see `values.bad_values`)."""

BAD_STATUS_WORDS = ("BAD", "UNCERTAIN", "INVALID", "QUESTIONABLE", "DOUBTFUL", "SUSPECT")
"""How the status of a value that does not count begins."""

MODES: dict[str, bool] = {
    **dict.fromkeys(("AUTO", "AUT", "AUTOMATIC", "A", "CAS", "CASC", "CASCADE", "C", "RCAS", "RSP", "BCAS"), True),
    **dict.fromkeys(("1", "1.0", "TRUE", "ON", "YES", "CLOSED LOOP"), True),
    **dict.fromkeys(("MAN", "MANUAL", "M", "O", "S", "IMAN", "OOS", "O/S", "LO", "ROUT", "TRK", "INIT", "OFF"), False),
    **dict.fromkeys(("0", "0.0", "FALSE", "NO", "OPEN LOOP"), False),
}
"""Controller mode -> whether the controller moves the valve by itself."""

LOOP_TYPE_LETTERS = {"F": "flow", "L": "level", "P": "pressure", "T": "temperature", "A": "analyser"}
"""First letter of an ISA-5.1 tag -> loop type."""

# First letter, then difference/ratio/totalise, then what the instrument does, then alarm/safety/valve.
_FUNCTION_LETTERS = re.compile(r"(?<![A-Z])([FLPTA])[DFQ]?[ICRTY]{1,3}[AQSVZ]?(?![A-Z])")
_NUMBERED = re.compile(_FUNCTION_LETTERS.pattern + r"[-_ ]?[0-9]")
_TYPES_IN_WORDS = re.compile(r"(?<![A-Z])(FLOW|LEVEL|PRESSURE|TEMPERATURE)(?![A-Z])")


def loop_type_of(tag: str, *, numbered: bool = False) -> str:
    """Give the loop type that a tag names by ISA-5.1 letters or in one plain word, else "other".

    `numbered` accepts letters only when a number follows them, for a text that may be a word, such as a file name.

    Examples
    --------
    >>> loop_type_of("2111LIC23001"), loop_type_of("12-FC-135A"), loop_type_of("Tank level"), loop_type_of("CHEM1")
    ('level', 'flow', 'level', 'other')
    >>> loop_type_of("fit", numbered=True), loop_type_of("fic_101_june", numbered=True)
    ('other', 'flow')
    """
    if found := (_NUMBERED if numbered else _FUNCTION_LETTERS).search(tag.upper()):
        return LOOP_TYPE_LETTERS[found.group(1)]
    words = set(_TYPES_IN_WORDS.findall(tag.upper()))
    return words.pop().lower() if len(words) == 1 else "other"
