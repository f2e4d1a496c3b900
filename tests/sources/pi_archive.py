"""A PI Web API for tests, written from AVEVA's documentation: limits, paging, digital states, errors inside 207."""

from __future__ import annotations

import json
import re
import threading
import time
from collections import Counter
from datetime import UTC, datetime, timedelta
from fnmatch import fnmatchcase
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, unquote, urlsplit

if TYPE_CHECKING:
    import ssl

START = datetime(2026, 3, 2, 6, 0, tzinfo=UTC)
MAX_ITEMS = 150_000
"""Values that one answer may hold; beyond it the API answers with 400."""


class PiArchive:
    """Points with values, served by HTTP on this machine."""

    def __init__(self, tls: ssl.SSLContext | None = None) -> None:
        self.points: dict[str, dict] = {}
        self.items: dict[str, list[str]] = {}
        """Name -> values as JSON texts, in the order of time."""
        self.times: dict[str, list[str]] = {}
        self.broken: dict[str, str] = {}
        """Name -> what the archive says instead of values."""
        self.failures: list[int] = []
        """Status codes that the next requests get."""
        self.requests: list[tuple[str, str]] = []
        self.user = ""
        self.delay_s = 0.0
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(self))
        if tls is not None:
            self._server.socket = tls.wrap_socket(self._server.socket, server_side=True)
        self.url = f"pi+http{'s' if tls else ''}://127.0.0.1:{self._server.server_port}/piwebapi"

    def __enter__(self) -> PiArchive:
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._server.server_close()

    def add(self, name: str, values, *, seconds=None, unit="", zero=0.0, span=100.0, flags=None) -> None:
        """Add a point; `values` are numbers, texts or dicts, `flags` index -> fields of the item."""
        web_id = f"F1DP{len(self.points):06d}{'x' * 40}"
        point = {"WebId": web_id, "Name": name, "Descriptor": f"Descriptor of {name}", "EngineeringUnits": unit}
        self.points[name] = point | {"Zero": zero, "Span": span, "Path": rf"\\ARCHIVE\{name}"}
        moments = range(len(values)) if seconds is None else seconds
        # PI gives seven decimals of a second
        self.times[name] = [(START + timedelta(seconds=float(k))).strftime("%Y-%m-%dT%H:%M:%S.%f0Z") for k in moments]
        plain = {"UnitsAbbreviation": "", "Good": True, "Questionable": False, "Substituted": False, "Annotated": False}
        self.items[name] = [
            json.dumps({"Timestamp": stamp, "Value": value, **plain, **(flags or {}).get(k, {})})
            for k, (stamp, value) in enumerate(zip(self.times[name], values, strict=True))
        ]

    def answer(self, path: str, query: list[tuple[str, str]]) -> tuple[int, str]:
        """Status and body of a GET."""
        if self.failures:
            status = self.failures.pop(0)
            return status, json.dumps({"Errors": [f"failure {status}"]})
        known = dict(query)
        if path == "/piwebapi/dataservers":
            return 200, json.dumps({"Items": [{"Name": "ARCHIVE", "WebId": "F1DSArchive"}]})
        if path == "/piwebapi/dataservers/F1DSArchive/points":
            pattern, first = known["nameFilter"].casefold(), int(known.get("startIndex", 0))
            found = [one for name, one in self.points.items() if fnmatchcase(name.casefold(), pattern)]
            return 200, json.dumps({"Items": found[first : first + min(1000, int(known.get("maxCount", 1000)))]})
        if path == "/piwebapi/points/multiple":
            by_path = {one["Path"].casefold(): one for one in self.points.values()}
            items = []
            for key, value in query:
                if key == "path":
                    point = by_path.get(value.casefold())
                    error = {"Errors": [f"PI Point not found '{value}'."]}
                    items.append({"Identifier": value, "Object": point, "Exception": None if point else error})
            return 200 if all(one["Object"] for one in items) else 207, json.dumps({"Items": items})
        if path == "/piwebapi/streamsets/recorded":
            return self._recorded(query)
        if path == "/piwebapi/streamsets/recordedattime":
            assert known["retrievalMode"] == "AtOrBefore"
            names = {one["WebId"]: name for name, one in self.points.items()}
            items = []
            for web_id in (value for key, value in query if key == "webId"):
                last = _index(self.times[names[web_id]], _seconds(known["time"]))
                state = {"Name": "No Data", "Value": 248, "IsSystem": True}
                none = {"Timestamp": known["time"], "Value": state, "Good": False}
                stored = json.loads(self.items[names[web_id]][last - 1]) if last else none
                items.append({"WebId": web_id, "Value": stored})
            return 200, json.dumps({"Items": items})
        return 404, json.dumps({"Message": f"No HTTP resource was found that matches '{path}'."})

    def _recorded(self, query: list[tuple[str, str]]) -> tuple[int, str]:
        known, ids = dict(query), [value for key, value in query if key == "webId"]
        most = int(known.get("maxCount", 1000))
        if most * len(ids) > MAX_ITEMS:
            return 400, json.dumps({"Errors": [f"The requested items exceed the maximum of {MAX_ITEMS}."]})
        assert known["boundaryType"] == "Inside"
        assert "selectedFields" in known
        names = {one["WebId"]: name for name, one in self.points.items()}
        status, items = 200, []
        for web_id in ids:
            name = names[web_id]
            head = f'{{"WebId":"{web_id}","Name":"{name}"'
            if name in self.broken:
                status = 207
                items.append(head + f',"Errors":[{{"FieldName":"Point","Message":["{self.broken[name]}"]}}]}}')
                continue
            low, high = _seconds(known["startTime"]), _seconds(known["endTime"])
            first, last = (_index(self.times[name], moment) for moment in (low, high))
            body = ",".join(self.items[name][first : min(last, first + most)])
            items.append(f'{head},"Items":[{body}]}}')
        return status, f'{{"Items":[{",".join(items)}]}}'


def _seconds(stamp: str) -> str:
    return re.sub(r"(\.\d{6})\d*Z", r"\g<1>0Z", stamp)


def _index(times: list[str], moment: str) -> int:
    from bisect import bisect_left

    return bisect_left(times, moment)


def _handler(archive: PiArchive) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self) -> None:
            parts = urlsplit(self.path)
            archive.requests.append(("GET", unquote(parts.path)))
            time.sleep(archive.delay_s)
            if len(self.path) > 2048:
                status, body = 414, json.dumps({"Message": "too long"})
            elif archive.user and self.headers.get("Authorization") != archive.user:
                status, body = 401, json.dumps({"Message": "Authorization has been denied for this request."})
            else:
                status, body = archive.answer(parts.path, parse_qsl(parts.query))
            self._send(status, body)

        def _refuse(self) -> None:
            archive.requests.append((self.command, self.path))
            self._send(405, "{}")

        do_POST = do_PUT = do_PATCH = do_DELETE = _refuse

        def _send(self, status: int, body: str) -> None:
            data = body.encode()
            self.send_response(status)
            self.send_header("Content-Type", "application/json; charset=utf-8")
            self.send_header("Content-Length", str(len(data)))
            self.end_headers()
            self.wfile.write(data)

        def log_message(self, *_: object) -> None:
            pass

    return Handler


def count_methods(requests: list[tuple[str, str]]) -> Counter[str]:
    return Counter(method for method, _ in requests)
