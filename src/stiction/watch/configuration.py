"""What a watch does, as its file `plant.toml` says it. Each field has its key, its unit and its limits here."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from stiction.errors import ParameterError
from stiction.fleet.time_text import parse_duration
from stiction.sources.historians.address import is_historian_url, parse_address

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["AlarmSettings", "ChannelSettings", "MetricsSettings", "SourceSettings", "WatchConfig"]

ALARM_FINDINGS = ("sticks", "probably_sticks", "backlash", "valve_not_responding", "tuning", "sensor")
"""Findings that someone can act on."""

MIN_WINDOW_S = 10.0
"""Shortest window [s]; a loop needs hours, but a trial does not."""


@dataclass(frozen=True, kw_only=True)
class SourceSettings:
    """A source of the plant: `[[source]]`, once for each."""

    address: str
    """URL of an OPC UA server, a PI Web API or a database, or a folder that grows."""
    tags: tuple[str, ...] = ()
    """Patterns of the tags of a historian, such as "FIC*"; all when not given."""
    map: str = ""
    """Mapping file that settles loop, role, unit and span of tags."""
    reading: dict[str, Any] = field(default_factory=dict)
    """Further options of `stiction read`, such as table, time, tag_column and value of a database."""
    delay: str = "1m"
    """Time after which a source that keeps its values itself has stored all values of a window."""
    publishing: str = "1s"
    """Time between two messages of an OPC UA server."""
    sampling: str = "0s"
    """Time between two looks of an OPC UA server at a variable; 0s: as often as it can."""

    def __post_init__(self) -> None:
        if is_historian_url(self.address):
            parse_address(self.address)
        for name in ("delay", "publishing", "sampling"):
            _seconds(name, getattr(self, name), zero=name != "publishing")

    @property
    def is_live(self) -> bool:
        """Whether values come by subscription; else the source itself keeps them."""
        return self.address.lower().startswith("opc.tcp:")

    @property
    def delay_s(self) -> float:
        """Time after which all values of a window are stored [s]."""
        return _seconds("delay", self.delay, zero=True)

    @property
    def publishing_s(self) -> float:
        """Time between two messages [s]."""
        return _seconds("publishing", self.publishing)

    @property
    def sampling_s(self) -> float:
        """Time between two looks of the server [s]."""
        return _seconds("sampling", self.sampling, zero=True)


@dataclass(frozen=True, kw_only=True)
class AlarmSettings:
    """When alarms are raised and cleared: `[alarms]`."""

    findings: tuple[str, ...] = ALARM_FINDINGS
    """Findings that are alarms."""
    raise_at: float = 0.8
    """Probability of stiction from which a valve is an alarm [-]."""
    clear_at: float = 0.4
    """Probability of stiction below which the alarm is cleared [-]."""
    raise_windows: int = 2
    """Consecutive windows for which the finding must stand before the alarm is raised [-]."""
    clear_windows: int = 3
    """Consecutive windows without the finding before the alarm is cleared [-]."""
    max_per_day: int = 10
    """New alarms a day that are sent at once [-]; the others are in the digest."""
    digest: str = "daily"
    """When a digest is sent: daily, weekly or never."""
    digest_hour: int = 6
    """Hour of the day of the digest, by the clock of this machine."""
    link: str = ""
    """Address of the page of a loop in messages; {tag} stands for its tag."""

    def __post_init__(self) -> None:
        if unknown := set(self.findings) - set(ALARM_FINDINGS):
            raise ParameterError(
                f"findings: {sorted(unknown)[0]!r} is unknown; give some of {', '.join(ALARM_FINDINGS)}."
            )
        for name in ("raise_at", "clear_at"):
            if not 0.0 < getattr(self, name) < 1.0:
                value = getattr(self, name)
                raise ParameterError(f"{name} = {value:g} is not a probability; give one between 0 and 1.")
        if self.clear_at >= self.raise_at:
            raise ParameterError(
                f"clear_at = {self.clear_at:g} is not below raise_at = {self.raise_at:g}; give a lower clear_at."
            )
        for name in ("raise_windows", "clear_windows"):
            _require_whole(name, getattr(self, name), 1)
        _require_whole("max_per_day", self.max_per_day, 0)
        if self.digest not in ("daily", "weekly", "never"):
            raise ParameterError(f"digest = {self.digest!r} is unknown; give daily, weekly or never.")
        if not 0 <= self.digest_hour <= 23:
            raise ParameterError(f"digest_hour = {self.digest_hour} is not an hour of the day; give 0 to 23.")


@dataclass(frozen=True, kw_only=True)
class ChannelSettings:
    """Where alarms and digests are sent: `[[channel]]`, once for each."""

    kind: str
    """webhook, smtp or apprise."""
    url: str = ""
    """Webhook: the address that gets JSON. Apprise: its URL; it may name an environment variable as ${NAME}."""
    host: str = ""
    """SMTP: mail server, as HOST or HOST:PORT."""
    sender: str = ""
    """SMTP: address of the sender."""
    to: tuple[str, ...] = ()
    """SMTP: addresses of the receivers."""
    starttls: bool = True
    """SMTP: encrypt the connection."""
    what: str = "all"
    """alarms, digest or all."""

    def __post_init__(self) -> None:
        needed = {"webhook": ("url",), "apprise": ("url",), "smtp": ("host", "sender", "to")}
        if self.kind not in needed:
            raise ParameterError(f"kind = {self.kind!r} is unknown; give webhook, smtp or apprise.")
        for name in needed[self.kind]:
            if not getattr(self, name):
                raise ParameterError(f"{name} is missing, which a channel of kind {self.kind} needs; give it.")
        if self.kind == "webhook" and not self.url.startswith(("http://", "https://", "${")):
            raise ParameterError(f"url = {self.url!r} is not a web address; give one that begins with https://.")
        if self.what not in ("alarms", "digest", "all"):
            raise ParameterError(f"what = {self.what!r} is unknown; give alarms, digest or all.")

    @property
    def name(self) -> str:
        """Name for messages, without secrets."""
        if self.kind == "smtp":
            return f"smtp {self.host}"
        scheme, _, rest = self.url.partition("://")
        return f"{self.kind} {rest.split('/')[0].rpartition('@')[2] or scheme}" if self.kind == "webhook" else self.kind

    def expand(self, text: str) -> str:
        """Put environment variables into a text."""
        return os.path.expandvars(text)


@dataclass(frozen=True, kw_only=True)
class MetricsSettings:
    """Numbers for Prometheus: `[metrics]`. Without a port there are none."""

    port: int = 0
    """Port of http://ADDRESS:PORT/metrics; 0: no metrics."""
    address: str = "127.0.0.1"
    """Address that is listened at; by default this machine alone."""

    def __post_init__(self) -> None:
        if not 0 <= self.port <= 65535:
            raise ParameterError(f"port = {self.port} is not a port number; give 1 to 65535.")


