"""Channels: a message is taken once; a channel that fails is tried again, delays no other, and is told."""

from __future__ import annotations

import asyncio
import json
import socketserver
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from stiction.errors import StictionError
from stiction.watch.alarm_rules import add_message
from stiction.watch.channels import send, send_due_messages
from stiction.watch.configuration import ChannelSettings, SourceSettings, WatchConfig
from stiction.watch.store import WatchStore

BODY = {"id": "a1b2", "event": "raised", "title": "FIC-101: Valve sticks", "text": "Why.\nNext step: Ramp OP."}


@pytest.fixture
def hook():
    """A web server that takes JSON, and refuses while `failing` is set."""
    taken: list[dict] = []

    class Handler(BaseHTTPRequestHandler):
        failing = False

        def do_POST(self) -> None:
            body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            if not Handler.failing:
                taken.append(body)
            self.send_response(500 if Handler.failing else 204)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            pass

    with HTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/hook?token=secret", taken, Handler
        server.shutdown()


class MailServer(socketserver.StreamRequestHandler):
    """Just enough of RFC 5321 to take one message."""

    def handle(self) -> None:
        self.wfile.write(b"220 plant\r\n")
        while line := self.rfile.readline():
            word = line[:4].upper()
            if word == b"DATA":
                self.wfile.write(b"354 go on\r\n")
                text = b""
                while (part := self.rfile.readline()) != b".\r\n":
                    text += part
                self.server.mails.append(text.decode())  # pyright: ignore
            self.wfile.write(b"221 bye\r\n" if word == b"QUIT" else b"250 ok\r\n")
            if word == b"QUIT":
                return


def make(tmp_path, *channels):
    return WatchStore(tmp_path), WatchConfig(source=(SourceSettings(address="data"),), channel=channels)


def test_a_webhook_gets_the_message_once(tmp_path, hook):
    url, taken, _ = hook
    store, config = make(tmp_path, ChannelSettings(kind="webhook", url=url))
    for _ in range(2):
        add_message(store, config, BODY)
        asyncio.run(send_due_messages(store, config))
    assert taken == [BODY]
    store.close()


def test_a_channel_that_fails_is_tried_again_later_and_delays_no_other(tmp_path, hook):
    url, taken, handler = hook
    handler.failing = True
    good = ChannelSettings(kind="webhook", url=url.replace("/hook", "/other"))
    store, config = make(tmp_path, ChannelSettings(kind="webhook", url="http://127.0.0.1:9/x?token=secret"), good)
    add_message(store, config, BODY)
    handler.failing = False
    assert asyncio.run(send_due_messages(store, config)) == 1
    assert taken == [BODY]
    [failed] = store.query("SELECT * FROM message WHERE sent IS NULL")
    assert failed["tries"] == 1
    assert "not taken" in failed["failure"]
    assert "secret" not in failed["failure"]
    assert asyncio.run(send_due_messages(store, config)) == 0  # not due yet
    store.change("UPDATE message SET due = 0")
    asyncio.run(send_due_messages(store, config))
    assert store.query("SELECT tries FROM message WHERE sent IS NULL") == [{"tries": 2}]
    store.close()


def test_a_mail_has_subject_text_and_the_identifier_of_the_alarm():
    with socketserver.TCPServer(("127.0.0.1", 0), MailServer) as server:
        server.mails = []  # pyright: ignore
        threading.Thread(target=server.serve_forever, daemon=True).start()
        host = f"127.0.0.1:{server.server_address[1]}"
        send(ChannelSettings(kind="smtp", host=host, sender="a@plant", to=("b@plant",), starttls=False), BODY)
        server.shutdown()
        [mail] = server.mails  # pyright: ignore
    assert "Subject: FIC-101: Valve sticks" in mail
    assert "To: b@plant" in mail
    assert "<a1b2.raised@stiction>" in mail
    assert "Next step: Ramp OP." in mail


def test_apprise_is_asked_and_its_failure_reported(hook):
    url, taken, handler = hook
    place = url.replace("http://", "json://")
    send(ChannelSettings(kind="apprise", url=place), BODY)
    assert taken[0]["title"] == BODY["title"]
    handler.failing = True
    with pytest.raises(StictionError, match="apprise could not send"):
        send(ChannelSettings(kind="apprise", url=place), BODY)


def test_the_digest_goes_only_where_it_is_asked_for(tmp_path):
    hooks = [
        ChannelSettings(kind="webhook", url=f"http://127.0.0.1:9/{what}", what=what)
        for what in ("alarms", "digest", "all")
    ]
    store, config = make(tmp_path, *hooks)
    add_message(store, config, BODY)
    add_message(store, config, BODY | {"event": "digest"})
    rows = store.query("SELECT channel, ident FROM message")
    assert sorted((one["channel"][0], one["ident"].split()[1]) for one in rows) == [
        ("0", "raised"), ("1", "digest"), ("2", "digest"), ("2", "raised"),
    ]  # fmt: skip
    store.close()
