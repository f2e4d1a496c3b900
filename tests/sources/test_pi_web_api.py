"""The PI Web API as a source, against a stand-in with its limits: no value lost or double, one bad tag alone fails."""

from __future__ import annotations

import base64
import ipaddress
import ssl
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

import numpy as np
import pytest

import stiction as st
from sources.pi_archive import START, PiArchive, count_methods
from stiction.errors import RecordError
from stiction.sources.historians import pi_requests, pi_web_api

if TYPE_CHECKING:
    from pathlib import Path

SPAN = {"since": START.isoformat(), "until": (START + timedelta(hours=2)).isoformat()}


@pytest.fixture(autouse=True)
def _own_settings(tmp_path, monkeypatch):
    monkeypatch.setenv("STICTION_CONFIG", str(tmp_path / "settings"))
    monkeypatch.setattr(pi_requests, "WAITS_S", (0.01, 0.01, 0.01))


@pytest.fixture
def archive():
    with PiArchive() as server:
        yield server


def add_loop(archive: PiArchive, tag: str, n: int = 600, **flags) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(len(archive.points))
    signals = {role: np.round(50.0 + np.cumsum(rng.normal(size=n)) / 10.0, 4) for role in ("PV", "OP")}
    archive.add(f"{tag}.PV", signals["PV"].tolist(), unit="m3/h", span=80.0, flags=flags.get("pv"))
    archive.add(f"{tag}.OP", signals["OP"].tolist(), unit="%", flags=flags.get("op"))
    return signals


@pytest.mark.parametrize("most", [100, 599, 600, 601, 70_000])
def test_pages_lose_no_value_and_double_none(archive, monkeypatch, most):
    signals = add_loop(archive, "FIC-101")
    monkeypatch.setattr(pi_web_api, "MAX_ITEMS", 2 * most)
    [record] = st.read(archive.url, **SPAN)
    assert (record.tag, record.dt, record.start, record.loop_type) == ("FIC-101", 1.0, START, "flow")
    np.testing.assert_array_equal(record.pv, signals["PV"])
    np.testing.assert_array_equal(record.op, signals["OP"])
    assert record.provenance.pv_unit == "m3/h"
    assert count_methods(archive.requests).keys() == {"GET"}


def test_values_with_one_time_stamp_at_the_end_of_a_page_are_kept_once(archive, monkeypatch):
    seconds = [*range(50), 50.0, 50.0, 50.0, *range(51, 100)]
    from stiction.sources.historians.historian_loops import open_historian

    archive.add("FIC-101.PV", np.arange(102.0).tolist(), seconds=seconds)
    monkeypatch.setattr(pi_web_api, "MAX_ITEMS", 52)
    client = open_historian(archive.url)
    tags = client.find_tags(["FIC-101.PV"], exact=True)
    found = client.read(tags, START, START + timedelta(hours=1))["FIC-101.PV"]
    assert not isinstance(found, Exception)
    np.testing.assert_array_equal(found.values.to_numpy(), np.arange(102.0))
    np.testing.assert_array_equal(found.seconds - START.timestamp(), seconds)