@dataclass(frozen=True, kw_only=True)
class WatchConfig:
    """The whole file.

    Examples
    --------
    >>> WatchConfig(source=(SourceSettings(address="data"),), window="8h").window_s
    28800.0
    """

    source: tuple[SourceSettings, ...]
    """What is watched."""
    folder: str = "watch"
    """Folder of the results, beside the file: `audit` for the results, `parts` for the collected records."""
    window: str = "4h"
    """Length of a window, which is judged as one record."""
    wait: str = "30m"
    """Time after the end of a window for which a source that does not answer is waited for."""
    keep: str = "90d"
    """Time for which collected records are kept."""
    workers: int = 0
    """Worker processes that judge [-]; 0: one for each core."""
    prior: float = 0.25
    """Share of sticky valves in the plant [-]."""
    connections: str = ""
    """CSV file with the columns from and to: loops that a stream or a signal connects."""
    alarms: AlarmSettings = field(default_factory=AlarmSettings)
    """When alarms are raised."""
    channel: tuple[ChannelSettings, ...] = ()
    """Where they are sent."""
    metrics: MetricsSettings = field(default_factory=MetricsSettings)
    """Numbers for Prometheus."""

    def __post_init__(self) -> None:
        if not self.source:
            raise ParameterError("there is no source; write a section [[source]] with its address.")
        addresses = [one.address for one in self.source]
        if twice := {one for one in addresses if addresses.count(one) > 1}:
            raise ParameterError(f"address = {sorted(twice)[0]!r} stands in two sources; delete one.")
        for name in ("window", "wait", "keep"):
            _seconds(name, getattr(self, name))
        if self.window_s < MIN_WINDOW_S:
            least = f"{MIN_WINDOW_S:g}s"
            raise ParameterError(f"window = {self.window!r} is shorter than {least}; give a longer one, such as 4h.")
        _require_whole("workers", self.workers, 0)
        if not 0.0 < self.prior < 1.0:
            raise ParameterError(f"prior = {self.prior:g} is not a share; give a number between 0 and 1.")

    @property
    def window_s(self) -> float:
        """Length of a window [s]."""
        return _seconds("window", self.window)

    @property
    def wait_s(self) -> float:
        """Time for which a source is waited for [s]."""
        return _seconds("wait", self.wait)

    @property
    def keep_s(self) -> float:
        """Time for which records are kept [s]."""
        return _seconds("keep", self.keep)

    def folder_beside(self, file: Path) -> Path:
        """Folder of the results of a configuration file."""
        return (file.parent / self.folder).absolute()


def _seconds(name: str, text: str, *, zero: bool = False) -> float:
    if zero and str(text).strip().rstrip("smhd ").strip("0.") == "":
        return 0.0
    return parse_duration(name, text)


def _require_whole(name: str, value: int, least: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise ParameterError(f"{name} = {value!r} is not a whole number from {least} on; give one.")
