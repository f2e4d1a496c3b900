"""Connections to OPC UA servers: the best security that the server offers, its certificate checked, errors in words."""

from __future__ import annotations

import asyncio
import logging
import os
import socket
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError, StictionError, import_extra
from stiction.sources.historians.credentials import configuration_folder, find_credentials
from stiction.sources.historians.trusted_servers import require_trusted, trust

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

    from asyncua.client.client import Client

    from stiction.sources.historians.address import HistorianAddress

__all__ = ["connect", "connection_error", "trust_server"]

TIMEOUT_S = 10.0
"""Time for an answer of the server [s]."""
POLICIES = ("Basic256Sha256", "Aes128Sha256RsaOaep", "Aes256Sha256RsaPss")
"""Security policies in the order in which they are taken."""
LOST = ("BadConnectionClosed", "BadSessionIdInvalid", "BadSessionClosed", "BadSecureChannelClosed", "BadTimeout")
"""Status codes that mean that the connection is gone."""


@asynccontextmanager
async def connect(address: HistorianAddress) -> AsyncIterator[Client]:
    """Connect to a server, and close the connection at the end.

    Raises
    ------
    RecordError
        When it cannot be reached, its certificate is not trusted, or it refuses the user.
    """
    connected = None
    try:
        client = await _make_client(address)
        await client.connect()
        connected = client
        yield client
    except StictionError:
        raise
    except Exception as error:
        raise connection_error(error, address) from None
    finally:
        if connected is not None:
            with suppress(Exception):  # the server is gone
                await asyncio.wait_for(connected.disconnect(), TIMEOUT_S)


async def _make_client(address: HistorianAddress) -> Client:
    """Make a client with security and user, not yet connected."""
    asyncua = import_extra("asyncua", "live")
    logging.getLogger("asyncua").setLevel(logging.CRITICAL)  # it logs what is raised here
    client = asyncua.Client(address.url, timeout=TIMEOUT_S)
    client.application_uri = _application_uri()
    policy, mode, certificate = await _choose_endpoint(client)
    if policy is not None:
        require_trusted(address.host, certificate, address.url)
        own = await _own_certificate()
        await client.set_security(policy, *own, server_certificate=certificate, mode=mode)
    user = find_credentials(address.host)
    if user.user:
        client.set_user(user.user)
        client.set_password(user.password)
    return client


async def trust_server(address: HistorianAddress) -> str | None:
    """Accept the certificate of a server, and give its fingerprint; None where it offers no encryption.

    Raises
    ------
    RecordError
        When the server cannot be reached.
    """
    asyncua = import_extra("asyncua", "live")
    try:
        policy, _, certificate = await _choose_endpoint(asyncua.Client(address.url, timeout=TIMEOUT_S))
    except Exception as error:
        raise connection_error(error, address) from None
    return None if policy is None else trust(address.host, certificate)


def connection_error(error: Exception, address: HistorianAddress) -> RecordError:
    """Say why a server could not be used."""
    name = type(error).__name__
    if name in ("BadUserAccessDenied", "BadIdentityTokenRejected", "BadIdentityTokenInvalid"):
        what = "refuses the user"
        remedy = "check STICTION_HISTORIAN_USER and STICTION_HISTORIAN_PASSWORD, or the file of credentials"
    elif name.startswith("BadCertificate") or name == "BadSecurityChecksFailed":
        what = f"refuses the certificate of stiction ({name})"
        remedy = f"accept {configuration_folder() / 'certificate.der'} on the server"
    elif isinstance(error, (OSError, TimeoutError)) or name in LOST:
        reason = getattr(error, "strerror", None) or str(error) or "no answer"
        what, remedy = f"cannot be reached ({reason})", "check host and port, and whether the server runs"
    else:
        what, remedy = f"answers with {name} ({str(error)[:200]})", "check the server and its log"
    return RecordError(what, remedy=remedy, where=address.url)


async def _choose_endpoint(client: Client) -> tuple[Any, Any, bytes]:
    """Security policy, mode and server certificate of the best endpoint; no policy where none is encrypted."""
    ua = import_extra("asyncua.ua", "live")
    from asyncua.crypto import security_policies

    endpoints = await client.connect_and_get_server_endpoints()
    for name in POLICIES:
        for mode in (ua.MessageSecurityMode.SignAndEncrypt, ua.MessageSecurityMode.Sign):
            for one in endpoints:
                if one.SecurityMode == mode and str(one.SecurityPolicyUri).endswith(f"#{name}"):
                    return getattr(security_policies, f"SecurityPolicy{name}"), mode, bytes(one.ServerCertificate)
    return None, None, b""


async def _own_certificate() -> tuple[Path, Path]:
    """Certificate and private key of this user, made when they are first needed."""
    from asyncua.crypto.cert_gen import setup_self_signed_certificate
    from cryptography.x509.oid import ExtendedKeyUsageOID

    folder = configuration_folder()
    folder.mkdir(parents=True, exist_ok=True)
    certificate, key = folder / "certificate.der", folder / "private-key.pem"
    before = os.umask(0o077)
    try:
        await setup_self_signed_certificate(
            key, certificate, _application_uri(), socket.gethostname(), [ExtendedKeyUsageOID.CLIENT_AUTH],
            {"commonName": "stiction"},
        )  # fmt: skip
    finally:
        os.umask(before)
    return certificate, key


def _application_uri() -> str:
    return f"urn:{socket.gethostname()}:stiction"
