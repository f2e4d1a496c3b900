"""The codes by which each vendor says that a value is good, uncertain or bad: one row per scheme."""

from __future__ import annotations

from typing import Any, NamedTuple

__all__ = ["PERCENT_GOOD", "SCHEMES", "Scheme"]


class Scheme(NamedTuple):
    """The codes of one vendor or standard; of a number its bits under `mask` count."""

    name: str
    """What a note calls it."""
    words: tuple[str, ...]
    """Headings of the column, or of others beside it, that speak for the scheme."""
    good: tuple[Any, ...]
    """Texts in capitals (``BAD*`` for all that begin so), numbers, and ranges of numbers."""
    uncertain: tuple[Any, ...] = ()
    bad: tuple[Any, ...] = ()
    mask: int = -1
    """Bits of a number that tell."""
    numbers: range = range(-(2**31), 2**32)
    """Numbers that can be codes, before the mask."""
    needs_word: bool = False
    """Whether the scheme is meant only where a heading of the column says so."""
    needs_fault: bool = False
    """Whether only a code that is not good shows the scheme."""
    source: str = ""
    """Document that lists the codes."""


_FALSE, _TRUE = ("FALSE", "NO", "N", "F", "OFF", 0), ("TRUE", "YES", "Y", "T", "ON", 1)
_BYTE = range(256)

