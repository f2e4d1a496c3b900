"""Damaged inputs of every format, drawn by a number, and the rules that reading each of them must keep.

``python tests/damaged_inputs.py 20000 [seed]`` reads so many and prints the seed.
"""

from __future__ import annotations

import gzip
import io
import math
import random
import signal
import sys
import tempfile
import time
import zipfile
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from unittest import mock

import numpy as np
import polars as pl

from stiction.errors import StictionError
from stiction.sources import read
from stiction.sources.formats import workbook_checks

N = 150
MAX_SECONDS = 5.0
TEXTS = ("a.csv", "a.txt", "long.csv", "utf16.csv")


@cache
def intact_files() -> dict[str, bytes]:
    """One loop, or two, as a file of each format."""
    import h5py
    import scipy.io
    import xlwt

    k = np.arange(N)
    rng = np.random.default_rng(3)
    pv = np.round(50.0 + 3.0 * np.sin(k / 9) + 0.1 * rng.normal(size=N), 3)
    op = np.round(40.0 + 4.0 * np.cos(k / 9) + 0.1 * rng.normal(size=N), 3)
    frame = pl.DataFrame({"Time_s": 2.0 * k, "FIC-1.PV": pv, "FIC-1.OP": op, "LIC-2.PV": pv + 1, "LIC-2.OP": op + 1})
    text = frame.write_csv().encode()
    rows = [f"FIC-1.{word},{2 * i},{x[i]},Good" for i in k for word, x in (("PV", pv), ("OP", op))]
    files = {
        "a.csv": text,
        "a.txt": frame.write_csv(separator="\t").replace(".", ",").encode("cp1252"),
        "long.csv": "\n".join(["Tag,Time_s,Value,Quality", *rows, ""]).encode(),
        "utf16.csv": text.decode().encode("utf-16"),
        "a.csv.gz": gzip.compress(text),
    }
    with io.BytesIO() as file:
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("a.csv", text)
        files["a.zip"] = file.getvalue()
    import zstandard

    files["a.csv.zst"] = zstandard.compress(text)
    for name, write in (("a.parquet", frame.write_parquet), ("a.feather", frame.write_ipc)):
        with io.BytesIO() as file:
            write(file)
            files[name] = file.getvalue()
    with io.BytesIO() as file:
        frame.write_excel(file)
        files["a.xlsx"] = file.getvalue()
    book = xlwt.Workbook()
    sheet = book.add_sheet("loops")
    for column, name in enumerate(frame.columns):
        sheet.write(0, column, name)
        for row, x in enumerate(frame[name]):
            sheet.write(row + 1, column, x)
    with io.BytesIO() as file:
        book.save(file)
        files["a.xls"] = file.getvalue()
    with io.BytesIO() as file:
        scipy.io.savemat(file, {"loop1": {"PV": pv, "OP": op, "Ts": 2.0}})
        files["a.mat"] = file.getvalue()
    with io.BytesIO() as file:
        with h5py.File(file, "w") as store:
            store.update({"loop1/PV": pv, "loop1/OP": op, "loop1/Ts": 2.0})
        files["v73.mat"] = file.getvalue()
    return files


def flip_bytes(data: bytes, rng: random.Random) -> bytes:
    damaged = bytearray(data)
    for _ in range(rng.choice((1, 3, 20, 200))):
        damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
    return bytes(damaged)


def truncate(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data))]


def lose_block(data: bytes, rng: random.Random) -> bytes:
    first = rng.randrange(len(data))
    return data[:first] + data[first + rng.randrange(1, 400) :]


def insert_block(data: bytes, rng: random.Random) -> bytes:
    first = rng.randrange(len(data))
    block = rng.choice((rng.randbytes(rng.randrange(1, 300)), b"\0" * 300, b'"', b"\n\n\n", data[:200]))
    return data[:first] + block + data[first:]


