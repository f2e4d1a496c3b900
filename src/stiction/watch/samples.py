"""Collected samples on their way to the records: appended to one file for each window, so that a kill loses seconds."""

from __future__ import annotations

import os
import zlib
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["SAMPLE", "SampleFiles", "window_name", "window_of"]

SAMPLE = np.dtype([("tag", "<i4"), ("text", "<i4"), ("status", "<u4"), ("stamp", "<i8"), ("value", "<f8")])
"""One value: number of its tag, number of its text or -1, OPC UA status, time [microseconds since 1970], value."""
HEAD = np.dtype([("mark", "<u4"), ("rows", "<u4"), ("check", "<u4")])
MARK = 0x53544B31
ENDING = ".samples"


def window_of(stamps: NDArray[np.int64], length_s: float) -> NDArray[np.int64]:
    """Start of the window of each time [microseconds since 1970]; windows begin at whole multiples of their length."""
    length = round(1e6 * length_s)
    return stamps // length * length


def window_name(start: int) -> str:
    """Name of a window by its start [microseconds since 1970].

    Examples
    --------
    >>> window_name(1_772_431_200_000_000)
    '20260302T060000Z'
    """
    return f"{datetime.fromtimestamp(start / 1e6, UTC):%Y%m%dT%H%M%SZ}"


class SampleFiles:
    """The files of the windows that are open. Rows may come in any order; they are sorted when a window is read."""

    def __init__(self, folder: Path, length_s: float) -> None:
        self.folder, self.length_s = folder, length_s

    def append(self, rows: NDArray, closed_before: int) -> int:
        """Append samples to the files of their windows, and give the number of those whose window is closed already."""
        starts = window_of(rows["stamp"], self.length_s)
        is_late = starts < closed_before
        for start in np.unique(starts[~is_late]):
            block = rows[starts == start].tobytes()
            head = np.array([(MARK, len(block) // SAMPLE.itemsize, zlib.crc32(block))], HEAD)
            with self._path(int(start)).open("ab") as file:
                file.write(head.tobytes() + block)
                file.flush()
                os.fsync(file.fileno())
        return int(is_late.sum())

    def windows(self) -> list[int]:
        """Starts of the windows that have samples, the earliest first."""
        names = [path.name.removesuffix(ENDING) for path in self.folder.glob(f"*{ENDING}")]
        stamps = [datetime.strptime(name, "%Y%m%dT%H%M%SZ").replace(tzinfo=UTC) for name in names]
        return sorted(round(1e6 * one.timestamp()) for one in stamps)

    def read(self, start: int) -> tuple[NDArray, int]:
        """Samples of a window, sorted by tag and time, and how many were there twice."""
        rows = self._blocks(self._path(start))
        rows = rows[np.lexsort((rows["stamp"], rows["tag"]))]
        is_double = np.zeros(rows.size, dtype=bool)
        if rows.size:
            same = [rows[name][1:] == rows[name][:-1] for name in ("tag", "stamp", "status", "text")]
            values = rows["value"]
            same.append((values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1])))
            is_double[1:] = np.logical_and.reduce(same)
        return rows[~is_double], int(is_double.sum())

    def delete(self, start: int) -> None:
        """Forget a window, whose records were written."""
        self._path(start).unlink(missing_ok=True)

    def last_stamps(self, n_tags: int) -> NDArray[np.int64]:
        """Newest time of each tag in all files, 0 where there is none [microseconds since 1970]."""
        last = np.zeros(n_tags, dtype=np.int64)
        for start in self.windows():
            rows = self._blocks(self._path(start))
            known = rows["tag"] < n_tags
            np.maximum.at(last, rows["tag"][known], rows["stamp"][known])
        return last

    def mend(self) -> None:
        """Cut what a killed process has left half written at the end of files."""
        for start in self.windows():
            path = self._path(start)
            length = self._sound_length(path.read_bytes())
            if length < path.stat().st_size:
                with path.open("r+b") as file:
                    file.truncate(length)

    def _path(self, start: int) -> Path:
        return self.folder / f"{window_name(start)}{ENDING}"

    def _blocks(self, path: Path) -> NDArray:
        if not path.is_file():
            return np.empty(0, SAMPLE)
        data = path.read_bytes()
        end, at, parts = self._sound_length(data), 0, [np.empty(0, SAMPLE)]
        while at < end:
            rows = int(np.frombuffer(data, HEAD, 1, at)["rows"][0])
            at += HEAD.itemsize
            parts.append(np.frombuffer(data, SAMPLE, rows, at))
            at += rows * SAMPLE.itemsize
        return np.concatenate(parts)

    @staticmethod
    def _sound_length(data: bytes) -> int:
        """Bytes up to which all blocks are whole [bytes]."""
        at = 0
        while at + HEAD.itemsize <= len(data):
            mark, rows, check = np.frombuffer(data, HEAD, 1, at)[0]
            end = at + HEAD.itemsize + int(rows) * SAMPLE.itemsize
            if mark != MARK or end > len(data) or zlib.crc32(data[at + HEAD.itemsize : end]) != check:
                break
            at = end
        return at
