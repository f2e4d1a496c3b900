"""Send messages to webhooks, mail servers and apprise. A channel that fails is tried again and delays nothing."""

from __future__ import annotations

import asyncio
import json
import smtplib
import time
import urllib.request
from email.message import EmailMessage
from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError, StictionError, import_extra
from stiction.sources.historians.credentials import find_credentials

if TYPE_CHECKING:
    from stiction.watch.configuration import ChannelSettings, WatchConfig
    from stiction.watch.store import WatchStore

__all__ = ["send", "send_due_messages"]

TIMEOUT_S = 20.0
"""Time for an answer of a channel [s]."""
WAITS_S = (5.0, 15.0, 60.0, 300.0, 900.0)
"""Times after which a message is tried again [s]; the last one for all further tries."""


def send(channel: ChannelSettings, body: dict[str, Any]) -> None:
    """Send a message.

    Raises
    ------
    StictionError
        When the channel does not take it; the message has no secret.
    """
    try:
        if channel.kind == "webhook":
            _post(channel.expand(channel.url), body)
        elif channel.kind == "smtp":
            _mail(channel, body)
        else:
            apprise = import_extra("apprise", "chat")
            target = apprise.Apprise()
            if not target.add(channel.expand(channel.url)) or not target.notify(title=body["title"], body=body["text"]):
                raise RecordError("apprise could not send; check its URL.")
    except StictionError:
        raise
    except Exception as error:
        reason = getattr(error, "reason", None) or getattr(error, "strerror", None) or type(error).__name__
        raise RecordError(f"the message was not taken ({reason})", remedy="check the channel") from None


def _post(url: str, body: dict[str, Any]) -> None:
    data = json.dumps(body).encode()
    request = urllib.request.Request(url, data, {"Content-Type": "application/json"}, method="POST")
    with urllib.request.urlopen(request, timeout=TIMEOUT_S) as answer:
        answer.read()


def _mail(channel: ChannelSettings, body: dict[str, Any]) -> None:
    mail = EmailMessage()
    mail["Subject"], mail["From"], mail["To"] = body["title"], channel.sender, ", ".join(channel.to)
    mail["Message-ID"] = f"<{body['id']}.{body['event']}@stiction>"
    mail.set_content(body["text"])
    host, _, port = channel.host.partition(":")
    user = find_credentials(channel.host)
    with smtplib.SMTP(host, int(port or 25), timeout=TIMEOUT_S) as server:
        if channel.starttls:
            import ssl

            server.starttls(context=ssl.create_default_context())
        if user.user and channel.starttls:
            server.login(user.user, user.password)
        server.send_message(mail)


async def send_due_messages(store: WatchStore, config: WatchConfig) -> int:
    """Send what is due, each channel by itself; give the number of messages that were sent.

    A message is marked as sent after it was taken: a kill in between repeats it with the same `id` and `event`.
    """
    channels = {f"{number} {one.name}": one for number, one in enumerate(config.channel)}

    async def work(name: str, channel: ChannelSettings) -> int:
        sent = 0
        query = "SELECT * FROM message WHERE channel = ? AND sent IS NULL AND due <= ? ORDER BY id"
        for row in store.query(query, name, time.time()):
            try:
                await asyncio.to_thread(send, channel, json.loads(row["body"]))
            except StictionError as error:
                wait = WAITS_S[min(row["tries"], len(WAITS_S) - 1)]
                store.change(
                    "UPDATE message SET tries = tries + 1, due = ?, failure = ? WHERE id = ?",
                    time.time() + wait, str(error), row["id"],
                )  # fmt: skip
                break
            store.change("UPDATE message SET sent = ?, failure = '' WHERE id = ?", time.time(), row["id"])
            sent += 1
        return sent

    return sum(await asyncio.gather(*(work(name, channel) for name, channel in channels.items())))
