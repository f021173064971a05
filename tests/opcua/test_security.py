"""Sessions, tokens and malformed input. The adapter here offers no security and lets anonymous readers in."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from urllib.parse import urlsplit

import pytest
from asyncua import Client, ua

from tests.opcua.support import (
    COMMAND,
    FREQUENCY,
    PASSWORD,
    Running,
    client_of,
    double,
    eventually,
    good,
    monitor,
    subscribe,
    write,
)

pytestmark = pytest.mark.asyncio(loop_scope="session")


@contextlib.asynccontextmanager
async def channel_with_token_of(gateway: Running, other: Client) -> AsyncIterator[Client]:
    """A second channel that knows another client's session token and nonce."""
    client = client_of(gateway)
    await client.connect_socket()
    try:
        await client.send_hello()
        await client.open_secure_channel()
        client.uaclient.session.restore_authentication_token(other.uaclient.session.authentication_token)
        client._server_nonce, client._policy_ids = other._server_nonce, other._policy_ids
        client.security_policy = other.security_policy
        yield client
    finally:
        client.disconnect_socket()


async def reach(gateway: Running) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    parts = urlsplit(gateway.url)
    return await asyncio.open_connection(parts.hostname, parts.port)


@pytest.mark.parametrize(("user", "password"), [("operator", "wrong"), ("nobody", PASSWORD)])
async def test_a_wrong_name_or_password_is_refused(gateway: Running, user: str, password: str) -> None:
    with pytest.raises(ua.uaerrors.BadUserAccessDenied):
        async with client_of(gateway, user, password):
            pass
    async with client_of(gateway, "operator"):  # forgives the source its mistakes
        pass


async def test_s1_session_tokens_cannot_be_guessed(gateway: Running) -> None:
    async with client_of(gateway) as one, client_of(gateway) as two:
        tokens = [client.uaclient.session.authentication_token for client in (one, two)]
    assert all(isinstance(token.Identifier, bytes) and len(token.Identifier) == 32 for token in tokens)
    assert tokens[0] != tokens[1]


async def test_a_failed_activation_gives_no_rights(gateway: Running) -> None:
    """asyncua attaches the session to the channel before it checks the password."""
    async with client_of(gateway, "operator") as owner:
        async with channel_with_token_of(gateway, owner) as thief:
            with pytest.raises(ua.uaerrors.BadUserAccessDenied):
                await thief.activate_session("operator", "wrong")
            with pytest.raises(ua.UaStatusCodeError):
                await write(thief, COMMAND, double(1.0))
        assert gateway.bridge.writes == []
        await write(owner, COMMAND, double(2.0))
    assert [value for _, value, *_ in gateway.bridge.writes] == [2.0]


async def test_a_session_keeps_its_user_when_it_moves(gateway: Running) -> None:
    async with client_of(gateway, "operator") as owner, channel_with_token_of(gateway, owner) as other:
        with pytest.raises(ua.uaerrors.BadUserAccessDenied):
            await other.activate_session()
        with pytest.raises(ua.uaerrors.BadUserAccessDenied):
            await other.activate_session("engineer", PASSWORD)


async def test_a_cut_client_finds_its_subscription_again(gateway: Running) -> None:
    client = client_of(gateway)
    await client.connect()
    number, _ = await subscribe(client, 50)
    await monitor(client, number)
    client.uaclient.protocol.transport.abort()
    async with channel_with_token_of(gateway, client) as again:
        await again.activate_session()
        assert gateway.bridge.wants == {FREQUENCY: 0.1}
        values: list[float] = []

        def keep(result: ua.PublishResult) -> None:
            for data in result.NotificationMessage.NotificationData or ():
                values.extend(item.Value.Value.Value for item in data.MonitoredItems)

        again.uaclient._subscription_callbacks[number] = keep
        publishing = asyncio.create_task(again.uaclient.publish([]))
        gateway.bridge.push(good(FREQUENCY, 64.0))
        result = await publishing
        items = result.Parameters.NotificationMessage.NotificationData[0].MonitoredItems
        assert number == result.Parameters.SubscriptionId
        assert items
        await again.close_session()
    await eventually(lambda: gateway.bridge.wants == {})
    await client.disconnect()


