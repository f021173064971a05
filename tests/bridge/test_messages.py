"""Messages of the bridge arrive as they were sent, and what is none is refused by its name."""

from __future__ import annotations

import pytest

from gateway.bridge.api import BridgeError
from gateway.bridge.messages import (
    LENGTH_BYTES,
    MAX_MESSAGE,
    Promised,
    ReadTags,
    Request,
    Response,
    Watch,
    Wrong,
    body_length,
    pack,
    unpack_request,
    unpack_response,
)

REQUESTS = [Watch(1, {"a.b": 0.5, "a.c": None}), ReadTags(2, ("a.b",), 1.5)]
RESPONSES = [Promised(1, {"a.b": 0.5}), Wrong(0, "who are you?")]


def body(message: Request | Response) -> bytes:
    """What stands behind the header, which must say how long it is."""
    packed = pack(message)
    header, rest = packed[:LENGTH_BYTES], packed[LENGTH_BYTES:]
    assert body_length(header) == len(rest)
    return rest


@pytest.mark.parametrize("request_", REQUESTS)
def test_a_request_arrives_as_it_was_sent(request_: Request) -> None:
    assert unpack_request(body(request_)) == request_


@pytest.mark.parametrize("response", RESPONSES)
def test_a_response_arrives_as_it_was_sent(response: Response) -> None:
    assert unpack_response(body(response)) == response


def test_what_is_no_message_is_refused() -> None:
    for nonsense in (b"", b"\xc1", body(RESPONSES[0])):
        with pytest.raises(BridgeError, match="not a bridge request: "):
            unpack_request(nonsense)
    for nonsense in (b"", b"\xc1", body(REQUESTS[0])):
        with pytest.raises(BridgeError, match="not a bridge response: "):
            unpack_response(nonsense)


def test_a_message_that_is_too_long_is_refused_before_it_is_read() -> None:
    assert body_length(MAX_MESSAGE.to_bytes(LENGTH_BYTES, "big")) == MAX_MESSAGE
    with pytest.raises(BridgeError, match=f"{MAX_MESSAGE + 1} bytes was announced; at most {MAX_MESSAGE} "):
        body_length((MAX_MESSAGE + 1).to_bytes(LENGTH_BYTES, "big"))
