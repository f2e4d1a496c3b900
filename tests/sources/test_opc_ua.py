"""OPC UA servers as sources: what was put into their history comes out, and nothing is written."""

from __future__ import annotations

from datetime import timedelta

import numpy as np
import pytest

import stiction as st
from sources.opc_ua_plant import START, OpcUaPlant, free_port
from stiction.errors import ParameterError, RecordError
from stiction.sources.historians.address import parse_address
from stiction.sources.historians.opc_ua_connection import trust_server
from stiction.sources.historians.run_async import run_async

SPAN = {"since": START.isoformat(), "until": (START + timedelta(hours=1)).isoformat()}
READING = {
    "OpenSecureChannelRequest", "CloseSecureChannelRequest", "GetEndpointsRequest", "CreateSessionRequest",
    "ActivateSessionRequest", "CloseSessionRequest", "BrowseRequest", "BrowseNextRequest", "ReadRequest",
    "HistoryReadRequest",
}  # fmt: skip
"""Services of OPC UA that change nothing in the address space (OPC UA Part 4, sections 5.5, 5.6, 5.8 and 5.10)."""


@pytest.fixture(autouse=True)
def _own_settings(tmp_path, monkeypatch):
    monkeypatch.setenv("STICTION_CONFIG", str(tmp_path / "settings"))


@pytest.fixture(scope="module")
def server():
    with OpcUaPlant(2) as plant:
        yield plant


@pytest.fixture
def plant(server):
    server.clear()
    return server


@pytest.fixture
def signals():
    rng = np.random.default_rng(3)
    return {role: np.round(40.0 + np.cumsum(rng.normal(size=900)) / 10.0, 3) for role in ("PV", "OP")}


def fill(plant: OpcUaPlant, signals) -> None:
    for loop in ("FIC-101", "FIC-102"):
        for role, values in signals.items():
            plant.keep(f"{loop}.{role}", np.arange(values.size), values.tolist())
        plant.keep(f"{loop}.SP", [0.0], [42.0])


@pytest.mark.parametrize("pages", [{}, {"page": 250, "has_points": True}, {"page": 1000}])
def test_history_comes_whole_and_once_however_the_server_pages(plant, signals, pages):
    longer = {role: np.tile(values, 3) for role, values in signals.items()}
    vars(plant).update(pages)
    fill(plant, longer)
    first, second = st.read(plant.url, **SPAN)
    assert (first.tag, second.tag) == ("FIC-101", "FIC-102")
    assert (first.dt, first.start, first.loop_type) == (1.0, START, "flow")
    for record in (first, second):
        np.testing.assert_array_equal(record.pv, longer["PV"])
        np.testing.assert_array_equal(record.op, longer["OP"])
        np.testing.assert_array_equal(record.sp, 42.0)
    assert first.provenance.pv_unit == "m3/h"
    assert set(plant.requests) <= READING


def test_bad_and_uncertain_values_are_missing(plant, signals):
    status = np.zeros(900, dtype=np.int64)
    status[100:120], status[300:310] = 0x80310000, 0x40900000  # BadNoCommunication, UncertainLastUsableValue
    plant.keep("FIC-101.PV", np.arange(900), signals["PV"].tolist(), status)
    plant.keep("FIC-101.OP", np.arange(900), signals["OP"].tolist())
    [record] = st.read(plant.url, **SPAN)
    [kept] = st.read(plant.url, **SPAN, keep_uncertain=True)
    assert record.pv is not None
    assert kept.pv is not None
    np.testing.assert_array_equal(np.flatnonzero(~np.isfinite(record.pv)), [*range(100, 120), *range(300, 310)])
    np.testing.assert_array_equal(np.flatnonzero(~np.isfinite(kept.pv)), range(100, 120))


def test_output_in_units_of_its_range_becomes_percent_of_span(plant, signals):
    fill_one = {"FIC-101.PV": signals["PV"], "FIC-101.OP": signals["OP"]}
    for tag, values in fill_one.items():
        plant.keep(tag, np.arange(900), values.tolist())
    [record] = st.read(plant.url, **SPAN, op_range=(0.0, 200.0))
    np.testing.assert_allclose(record.op, signals["OP"] / 2.0)


def test_a_set_point_that_was_set_before_is_held(plant, signals):
    for role, values in signals.items():
        plant.keep(f"FIC-101.{role}", np.arange(values.size), values.tolist())
    plant.keep("FIC-101.SP", [-5000.0, -4000.0], [40.0, 42.0])
    [record] = st.read(plant.url, **SPAN)
    plant.kept[plant.nodes["FIC-101.SP"].to_string()].clear()
    [without] = st.read(plant.url, **SPAN)
    np.testing.assert_array_equal(record.sp, 42.0)
    np.testing.assert_array_equal(record.pv, signals["PV"])
    assert without.sp is None or not np.isfinite(without.sp).any()