def test_flags_states_and_errors_are_missing_values(archive):
    state = {"Value": {"Name": "I/O Timeout", "Value": 246, "IsSystem": True}, "Good": False}
    flags = {
        **dict.fromkeys(range(10, 20), state),
        **{k: {"Questionable": True} for k in range(30, 40)},
        **{k: {"Substituted": True} for k in range(50, 60)},
        **{k: {"Good": False} for k in range(70, 80)},
        **{k: {"Errors": [{"FieldName": "Value", "Message": ["broken"]}]} for k in range(90, 100)},
    }
    signals = add_loop(archive, "FIC-101", pv=flags)
    [record] = st.read(archive.url, **SPAN)
    [kept] = st.read(archive.url, **SPAN, keep_uncertain=True)
    bad = np.array(sorted(flags))
    assert record.pv is not None
    assert kept.pv is not None
    np.testing.assert_array_equal(np.flatnonzero(~np.isfinite(record.pv)), bad)
    doubtful = (bad // 10 == 3) | (bad // 10 == 5)
    np.testing.assert_array_equal(np.flatnonzero(~np.isfinite(kept.pv)), bad[~doubtful])
    np.testing.assert_array_equal(kept.pv[bad[doubtful]], signals["PV"][bad[doubtful]])


def test_a_digital_state_is_the_mode(archive):
    add_loop(archive, "FIC-101")
    modes = [
        {"Name": "AUTO" if k < 300 else "MAN", "Value": int(k < 300), "IsSystem": False} for k in range(0, 600, 50)
    ]
    archive.add("FIC-101.MODE", modes, seconds=range(0, 600, 50))
    [record] = st.read(archive.url, **SPAN)
    assert record.auto is not None
    np.testing.assert_array_equal(record.auto, np.arange(600) < 300)


def test_a_set_point_that_was_set_before_is_held(archive):
    signals = add_loop(archive, "FIC-101")
    archive.add("FIC-101.SP", [40.0, 42.0], seconds=[-5000.0, -4000.0])
    [record] = st.read(archive.url, **SPAN)
    np.testing.assert_array_equal(record.sp, 42.0)
    np.testing.assert_array_equal(record.pv, signals["PV"])


def test_a_tag_that_fails_costs_only_its_loop(archive):
    signals = add_loop(archive, "FIC-101")
    add_loop(archive, "FIC-102")
    archive.broken["FIC-102.PV"] = "The point is corrupt."
    [record] = st.read(archive.url, **SPAN)
    assert record.tag == "FIC-101"
    np.testing.assert_array_equal(record.pv, signals["PV"])
    assert any("FIC-102.PV" in note and "The point is corrupt." in note for note in record.provenance.assumptions)


def test_tags_of_a_map_are_looked_up_by_name_and_a_missing_one_is_reported(archive, tmp_path):
    signals = add_loop(archive, "FIC-101")
    add_loop(archive, "FIC-102")
    table = tmp_path / "map.csv"
    rows = ["FIC-101.PV,Feed,pv", "FIC-101.OP,Feed,op", "GONE.PV,Gone,pv", "GONE.OP,Gone,op"]
    table.write_text("\n".join(["tag,loop,role", *rows]))
    [record] = st.read(archive.url, **SPAN, map=table)
    assert record.tag == "Feed"
    np.testing.assert_array_equal(record.op, signals["OP"])
    assert any("Gone" in note for note in record.provenance.assumptions)
    assert not any("dataservers/" in path for _, path in archive.requests)


def test_a_busy_server_is_asked_again(archive):
    signals = add_loop(archive, "FIC-101")
    archive.failures = [429, 503]
    [record] = st.read(archive.url, **SPAN)
    np.testing.assert_array_equal(record.pv, signals["PV"])
    archive.failures = [502, 503, 504, 502]
    with pytest.raises(RecordError, match="answers with 502"):
        st.read(archive.url, **SPAN)


def test_a_request_that_is_too_large_is_split(archive):
    signals = add_loop(archive, "FIC-101")
    tags = [f"{name}={point['WebId']}" for name, point in archive.points.items()]
    archive.failures = [413]
    [record] = st.read(archive.url, **SPAN, tags=tags)
    np.testing.assert_array_equal(record.pv, signals["PV"])


def test_user_and_password_come_from_the_environment_and_are_not_shown(archive, monkeypatch):
    add_loop(archive, "FIC-101")
    archive.user = "Basic " + base64.b64encode(b"ana:right").decode()
    monkeypatch.setenv("STICTION_HISTORIAN_USER", "ana")
    monkeypatch.setenv("STICTION_HISTORIAN_PASSWORD", "wrong-one")
    with pytest.raises(RecordError, match="refuses the user") as caught:
        st.read(archive.url, **SPAN)
    assert "wrong-one" not in str(caught.value)
    monkeypatch.setenv("STICTION_HISTORIAN_PASSWORD", "right")
    assert len(st.read(archive.url, **SPAN)) == 1


@pytest.mark.parametrize(
    ("body", "message"),
    [("<html>Welcome</html>", "something else than JSON"), ('{"Items": [{"Na', "something else than JSON")],
)
def test_an_answer_that_is_no_answer_is_reported(archive, monkeypatch, body, message):
    monkeypatch.setattr(archive, "answer", lambda *_: (200, body))
    with pytest.raises(RecordError, match=message):
        st.read(archive.url, **SPAN)


def test_a_certificate_that_nobody_vouches_for_is_refused(tmp_path, monkeypatch):
    authority = _self_signed(tmp_path)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(authority)
    with PiArchive(context) as server:
        add_loop(server, "FIC-101")
        with pytest.raises(
            RecordError, match=r"certificate of the server cannot be verified; give the file .* in SSL_CERT_FILE"
        ):
            st.read(server.url, **SPAN)
        assert not server.requests
        monkeypatch.setenv("SSL_CERT_FILE", str(authority))
        assert len(st.read(server.url, **SPAN)) == 1


def _self_signed(folder) -> Path:
    """Certificate of 127.0.0.1 with its private key, in one file."""
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec

    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "archive")])
    names = x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address("127.0.0.1"))])
    now = datetime.now(UTC)
    builder = x509.CertificateBuilder(name, name, key.public_key(), x509.random_serial_number())
    builder = builder.not_valid_before(now - timedelta(hours=1)).not_valid_after(now + timedelta(hours=1))
    certificate = builder.add_extension(names, critical=False).sign(key, hashes.SHA256())
    private = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    file = folder / "archive.pem"
    file.write_bytes(private + certificate.public_bytes(serialization.Encoding.PEM))
    return file
