"""An adapter as a plant has it: signed and encrypted, no anonymous clients, certificates by hand."""

from __future__ import annotations

import hashlib
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio
from asyncua import Client, ua
from asyncua.crypto.security_policies import SecurityPolicyAes256Sha256RsaPss, SecurityPolicyBasic256Sha256

from gateway.northbound.opcua.certificates import Own
from tests.opcua.support import CLIENT_URI, COMMAND, PASSWORD, Running, client_of, double, running, write

pytestmark = pytest.mark.asyncio(loop_scope="module")


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def locked(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Running]:
    folder = tmp_path_factory.mktemp("locked")
    async with running(folder, security=["sign", "sign_and_encrypt"], anonymous=False) as gateway:
        yield gateway


def trust(gateway: Running, own: Own) -> Path:
    """Do what the operator does: put the client's certificate into ``trusted``."""
    path = gateway.folder / "certificates" / "trusted" / "client.der"
    path.write_bytes(own.certificate.read_bytes())
    return path


async def secured(
    gateway: Running,
    own: Own,
    mode: ua.MessageSecurityMode = ua.MessageSecurityMode.SignAndEncrypt,
    policy: type = SecurityPolicyBasic256Sha256,
) -> Client:
    client = client_of(gateway, "operator")
    client.application_uri = CLIENT_URI
    server = gateway.folder / "certificates" / "own" / "certificate.der"
    await client.set_security(policy, own.certificate, own.key, server_certificate=server, mode=mode)
    return client


@pytest.mark.parametrize("policy", [SecurityPolicyBasic256Sha256, SecurityPolicyAes256Sha256RsaPss])
@pytest.mark.parametrize("mode", [ua.MessageSecurityMode.Sign, ua.MessageSecurityMode.SignAndEncrypt])
async def test_a_trusted_client_comes_in(
    locked: Running, own: Own, mode: ua.MessageSecurityMode, policy: type
) -> None:
    path = trust(locked, own)
    locked.bridge.reset()
    async with await secured(locked, own, mode, policy) as client:
        await write(client, COMMAND, double(3.0))
    assert [value for _, value, *_ in locked.bridge.writes] == [3.0]
    path.unlink()


async def test_s1_an_unknown_certificate_is_kept_for_the_operator(locked: Running, own: Own) -> None:
    with pytest.raises(ua.uaerrors.BadCertificateUntrusted):
        await (await secured(locked, own)).connect()
    thumbprint = hashlib.sha1(own.certificate.read_bytes()).hexdigest()
    rejected = locked.folder / "certificates" / "rejected" / f"{thumbprint}.der"
    assert rejected.read_bytes() == own.certificate.read_bytes()


async def test_a_channel_without_security_carries_no_session(locked: Running) -> None:
    """asyncua opens such a channel, which finding endpoints needs, and would let sessions on it."""
    endpoints = await client_of(locked).connect_and_get_server_endpoints()
    assert {end.SecurityMode for end in endpoints} == {
        ua.MessageSecurityMode.Sign,
        ua.MessageSecurityMode.SignAndEncrypt,
    }
    client = client_of(locked, "operator")
    await client.connect_socket()
    await client.send_hello()
    await client.open_secure_channel()
    with pytest.raises(ua.uaerrors.BadSecurityPolicyRejected):
        await client.uaclient.create_session(ua.CreateSessionParameters())
    client.disconnect_socket()


async def test_anonymous_clients_are_turned_away(locked: Running, own: Own) -> None:
    path = trust(locked, own)
    client = await secured(locked, own)
    client._username = None
    with pytest.raises(ua.UaError):
        await client.connect()
    path.unlink()


async def test_the_certificate_must_name_the_application(locked: Running, own: Own) -> None:
    path = trust(locked, own)
    client = await secured(locked, own)
    client.application_uri = "urn:somebody:else"
    with pytest.raises(ua.uaerrors.BadCertificateUriInvalid):
        await client.connect()
    path.unlink()


async def test_d4_after_wrong_passwords_the_source_must_wait(tmp_path: Path) -> None:
    async with running(tmp_path) as gateway:
        for _ in range(4):
            with pytest.raises(ua.uaerrors.BadUserAccessDenied):
                await client_of(gateway, "operator", "guess").connect()
        with pytest.raises(ua.uaerrors.BadUserAccessDenied):
            await client_of(gateway, "operator", PASSWORD).connect()
        async with client_of(gateway):  # readers without a password are not kept out
            pass
