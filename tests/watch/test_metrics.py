"""Metrics: what the files of a watch say, read by Prometheus itself; its alert fires; the examples are sound."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import threading
import time
import urllib.request
from pathlib import Path

import pytest

from sources.opc_ua_plant import free_port
from stiction.fleet import LoopRow
from stiction.watch.alarm_rules import update_alarms
from stiction.watch.configuration import AlarmSettings, SourceSettings, WatchConfig
from stiction.watch.metrics import WatchMetrics
from stiction.watch.store import WatchStore

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "watch"


@pytest.fixture
def tools():
    """Folder of prometheus and promtool."""
    folders = [os.environ.get("STICTION_PROMETHEUS", ""), *os.environ.get("PATH", "").split(os.pathsep)]
    for folder in filter(None, folders):
        if shutil.which("promtool", path=folder) and shutil.which("prometheus", path=folder):
            return Path(folder)
    reason = "Prometheus is not installed (Debian package prometheus)"
    return pytest.fail(reason) if os.environ.get("CI") else pytest.skip(reason)


@pytest.fixture
def folder(tmp_path):
    """The files of a watch with one source and one alarm."""
    store = WatchStore(tmp_path)
    counts = {"received": 100, "filled": 7, "late": 1, "lost": 2, "breaks": 3}
    source = {"connected": True, "failure": "", **counts}
    store.set_fact("status", {"time": time.time(), "sources": {"opc.tcp://plant": source}, "delay_s": 12.0})
    row = LoopRow(
        tag="FIC-101", area="U1", status="diagnosed", loop_state="in_control", probability=0.95, finding="sticks",
        priority=0.6, S=4.0,
    )  # fmt: skip
    config = WatchConfig(source=(SourceSettings(address="data"),), alarms=AlarmSettings(raise_windows=1))
    with store.transaction():
        update_alarms(store, config, [row], time.time())
    store.close_window(0, 1, {})
    store.close()
    return tmp_path


def test_the_numbers_are_those_of_the_files(folder):
    families = {one.name: one for one in WatchMetrics(folder).collect()}
    values = {(one.name, *one.labels.values()): one.value for family in families.values() for one in family.samples}
    expected = {
        ("stiction_up",): 1.0,
        ("stiction_source_connected", "opc.tcp://plant"): 1.0,
        ("stiction_source_received_total", "opc.tcp://plant"): 100.0,
        ("stiction_source_filled_total", "opc.tcp://plant"): 7.0,
        ("stiction_source_lost_total", "opc.tcp://plant"): 2.0,
        ("stiction_delay_seconds",): 12.0,
        ("stiction_windows", "closed"): 1.0,
        ("stiction_alarm", "FIC-101", "valve", "high", "unacknowledged"): 1.0,
    }
    assert {key: values.get(key) for key in expected} == expected


@pytest.mark.processes
def test_prometheus_reads_them_and_its_alert_fires(folder, tools, tmp_path):
    import prometheus_client

    registry = prometheus_client.CollectorRegistry()
    registry.register(WatchMetrics(folder))
    server, _ = prometheus_client.start_http_server(0, "127.0.0.1", registry)
    rules = (EXAMPLES / "alerts.yml").read_text()
    (tmp_path / "alerts.yml").write_text(rules)
    place = f"127.0.0.1:{server.server_port}"
    config = {
        "global": {"scrape_interval": "1s", "evaluation_interval": "1s"},
        "rule_files": ["alerts.yml"],
        "scrape_configs": [{"job_name": "stiction", "static_configs": [{"targets": [place]}]}],
    }
    (tmp_path / "prometheus.yml").write_text(json.dumps(config))
    port = free_port()
    process = subprocess.Popen(
        [
            str(tools / "prometheus"), f"--config.file={tmp_path}/prometheus.yml",
            f"--storage.tsdb.path={tmp_path}/tsdb", f"--web.listen-address=127.0.0.1:{port}",
        ],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        firing: list[str] = []
        deadline = time.monotonic() + 60.0
        while "StickyValve" not in firing:
            assert time.monotonic() < deadline
            time.sleep(0.5)
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/v1/alerts", timeout=5) as answer:
                    alerts = json.load(answer)["data"]["alerts"]
            except OSError:
                continue
            firing = [one["labels"]["alertname"] for one in alerts if one["state"] == "firing"]
        assert firing == ["StickyValve"]
    finally:
        process.kill()
        process.wait()
        threading.Thread(target=server.shutdown, daemon=True).start()


def test_the_alert_rules_of_the_examples_pass_promtool(tools):
    said = subprocess.run(
        [str(tools / "promtool"), "test", "rules", "alerts-test.yml"], cwd=EXAMPLES, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert said.returncode == 0, said.stdout + said.stderr


def test_the_dashboard_asks_only_for_numbers_that_there_are(folder):
    import re

    known = {one.name for one in WatchMetrics(folder).collect()}
    asked = set(re.findall(r"stiction_\w+", (EXAMPLES / "dashboard.json").read_text()))
    rules = set(re.findall(r"stiction_\w+", (EXAMPLES / "alerts.yml").read_text()))
    assert {name.removesuffix("_total") for name in asked | rules} <= known


def test_nothing_listens_without_a_port():
    from stiction.watch.configuration import MetricsSettings

    assert (MetricsSettings().port, MetricsSettings().address) == (0, "127.0.0.1")
