"""The security rules of `stiction serve`: each test fails when its rule is removed."""

from __future__ import annotations

import base64
import gzip
import http.client
import io
import os
import re
import socket
import struct
import zipfile
from pathlib import Path

import pytest

from apps.web.running import run_apart

HOSTILE_NAME = "..%2F..%2Fetc%2F%3Cimg%20src=x%20onerror=alert(1)%3E.csv"
LOOP = "time_s,FIC-1.PV,FIC-1.OP\n" + "\n".join(f"{k},{50 + k % 5},{40 + k % 7}" for k in range(200))


def test_only_the_loopback_address_is_open(server):
    others = {info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)}
    for address in others - {"127.0.0.1"}:
        with pytest.raises(OSError), socket.create_connection((address, server.port), timeout=2):
            pass
    table = Path("/proc/net/tcp")
    listening = [line.split() for line in table.read_text().splitlines()] if table.exists() else []
    mine = [line[1] for line in listening if line[1].endswith(f":{server.port:04X}") and line[3] == "0A"]
    assert all(one.startswith("0100007F") for one in mine)


def test_health_needs_no_token_and_tells_nothing_else(server):
    answer = server.send("GET", "/healthz")
    assert (answer.status, answer.body) == (200, b"ok")


@pytest.mark.parametrize("path", ["/healthz", "/", "/static/js/app.js", "/api/sets"])
@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "evil.example:{port}", "127.0.0.1.evil.example:{port}"])
def test_foreign_host_is_refused(server, path, host):
    assert server.send("GET", path, headers={"Host": host.format(port=server.port)}).status == 403


def test_localhost_is_ours(server):
    assert server.send("GET", "/healthz", headers={"Host": f"localhost:{server.port}"}).status == 200


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:1", "https://127.0.0.1:{port}"])
def test_foreign_origin_is_refused(server, origin):
    server.sign_in()
    headers = {"Origin": origin.format(port=server.port), "Cookie": server.cookie, "X-Stiction": "1"}
    assert server.send("GET", "/api/sets", headers=headers).status == 403
    assert server.send("POST", "/api/map", {"rows": []}, headers).status == 403


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_request_from_another_site_is_refused(server, site):
    server.sign_in()
    headers = {"Sec-Fetch-Site": site, "Cookie": server.cookie}
    assert server.send("GET", "/api/sets", headers=headers).status == 403


@pytest.mark.parametrize(
    "path", ["/api/sets", "/api/readings", "/api/start", "/api/whatif/options", "/api/no-such-thing"]
)
def test_data_need_the_cookie(server, path):
    assert server.send("GET", path).status == 401
    name = f"stiction-{server.port}"
    assert server.send("GET", path, headers={"Cookie": f"{name}=wrong"}).status == 401
    assert server.send("GET", path, headers={"Cookie": f"{name}={server.token}"}).status == 401


def test_wrong_token_is_refused_in_words(server):
    answer = server.send("POST", "/api/session", {"token": "x" * 32}, {"X-Stiction": "1"})
    assert answer.status == 403
    assert "earlier run" in answer.json["error"]
    assert "set-cookie" not in answer.headers


def test_cookie_is_strict_and_hidden_from_scripts(server):
    answer = server.send("POST", "/api/session", {"token": server.token}, {"X-Stiction": "1"})
    attributes = {part.strip().lower() for part in answer.headers["set-cookie"].split(";")[1:]}
    assert {"httponly", "samesite=strict"} <= attributes
    assert server.token not in answer.headers["set-cookie"]


@pytest.mark.parametrize(
    ("method", "path"), [("POST", "/api/map"), ("PUT", "/api/files?name=a.csv"), ("DELETE", "/api/files/1")]
)
def test_changes_need_our_header(server, method, path):
    server.sign_in()
    body = {"rows": []}
    assert server.send(method, path, body, {"Cookie": server.cookie, "Content-Type": "text/plain"}).status == 403


def test_session_needs_our_header(server):
    assert server.send("POST", "/api/session", {"token": server.token}).status == 403


@pytest.mark.parametrize(
    "path", ["/", "/healthz", "/static/js/app.js", "/api/sets", "/api/nothing", "/static/../app.py", "/nothing"]
)
def test_every_answer_has_the_security_headers(server, path):
    headers = server.send("GET", path).headers
    policy = headers["content-security-policy"]
    assert "default-src 'self'" in policy
    assert "unsafe" not in policy
    for part in ("object-src 'none'", "base-uri 'none'", "form-action 'self'", "frame-ancestors 'none'"):
        assert part in policy
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cross-origin-opener-policy"] == headers["cross-origin-resource-policy"] == "same-origin"
    assert headers["cache-control"] == "no-store"
    assert "server" not in headers