async def test_requests_must_carry_the_token_of_their_channels_session(gateway: Running) -> None:
    async with client_of(gateway, "operator") as owner, client_of(gateway) as stranger:
        own = stranger.uaclient.session.authentication_token
        stranger.uaclient.session.restore_authentication_token(owner.uaclient.session.authentication_token)
        with pytest.raises(ua.uaerrors.BadSessionIdInvalid):
            await write(stranger, COMMAND, double(1.0))
        stranger.uaclient.session.restore_authentication_token(own)


async def test_a_channel_carries_one_session(gateway: Running) -> None:
    async with client_of(gateway) as client:
        with pytest.raises(ua.uaerrors.BadTooManySessions):
            await client.create_session()


async def test_nobody_registers_servers_here(gateway: Running) -> None:
    async with client_of(gateway) as client:
        with pytest.raises(ua.uaerrors.BadServiceUnsupported):
            await client.uaclient.register_server(ua.RegisteredServer(ServerUri="urn:x", ServerNames=[]))


async def test_what_is_not_served_is_not_blamed_on_the_user(gateway: Running) -> None:
    async with client_of(gateway, "engineer") as client:
        with pytest.raises(ua.uaerrors.BadServiceUnsupported):
            await client.uaclient.browse_next(ua.BrowseNextParameters(False, [b"x"]))
        with pytest.raises(ua.uaerrors.BadServiceUnsupported):
            await client.uaclient.history_read(ua.HistoryReadParameters())
        for request in (ua.QueryFirstRequest(), ua.SetTriggeringRequest(), ua.CancelRequest()):
            request.RequestHeader.AuthenticationToken = client.uaclient.session.authentication_token
            with pytest.raises(ua.uaerrors.BadServiceUnsupported):
                await client.uaclient.protocol.send_request(request)


async def test_nobody_takes_over_anothers_subscription(gateway: Running) -> None:
    async with client_of(gateway) as owner, client_of(gateway) as other:
        number, _ = await subscribe(owner, 100)
        wanted = ua.TransferSubscriptionsParameters(SubscriptionIds=[number], SendInitialValues=True)
        (result,) = await other.uaclient.transfer_subscriptions(wanted)
        assert result.StatusCode.name == "BadSubscriptionIdInvalid"


async def test_nodes_cannot_be_added(gateway: Running) -> None:
    async with client_of(gateway, "engineer") as client:
        with pytest.raises(ua.uaerrors.BadUserAccessDenied):
            await client.nodes.objects.add_folder(2, "mine")


@pytest.mark.parametrize(
    "data",
    [
        b"HELF" + (2**31 - 1).to_bytes(4, "little") + bytes(64),
        b"MSGF" + (70_000).to_bytes(4, "little") + bytes(64),
        b"MSGF" + (64).to_bytes(4, "little") + bytes(56),
        b"OPNF" + (64).to_bytes(4, "little") + b"\xff" * 56,
        b"GET / HTTP/1.1\r\nHost: plant\r\n\r\n",
        b"HELF" + (8).to_bytes(4, "little"),
        b"HELF" + (32).to_bytes(4, "little") + bytes(20) + b"\xff\xff\xff\xff",
    ],
    ids=["2 GiB", "large chunk", "before hello", "noise", "http", "empty", "no buffers"],
)
async def test_d1_malformed_input_ends_the_connection(gateway: Running, data: bytes) -> None:
    reader, writer = await reach(gateway)
    writer.write(data)
    with contextlib.suppress(ConnectionError):
        async with asyncio.timeout(5):
            await reader.read()
    writer.close()
    async with client_of(gateway) as client:
        await client.nodes.server_state.read_value()