def shuffle_cells(data: bytes, rng: random.Random) -> bytes:
    lines = data.split(b"\n")
    for i in rng.sample(range(len(lines)), rng.choice((1, 5, len(lines)))):
        cells = lines[i].split(b",")
        rng.shuffle(cells)
        lines[i] = b",".join(cells)
    return b"\n".join(lines)


def mix_encodings(data: bytes, rng: random.Random) -> bytes:
    lines = data.decode("latin-1").split("\n")
    codes = ["utf-8", "utf-16-le", "utf-16-be", "cp037", "gb18030"]
    return b"\n".join(line.encode(rng.choice(codes) if rng.random() < 0.1 else "latin-1") for line in lines)


def bomb(data: bytes, rng: random.Random) -> bytes:
    """50 MB in a small file."""
    content = rng.choice((b"\0", b"1,2,3\n", b"\n", data[:64] or b" "))
    content = content * (50_000_000 // len(content))
    if rng.random() < 0.5:
        return gzip.compress(content, 1)
    with io.BytesIO() as file:
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            archive.writestr(rng.choice(("a.csv", "xl/workbook.xml", "../a.csv")), content)
        return file.getvalue()


def many_columns(data: bytes, rng: random.Random) -> bytes:
    names = rng.choice(("T{}.PV", "FIC{}.OP", "x{}", ""))
    header = ",".join(["time_s", *(names.format(i) for i in range(10_000))])
    return "\n".join([header, *(",".join([str(k), *["1.5"] * 10_000]) for k in range(12))]).encode()


def empty(data: bytes, rng: random.Random) -> bytes:
    return b""


def random_bytes(data: bytes, rng: random.Random) -> bytes:
    return rng.randbytes(rng.randrange(1, 4000))


DAMAGES = (flip_bytes, truncate, lose_block, insert_block, shuffle_cells, mix_encodings)
RARE_DAMAGES = (bomb, many_columns, empty, random_bytes)


@contextmanager
def time_limit(seconds: float):
    """Interrupt what hangs, where the system can."""

    def stop(*_: object) -> None:
        raise TimeoutError(f"still reading after {seconds} s")

    if not hasattr(signal, "setitimer"):
        yield
        return
    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def check_one(number: int) -> None:
    """Read the damaged input of this number; an error of any other kind than StictionError is a defect."""
    rng = random.Random(number)
    name, data = rng.choice(list(intact_files().items()))
    damage = rng.choice(DAMAGES if rng.random() < 0.97 else RARE_DAMAGES)
    damaged = damage(data, rng)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, name)
        path.write_bytes(damaged)
        began = time.process_time()
        records, message = [], "read"
        try:
            with time_limit(60 * MAX_SECONDS), mock.patch.object(workbook_checks, "MAX_TRIAL_BYTES", 1 << 30):
                records = read(path)
        except StictionError as error:
            message = str(error)
        used = time.process_time() - began
    assert message, "an error without a message"
    assert "\n" not in message, message
    assert used < MAX_SECONDS, f"{name}, {damage.__name__}: {used:.1f} s of processor time"
    if damage is truncate and name not in TEXTS:
        assert not records, f"{name} was cut off and read"
    if damage in (flip_bytes, shuffle_cells, mix_encodings) and name in TEXTS:
        for record in records:
            told = record.provenance.assumptions or record.provenance.bad_values
            assert told or np.isfinite(record.op).sum() >= N, f"{name} lost rows without a note"
    for record in records:
        assert math.isfinite(record.dt)


def main(count: int, seed: int) -> int:
    print(f"{count} damaged inputs, seed {seed}", flush=True)
    defects = 0
    for number in range(seed, seed + count):
        try:
            check_one(number)
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                raise
            defects += 1
            print(f"number {number}: {type(error).__name__}: {error}", flush=True)
    print(f"{defects} defects")
    return int(defects > 0)


if __name__ == "__main__":
    arguments = [int(word) for word in sys.argv[1:]]
    raise SystemExit(
        main(arguments[0] if arguments else 20_000, arguments[1] if len(arguments) > 1 else int(time.time()))
    )