def test_tags_by_pattern_and_by_map(plant, signals, tmp_path):
    table = tmp_path / "map.csv"
    table.write_text("tag,loop,role\nns=2;i=1000,Feed,pv\nFIC-101.OP,Feed,op\n")
    fill(plant, signals)
    assert [one.tag for one in st.read(plant.url, **SPAN, tags=["*-102*"])] == ["FIC-102"]
    table.write_text("tag,loop,role\nFIC-101.PV,Feed,pv\nFIC-101.OP,Feed,op\n")
    assert [one.tag for one in st.read(plant.url, **SPAN, map=table)] == ["Feed"]
    with pytest.raises(RecordError, match=r"no tag matches LIC\*"):
        st.read(plant.url, **SPAN, tags=["LIC*"])


def test_a_loop_without_values_costs_only_itself(plant, signals):
    for role, values in signals.items():
        plant.keep(f"FIC-101.{role}", np.arange(values.size), values.tolist())
    plant.keep("FIC-101.SP", [0.0], [42.0])
    [record] = st.read(plant.url, **SPAN)
    assert record.tag == "FIC-101"
    assert any("FIC-102" in note and "no value" in note for note in record.provenance.assumptions)


def test_a_server_that_is_not_there_is_reported():
    with pytest.raises(RecordError, match=r"opc.tcp://127.0.0.1:\d+: cannot be reached .*; check host and port"):
        st.read(f"opc.tcp://127.0.0.1:{free_port()}", **SPAN)


def test_passwords_in_the_address_and_options_of_databases_are_refused():
    with pytest.raises(ParameterError, match="STICTION_HISTORIAN_USER") as caught:
        st.read("opc.tcp://ana:secret@plant:4840")
    assert "secret" not in str(caught.value)
    with pytest.raises(ParameterError, match="table can be used only with a database"):
        st.read("opc.tcp://127.0.0.1:1", table="trend")
    with pytest.raises(ParameterError, match="is not a time"):
        st.read("opc.tcp://127.0.0.1:1", since="yesterday")


def make_secure(plant: OpcUaPlant, folder) -> None:
    from asyncua import ua
    from asyncua.crypto.cert_gen import setup_self_signed_certificate
    from cryptography.x509.oid import ExtendedKeyUsageOID

    folder.mkdir()
    key, certificate = folder / "key.pem", folder / "certificate.der"
    made = setup_self_signed_certificate(
        key, certificate, "urn:freeopcua:python:server", "localhost", [ExtendedKeyUsageOID.SERVER_AUTH],
        {"commonName": "plant"},
    )  # fmt: skip
    run_async(made)
    plant.security, plant.certificate = [ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt], (certificate, key)
    plant.users = {"ana": "right"}


def test_a_certificate_is_accepted_only_when_asked_and_the_password_must_be_right(signals, tmp_path, monkeypatch):
    plant = OpcUaPlant(1)
    make_secure(plant, tmp_path / "server")
    with plant:
        for role, values in signals.items():
            plant.keep(f"FIC-101.{role}", np.arange(values.size), values.tolist())
        monkeypatch.setenv("STICTION_HISTORIAN_USER", "ana")
        monkeypatch.setenv("STICTION_HISTORIAN_PASSWORD", "right")
        with pytest.raises(RecordError, match=r"not trusted: SHA-256 [0-9A-F:]{95}; .*stiction watch --trust opc.tcp"):
            st.read(plant.url, **SPAN)
        known = trust_server_of(plant)
        import hashlib

        assert known == hashlib.sha256((tmp_path / "server" / "certificate.der").read_bytes()).digest().hex(":").upper()
        [record] = st.read(plant.url, **SPAN)
        np.testing.assert_array_equal(record.pv, signals["PV"])
        monkeypatch.setenv("STICTION_HISTORIAN_PASSWORD", "wrong-one")
        with pytest.raises(RecordError, match="refuses the user") as caught:
            st.read(plant.url, **SPAN)
        assert "wrong-one" not in str(caught.value)
    key = tmp_path / "settings" / "private-key.pem"
    assert key.stat().st_mode & 0o077 == 0


def trust_server_of(plant: OpcUaPlant) -> str | None:
    return run_async(trust_server(parse_address(plant.url)))


def test_a_file_of_passwords_that_others_can_read_is_refused(tmp_path, monkeypatch):
    folder = tmp_path / "settings"
    folder.mkdir()
    file = folder / "credentials.toml"
    file.write_text('["plant:4840"]\nuser = "ana"\npassword = "secret"\n')
    from stiction.sources.historians.credentials import find_credentials

    file.chmod(0o644)
    with pytest.raises(RecordError, match="chmod 600"):
        find_credentials("plant:4840")
    file.chmod(0o600)
    found = find_credentials("plant:4840")
    assert (found.user, found.password) == ("ana", "secret")
    assert "secret" not in repr(found)


@pytest.mark.processes
def test_an_audit_reads_the_server_as_read_does(plant, signals, tmp_path):
    fill(plant, signals)
    found = st.audit(plant.url, tmp_path / "audit", workers=1, since=SPAN["since"], until=SPAN["until"])
    [record, _] = st.read(plant.url, **SPAN)
    diagnosis = st.diagnose(record)
    row = found.row("FIC-101")
    assert (row.verdict, row.samples, row.pv_unit, row.source) == (diagnosis.verdict, 900, "m3/h", plant.url)
    np.testing.assert_array_equal(found.read("FIC-101").pv, record.pv)
    assert set(plant.requests) <= READING
