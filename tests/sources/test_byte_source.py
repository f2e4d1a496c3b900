"""Files, streams and archives: what is decompressed, what is refused, and that nothing stays behind."""

from __future__ import annotations

import contextlib
import gzip
import hashlib
import io
import os
import pickle
import subprocess
import sys
import tempfile
import threading
import zipfile

import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st

from stiction.errors import RecordError
from stiction.fleet.source_parts import SourcePart
from stiction.scratch import OWNER_LOCK, RUN_VARIABLE
from stiction.sources.byte_source import HEAD_BYTES, open_sources
from stiction.sources.options import ReadOptions
from stiction.sources.read import read

TEXT = b"time_s,PV,OP\n" + b"".join(b"%d,%d,%d\n" % (k, 50 + k % 7, k * k % 101) for k in range(3000))
ZEROS = b"0" * 50_000_000


def make_zip(**members):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return file.getvalue()


def zstd(data):
    return zstandard.ZstdCompressor(write_checksum=True).compress(data)


def opened(data, **options):
    return open_sources(io.BytesIO(data), ReadOptions(**options))


@pytest.fixture
def scratch(tmp_path, monkeypatch):
    """The folder of temporary files, with a run folder of its own; it must hold no files but its lock at the end."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv(RUN_VARIABLE, "")
    yield tmp_path
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] in ([], [OWNER_LOCK])


@pytest.mark.parametrize(
    "pack",
    [
        bytes,
        gzip.compress,
        zstd,
        lambda data: make_zip(**{"a/FIC-1.csv": data}),
        lambda data: zstd(data[:99]) + zstd(data[99:]),
    ],
    ids=["plain", "gz", "zst", "zip", "two zst frames"],
)
def test_the_bytes_come_out_as_they_were_packed(pack, scratch):
    data = pack(TEXT)
    [source] = opened(data)
    assert source.path.read_bytes() == TEXT
    assert (source.head, source.size) == (TEXT[:HEAD_BYTES], len(TEXT))
    assert source.origin.sha256 == hashlib.sha256(data).hexdigest()
    source.scratch.delete()


@pytest.mark.parametrize(
    ("name", "pack", "stem"),
    [
        ("FIC-1.csv", bytes, "FIC-1"),
        ("FIC-1.csv.gz", gzip.compress, "FIC-1"),
        ("FIC-1.week.csv.zst", zstd, "FIC-1.week"),
    ],
)
def test_a_path_is_read_where_it_is(name, pack, stem, tmp_path):
    path = tmp_path / name
    path.write_bytes(pack(TEXT))
    source = open_sources(path, ReadOptions())[0]
    assert (source.origin.name, source.origin.stem) == (str(path), stem)
    assert source.path.read_bytes() == TEXT
    assert (source.path == path) == (pack is bytes)
    source.scratch.delete()
    assert [file.name for file in tmp_path.iterdir()] == [name]  # nothing is written beside the source


def test_an_archive_of_several_files_gives_each(scratch):
    data = make_zip(
        **{"x/FIC-1.csv": TEXT, "x/": b"", "FIC-2.csv.gz": gzip.compress(TEXT), "__MACOSX/._a": b"1", ".DS_Store": b"1"}
    )
    sources = opened(data)
    assert [(source.origin.name, source.origin.stem) for source in sources] == [
        ("stream/x/FIC-1.csv", "FIC-1"),
        ("stream/FIC-2.csv.gz", "FIC-2"),
    ]
    assert all(source.path.read_bytes() == TEXT for source in sources)
    for source in sources:
        source.scratch.delete()


def test_a_workbook_is_not_unpacked(scratch):
    data = make_zip(**{"[Content_Types].xml": b"<x/>", "xl/workbook.xml": b"<x/>"})
    [source] = opened(data)
    assert source.path.read_bytes() == data
    source.scratch.delete()


def encrypted_zip():
    data = bytearray(make_zip(a=TEXT))
    data[data.index(b"PK\x01\x02") + 8] |= 1
    return bytes(data)


REFUSED = {
    "empty": (b"", "is empty; export"),
    "blank": (b" \n\t\r\n", "is empty; export"),
    "empty gz": (gzip.compress(b"\n"), "is empty; export"),
    "empty zip": (make_zip(), "zip archive of 0 files"),
    "zip of a folder": (make_zip(**{"a/": b""}), "zip archive of 0 files"),
    "zip in a zip": (make_zip(a=make_zip(b=TEXT)), "archive within an archive"),
    "encrypted": (encrypted_zip(), "is encrypted; unpack it with its password"),
    "cut gz": (gzip.compress(TEXT)[:-20], "is damaged or cut off"),
    "cut zst": (zstd(TEXT)[:-20], "is damaged or cut off"),
    "cut zip": (make_zip(a=TEXT)[:-40], "is damaged or cut off"),
    "PDF": (b"%PDF-1.7\n" + TEXT, "is a PDF document; export the trend as CSV"),
    "program": (b"\x7fELF" + bytes(100), "is a program"),
    "picture": (b"\x89PNG\r\n" + bytes(100), "is a picture"),
    "web page": (b"\n<!DOCTYPE html><html></html>", "is an HTML page"),
    "pickle": (pickle.dumps([1.0, 2.0]), "is a Python pickle, which may run code"),
    "packed pickle": (gzip.compress(pickle.dumps([1.0, 2.0])), "is a Python pickle, which may run code"),
    "gz of zeros": (gzip.compress(ZEROS), "decompresses to more than 200 times its size"),
    "zst of zeros": (zstd(ZEROS), "decompresses to more than 200 times its size"),
    "zip of zeros": (make_zip(a=ZEROS), "decompresses to more than 200 times its size"),
    "workbook of zeros": (
        make_zip(**{"[Content_Types].xml": b"<x/>", "xl/a": ZEROS}),
        "decompresses to more than 200 times its size",
    ),
    "zeros": (bytes(100_000), "begins with zeros only"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_record_is_refused_and_leaves_no_file(case, scratch):
    data, message = REFUSED[case]
    with pytest.raises(RecordError, match=f"^stream[^\n]*{message}") as caught:
        opened(data)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("pack", [bytes, gzip.compress, zstd, lambda data: make_zip(a=data)])
def test_the_limit_is_on_the_size_after_decompression(pack, scratch):
    with pytest.raises(RecordError, match=r"is larger than 0.03 MB.*\(0.0\d+ MB so far\).*max_bytes"):
        opened(pack(TEXT), max_bytes=30_000)
    [source] = opened(pack(TEXT), max_bytes=len(TEXT))
    source.scratch.delete()


class Endless(io.RawIOBase):
    """A stream without end that counts what was taken from it."""

    def __init__(self, pattern: bytes) -> None:
        self.pattern, self.taken = pattern, 0

    def read(self, size: int = -1) -> bytes:
        assert size > 0, "an endless stream was read whole"
        self.taken += size
        return (self.pattern * (size // len(self.pattern) + 1))[:size]


@pytest.mark.parametrize(
    ("pattern", "message"), [(b"\0", "begins with zeros only"), (b"1,2,3,4\n", "larger than 9 MB")]
)
def test_an_endless_stream_is_refused(pattern, message, scratch):
    stream = Endless(pattern)
    with pytest.raises(RecordError, match=message):
        open_sources(stream, ReadOptions(max_bytes=9_000_000))  # type: ignore[arg-type]
    assert stream.taken <= 11_000_000


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a named pipe")
def test_a_named_pipe_is_read_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    writer = threading.Thread(target=(tmp_path / "pipe.csv").write_bytes, args=(TEXT,))
    writer.start()
    source = open_sources(tmp_path / "pipe.csv", ReadOptions())[0]
    writer.join()
    assert (source.origin.stem, source.path.read_bytes()) == ("pipe", TEXT)


def test_bad_paths(tmp_path):
    for path, message in (
        (tmp_path / "nothing.csv", "no such file; check"),
        (tmp_path, "is a folder; give a file in it"),
        ("a\0b", "cannot be read"),
        (5, "cannot read an object of type int"),
        (io.StringIO("time_s,PV,OP\n"), "opened as text; open it with mode 'rb'"),
    ):
        with pytest.raises(RecordError, match=message):
            open_sources(path, ReadOptions())  # type: ignore[arg-type]


def test_standard_input():
    code = (
        "from stiction.sources.byte_source import open_sources; from stiction.sources.options import ReadOptions;"
        "s = open_sources('-', ReadOptions())[0]; print(s.origin.name, s.origin.stem, s.size)"
    )
    done = subprocess.run([sys.executable, "-c", code], input=gzip.compress(TEXT), capture_output=True, check=True)
    assert done.stdout.decode().split() == ["stdin", "stdin", str(len(TEXT))]


@settings(deadline=None, max_examples=60)
@given(
    pack=st.sampled_from([gzip.compress, zstd, lambda data: make_zip(a=data)]),
    place=st.floats(0.0, 1.0, exclude_max=True),
    flip=st.integers(1, 255),
    cut=st.booleans(),
)
def test_a_damaged_archive_is_refused_or_gives_the_bytes(pack, place, flip, cut):
    data = bytearray(pack(TEXT))
    at = int(place * len(data))
    if cut:
        del data[at:]
    else:
        data[at] ^= flip
    with contextlib.suppress(RecordError):
        sources = opened(bytes(data))
        if data[:2] in (b"\x1f\x8b", b"\x28\xb5") and sources[0].path.read_bytes() != bytes(data):
            assert sources[0].path.read_bytes() == TEXT
        for source in sources:
            source.scratch.delete()


@pytest.mark.skipif(sys.platform != "linux", reason="file names are bytes only there")
def test_file_whose_name_is_not_utf8_is_read(tmp_path):
    lines = ["time_s,pv,op", *(f"{k},{50 + k % 5},{40 + k % 7}" for k in range(60))]
    path = os.fsdecode(os.fsencode(tmp_path) + b"/K\xfchlung.csv")
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(lines))
    for source in (path, tmp_path):
        [record] = read(source)
        assert len(record) == 60
        assert record.tag == r"K\xfchlung"
        assert record.provenance.source.encode().endswith(rb"K\xfchlung.csv")


def test_part_of_an_audit_shows_a_name_that_is_not_utf8():
    name = b"K\xfchlung.csv".decode("utf-8", "surrogateescape")
    assert SourcePart((name,), "{}").display_name == r"K\xfchlung.csv"