SCHEMES = (
    Scheme(
        "text", (),
        ("GOOD*", "OK", "VALID", "NORMAL", "GUT", "BON", "BONNE", "BUENO", "BUENA", "BUONO", "BOM", "RAW"),
        (
            "UNC*", "QUESTIONABLE*", "DOUBTFUL*", "SUSPECT*", "SUBSTITUTE*", "ESTIMATED*", "UNSICHER",
            "INCERTAIN", "INITIAL*", "?", "MANUAL ENTRY",
        ),
        (
            "BAD*", "INVALID*", "STALE*", "OLD", "HELD",
            "NO DATA*", "NODATA*", "NO SAMPLE*", "NO STATUS*", "NOT CONNECTED*",
            "TIMEOUT*",
            "I/O TIMEOUT*", "SCAN OFF*", "SCAN TIMEOUT*", "PT CREATED", "POINT CREATED", "SHUTDOWN*", "COMM FAIL*",
            "COMM_FAIL*", "COMMUNICATION*", "CONFIGURE*", "INTF SHUT*", "UNDER RANGE*", "OVER RANGE*", "OUT OF SERV*",
            "OUTOFSERV*", "CALC FAILED*", "ARC OFF*", "ERROR*", "FAIL*", "UNUSABLE*", "NOT GOOD*", "NOTGOOD*",
            "DISABLED", "OFFLINE", "DISCONNECT*", "SCHLECHT", "MAUVAIS*", "MALO", "MALA", "CATTIVO",
            "RUIM", "NO GOOD*", "NOT OK",
        ),
        source="OPC Unified Architecture Part 6 annex A, names; PI Server, system digital states",
    ),
    Scheme(
        "OPC DA", ("OPC QUALITY", "OPCQUALITY"), (range(192, 256),), (range(64, 128),), (range(64),), numbers=_BYTE,
        source="OPC Data Access 3.00, section 6.8",
    ),
    Scheme(
        "OPC HDA", ("OPC QUALITY", "OPCQUALITY", "HDA"), (0xC0,), (0x40,), (0,), mask=0xC0,
        numbers=range(0x10000, 0x1000000), source="OPC Historical Data Access 1.20, section 5.5",
    ),
    Scheme(
        "OPC UA or Ignition 8", ("STATUSCODE", "STATUS CODE"), (0,), (0x40000000,), (0x80000000,), mask=0xC0000000,
        needs_fault=True, source="OPC UA Part 4, section 7.39; Ignition 8 user manual, quality codes",
    ),
    Scheme(
        "Ignition 7", ("T_STAMP", "DATAINTEGRITY"), (192, 200), (range(64, 128), 256), (range(64), range(300, 1000)),
        source="Ignition 7.9 user manual, data quality",
    ),
    Scheme(
        "fieldbus, PCS 7, WinCC or DeltaV", ("QC", "QUALITYCODE", "ST", "VARNAME", "TIMESTRING"), (range(128, 256),),
        (range(64, 128),), (range(64),), numbers=_BYTE,
        source="FOUNDATION Fieldbus FF-890, status byte; PROFIBUS PA profile 3.02; PCS 7 quality codes",
    ),
    Scheme(
        "InSQL quality", ("QUALITYDETAIL", "QUALITY DETAIL", "WWRETRIEVALMODE"), (0, 133), (16,), (1,), numbers=_BYTE,
        source="AVEVA Historian concepts guide, Quality",
    ),
    Scheme(
        "InSQL quality detail", ("QUALITYDETAIL", "QUALITY DETAIL"),
        (44, 150, 151, range(192, 248), 248, 252), (16, range(64, 128)), (range(16), range(17, 44), range(45, 64), 249),
        mask=0xFF, numbers=range(0x10000), needs_word=True, source="AVEVA Historian concepts guide, QualityDetail",
    ),
    Scheme(
        "IP.21", ("IP_TREND_QSTATUS", "IP_TREND_QLEVEL", "QSTATUS", "QLEVEL"), (0, 4), (1, 5), (2, 6), numbers=range(8),
        source="Aspen InfoPlus.21 administration manual, quality levels (4: modified); OPC 30142, RioQuality (0 to 2)",
    ),
    Scheme(
        "PI status", ("ISTAT", "PISTATUS"), (0,), (), (range(-32768, 0),),
        source="PI Data Archive, system digital states",
    ),
    Scheme(
        "ioBroker", ("Q", "ACK", "_FROM"), (0,), (0x10, 0x20, 0x40, 0x80),
        (1, 2, *(high + low for high in (0x10, 0x40, 0x80) for low in (1, 2, 4))), numbers=_BYTE,
        source="ioBroker documentation, object schema, state quality",
    ),
    Scheme(
        "CENTUM", ("DATASTATUS", "DATA STATUS"),
        (
            "NR", "NORM", "CLP", "CLP+", "CLP-", "HI", "LO", "HH", "LL", "DV+", "DV-", "VEL+", "VEL-", "MHI", "MLO",
            "CND", "MNT", "MINT", "SINT", "SVPB", "TRK",
        ),
        ("QST",),
        (
            "BAD", "IOP", "IOP+", "IOP-", "OOP", "NCOM", "NRDY", "PTPF", "PFAL", "LPFL", "NEFV", "NFP", "O/S", "CAL",
            "CNF", "CERR", "CALC", "UNAK", "ERR",
        ),
        source="CENTUM VP reference, data status and alarm status",
    ),
    Scheme(
        "letters", (), ("G", "V", "A"), ("U", "Q", "S", "D", "E", "?"), ("B", "I", "X", "F", "M", "C"),
        source="PI DataLink, SCADA exports",
    ),
    Scheme(
        "marks at bad values", (), ("A",), ("*", "?", "!", "#", "S", "Q", "U", "E", "~"), ("B", "X", "I", "M", "**"),
        needs_fault=True, source="PI DataLink, display of substituted and questionable values",
    ),
    Scheme("Proficy", ("PROFICY", "IHISTORIAN"), (100,), (range(1, 100),), (0,), source="Proficy Historian, quality"),
    Scheme(
        "good flag", ("GOOD", "ISGOOD", "IS GOOD", "VALID", "ISVALID", "IS VALID"), (*_TRUE, "G"), (), (*_FALSE, "B"),
        source="PI Web API, value flags",
    ),
    Scheme(
        "doubt flag", ("QUESTIONABLE", "SUBSTITUTED"), _FALSE, _TRUE, (), needs_word=True,
        source="PI Web API, value flags",
    ),
    Scheme(
        "bad flag", ("BAD", "ISBAD", "IS BAD", "BAD FLAG", "INVALID"),
        (*_FALSE, "GOOD", "OK", "G", "VALID", "NORMAL"), (),
        (*_TRUE, "BAD", "INVALID", "B", "X", "*", range(2, 2**31), range(-(2**31), 0)), needs_word=True,
        source="data acquisition flags",
    ),
    Scheme("flag", (), _FALSE, (), _TRUE, source="data acquisition flags"),
)  # fmt: skip
"""The schemes; of two that read the codes alike the first is named."""

PERCENT_GOOD = ("CONFIDENCE", "PERCENTGOOD", "PERCENT GOOD", "PCTGOOD", "PCT GOOD", "GOODPERCENT", "%GOOD", "% GOOD")
"""Headings of a share of good data [%], or as a fraction: PHD confidence, percent good of averages."""