def handshake(server, **headers: str) -> int:
    """Status of a WebSocket handshake; 101 opens it."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=20)
    usual = {
        "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": base64.b64encode(os.urandom(16)).decode(), "Cookie": server.cookie,
        "Origin": f"http://127.0.0.1:{server.port}",
    }  # fmt: skip
    sent = {name: value for name, value in {**usual, **headers}.items() if value}
    connection.request("GET", "/api/whatif/socket", headers=sent)
    status = connection.getresponse().status
    connection.close()
    return status


def test_websocket_of_our_page_opens(server):
    server.sign_in()
    assert handshake(server) == 101


@pytest.mark.parametrize(
    "headers",
    [{"Origin": "http://evil.example"}, {"Origin": ""}, {"Host": "evil.example"}, {"Cookie": ""}, {"Cookie": "a=b"}],
    ids=str,
)
def test_websocket_of_another_page_is_refused(server, headers):
    server.sign_in()
    assert handshake(server, **headers) in (401, 403)


@pytest.mark.parametrize(
    "path",
    [
        "/static/../app.py", "/static/%2e%2e/app.py", "/static/..%2fapp.py", "/static/js/..%5c..%5capp.py",
        "/static//etc/passwd", "/static/%00", "/etc/passwd",
    ],
)  # fmt: skip
def test_no_path_leads_out_of_the_static_folder(server, path):
    answer = server.call("GET", path)
    assert answer.status in (400, 404)
    assert b"root:" not in answer.body


@pytest.mark.parametrize("path", ["/api/readings/..%2f1", "/api/sets/..%2f..%2fetc/rows", "/api/sets/session/loops/-1"])
def test_ids_are_keys_of_a_table_and_no_paths(server, path):
    assert server.call("GET", path).status in (400, 404)


def test_upload_keeps_its_name_for_show_alone(server):
    answer = server.call("PUT", f"/api/files?name={HOSTILE_NAME}", LOOP.encode())
    assert answer.status == 201
    assert answer.json["name"] == "etc/<img src=x onerror=alert(1)>.csv"
    assert answer.json["id"].isdecimal()


def test_upload_is_counted_while_it_streams(serve, monkeypatch, tmp_path):
    """A body without a length is refused at the limit; nothing of it is kept."""
    from stiction.apps.web.uploads import Uploads

    folder = tmp_path / "uploads"
    folder.mkdir()
    uploads = Uploads(folder, max_file_bytes=1000, max_total_bytes=1500)
    sent = 0

    class Request:
        async def stream(self):
            nonlocal sent
            for _ in range(100):
                sent += 100
                yield bytes(100)

    from starlette.exceptions import HTTPException

    with pytest.raises(HTTPException) as refusal:
        run_apart(uploads.receive(Request(), "large.csv"))
    assert refusal.value.status_code == 413
    assert sent <= 1200
    assert list(folder.iterdir()) == []
    assert uploads.total_bytes == 0


def test_uploads_are_limited_together(tmp_path):
    from starlette.exceptions import HTTPException

    from stiction.apps.web.uploads import Uploads

    uploads = Uploads(tmp_path, max_file_bytes=1000, max_total_bytes=1500, max_files=3)

    class Request:
        async def stream(self):
            yield bytes(900)

    run_apart(uploads.receive(Request(), "a.csv"))
    with pytest.raises(HTTPException, match="together"):
        run_apart(uploads.receive(Request(), "b.csv"))
    assert len(list(tmp_path.iterdir())) == 1


def test_number_of_uploads_is_limited(tmp_path):
    from starlette.exceptions import HTTPException

    from stiction.apps.web.uploads import Uploads

    class Request:
        async def stream(self):
            yield b"x"

    uploads = Uploads(tmp_path, max_files=2)
    for _ in range(2):
        run_apart(uploads.receive(Request(), "a.csv"))
    with pytest.raises(HTTPException, match="At most 2 files can be uploaded"):
        run_apart(uploads.receive(Request(), "a.csv"))


def bomb(kind: str) -> bytes:
    """A small file that expands to 400 MB of zeros."""
    zeros = bytes(4_000_000)
    if kind == "gz":
        packed = io.BytesIO()
        with gzip.GzipFile(fileobj=packed, mode="wb") as file:
            for _ in range(100):
                file.write(zeros)
        return packed.getvalue()
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("a.csv", "w") as file:
        for _ in range(100):
            file.write(zeros)
    return packed.getvalue()


@pytest.mark.parametrize("kind", ["gz", "zip"])
def test_expanded_size_is_limited(server, kind):
    content = bomb(kind)
    assert len(content) < 1_000_000
    file = server.call("PUT", f"/api/files?name=bomb.csv.{kind}", content).json["id"]
    reading = server.call("POST", "/api/readings", {"files": [file]}).json["id"]
    found = server.wait_for(f"/api/readings/{reading}", lambda one: not one["running"])
    assert re.search(r"times|limit|larger|expands", found["error"])


def test_pickle_is_not_opened(server):
    import pickle

    class Evil:
        def __reduce__(self):
            return (os.system, ("touch /tmp/stiction-was-here",))

    file = server.call("PUT", "/api/files?name=a.pkl", pickle.dumps(Evil())).json["id"]
    reading = server.call("POST", "/api/readings", {"files": [file]}).json["id"]
    found = server.wait_for(f"/api/readings/{reading}", lambda one: not one["running"])
    assert found["error"]
    assert not os.path.exists("/tmp/stiction-was-here")


def test_errors_name_no_folder(server):
    file = server.call("PUT", "/api/files?name=a.csv", b"a,b\n1,2\n").json["id"]
    reading = server.call("POST", "/api/readings", {"files": [file]}).json["id"]
    found = server.wait_for(f"/api/readings/{reading}", lambda one: not one["running"])
    assert found["error"].startswith("a.csv")
    assert "/tmp" not in found["error"]
    rows = [{"tag": "a", "loop": "L", "role": "pv"}, {"tag": "b", "loop": "L", "role": "pv"}]
    corrected = server.call("POST", f"/api/readings/{reading}", {"rows": rows}).json
    assert "already" in corrected["error"]
    assert "/" not in corrected["error"].replace("m3/h", "")


def test_large_json_is_refused(server):
    assert server.call("POST", "/api/map", b'{"rows":[' + b" " * 3_000_000 + b"]}").status == 413


def test_large_message_closes_the_socket(server):
    server.sign_in()
    with socket.create_connection(("127.0.0.1", server.port), timeout=20) as wire:
        key = base64.b64encode(os.urandom(16)).decode()
        wire.sendall(
            f"GET /api/whatif/socket HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nUpgrade: websocket\r\n"
            f"Connection: Upgrade\r\nSec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
            f"Origin: http://127.0.0.1:{server.port}\r\nCookie: {server.cookie}\r\n\r\n".encode()
        )
        assert b"101" in wire.recv(4096).split(b"\r\n")[0]
        size = 300_000
        wire.sendall(b"\x81\xff" + struct.pack(">Q", size) + bytes(4) + bytes(1000))
        received = b""
        while chunk := wire.recv(4096):
            received += chunk
        assert struct.pack(">H", 1009) in received


def test_csv_export_neutralises_formulas(server):
    columns = [{"name": "Loop", "type": "text"}, {"name": "S", "type": "number"}]
    rows = [["=HYPERLINK(1)", 1.5], ["@x", -2.0], ["+a", None], ["-b", 0.0], ["FIC-1", 3.0]]
    text = server.call("POST", "/api/export", {"format": "csv", "columns": columns, "rows": rows}).body.decode()
    assert text.splitlines()[1:] == ["'=HYPERLINK(1),1.5", "'@x,-2.0", "'+a,", "'-b,0.0", "FIC-1,3.0"]


def test_folder_on_the_command_line_is_not_left_by_links(tmp_path):
    from stiction.apps.web.served_sources import find_sources

    secret = tmp_path / "secret.csv"
    secret.write_text(LOOP)
    folder = tmp_path / "exports"
    folder.mkdir()
    (folder / "own.csv").write_text(LOOP)
    (folder / "link.csv").symlink_to(secret)
    assert [name for _, name in find_sources([str(folder)]).files] == ["own.csv"]


def test_scripts_make_no_markup_from_text():
    """Tags of a plant go into the page as text: no script parses markup or code."""
    from apps.web.running import ASSETS

    scripts = list(ASSETS.parents[1].glob("js/*.js"))
    assert len(scripts) > 5
    forbidden = re.compile(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function|DOMParser")
    assert [path.name for path in scripts if forbidden.search(path.read_text(encoding="utf-8"))] == []
    pages = [path.read_text(encoding="utf-8") for path in ASSETS.parents[1].glob("*.html")]
    assert not [page for page in pages if re.search(r"<script(?![^>]*src=)|\son\w+=|style=|https?://", page)]
