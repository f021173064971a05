"""The names of asyncua that are overridden or leaned on. One that is renamed would silently do nothing."""

from __future__ import annotations

import inspect
from importlib.metadata import version
from typing import Any

import pytest
from asyncua.common.connection import SecureConnection, TransportLimits
from asyncua.server import Server
from asyncua.server.address_space import AddressSpace, AttributeValue, NodeData
from asyncua.server.binary_server_asyncio import BinaryServer, OPCUAProtocol
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_session import InternalSession
from asyncua.server.internal_subscription import InternalSubscription
from asyncua.server.monitored_item_service import MonitoredItemService
from asyncua.server.subscription_service import SubscriptionService
from asyncua.server.uaprocessor import UaProcessor

from gateway.northbound.opcua.channel import Channel
from gateway.northbound.opcua.engine import Engine, OpcUaServer
from gateway.northbound.opcua.items import Items
from gateway.northbound.opcua.session import Session
from gateway.northbound.opcua.subscriptions import Subscription, Subscriptions
from gateway.northbound.opcua.transport import Connection, Limits, Listener

OVERRIDES: list[tuple[type, type, str]] = [
    (Channel, UaProcessor, "process"),
    (Channel, UaProcessor, "open_secure_channel"),
    (Channel, UaProcessor, "process_message"),
    (Channel, UaProcessor, "_process_message"),
    (Channel, UaProcessor, "send_response"),
    (Channel, UaProcessor, "close"),
    (Channel, UaProcessor, "_should_close_session_on_transport_loss"),
    (Connection, OPCUAProtocol, "connection_made"),
    (Connection, OPCUAProtocol, "connection_lost"),
    (Connection, OPCUAProtocol, "data_received"),
    (Limits, TransportLimits, "create_acknowledge_and_set_limits"),
    (Listener, BinaryServer, "_make_protocol"),
    (OpcUaServer, Server, "start"),
    (Engine, InternalServer, "create_session"),
    (Engine, InternalServer, "register_server"),
    (Engine, InternalServer, "stop"),
    (Session, InternalSession, "create_session"),
    (Session, InternalSession, "close_session"),
    (Session, InternalSession, "read"),
    (Session, InternalSession, "write"),
    (Session, InternalSession, "call"),
    (Session, InternalSession, "create_monitored_items"),
    (Session, InternalSession, "modify_monitored_items"),
    (Subscriptions, SubscriptionService, "create_subscription"),
    (Subscriptions, SubscriptionService, "modify_subscription"),
    (Subscriptions, SubscriptionService, "republish"),
    (Subscription, InternalSubscription, "publish_results"),
    (Subscription, InternalSubscription, "_subscription_loop"),
    (Subscription, InternalSubscription, "_pop_publish_result"),
    (Subscription, InternalSubscription, "_pop_triggered_datachanges"),
    (Items, MonitoredItemService, "create_monitored_items"),
    (Items, MonitoredItemService, "datachange_callback"),
    (Items, MonitoredItemService, "_create_data_change_monitored_item"),
    (Items, MonitoredItemService, "_modify_monitored_item"),
    (Items, MonitoredItemService, "_set_monitoring_mode"),
    (Items, MonitoredItemService, "_delete_monitored_items"),
    (Items, MonitoredItemService, "_revise_queue_size"),
]

USED: list[tuple[type, str]] = [
    (UaProcessor, "forward_publish_response"),
    (UaProcessor, "get_publish_request"),
    (OPCUAProtocol, "_process_received_message_loop"),
    (Server, "_setup_server_nodes"),
    (Server, "_get_bind_socket_info"),
    (InternalServer, "lookup_external_session"),
    (InternalServer, "register_external_session"),
    (InternalSession, "activate_session"),
    (MonitoredItemService, "trigger_datachange"),
    (MonitoredItemService, "_create_events_monitored_item"),
    (SecureConnection, "is_open"),
    (AddressSpace, "read_attribute_value"),
]

READ_BY_NAME: list[tuple[type, str]] = [
    (UaProcessor, "self._publish_requests"),
    (UaProcessor, "self._connection"),
    (UaProcessor, "self._transport"),
    (OPCUAProtocol, "self._buffer"),
    (InternalServer, "self._external_sessions"),
    (InternalServer, "self.time_task"),
    (InternalServer, "if user_manager is None"),
    (InternalSession, "if self.iserver.user_manager is not None"),
    (InternalSubscription, "self._triggered_datachanges"),
    (InternalSubscription, "self._not_acknowledged_results"),
    (InternalSubscription, "self._publishing_enabled"),
    (MonitoredItemService, "self._monitored_item_counter += 1"),
    (MonitoredItemService, "self._monitored_datachange[handle]"),
    (AttributeValue, "self.datachange_callbacks"),
    (NodeData, "self.references"),
    (BinaryServer, "self._make_protocol"),
]


def parameters(function: Any) -> list[str]:
    return list(inspect.signature(function).parameters)


def test_the_version_is_the_one_that_was_read() -> None:
    assert version("asyncua").startswith("2.1.")


@pytest.mark.parametrize(("ours", "theirs", "name"), OVERRIDES, ids=lambda x: getattr(x, "__name__", x))
def test_each_override_replaces_something_of_the_same_shape(ours: type, theirs: type, name: str) -> None:
    assert issubclass(ours, theirs)
    assert ours.__dict__[name] is not theirs.__dict__[name]
    assert parameters(getattr(ours, name)) == parameters(getattr(theirs, name))
    awaited = inspect.iscoroutinefunction(getattr(ours, name))
    assert awaited == inspect.iscoroutinefunction(getattr(theirs, name))


@pytest.mark.parametrize(("theirs", "name"), USED, ids=lambda x: getattr(x, "__name__", x))
def test_each_method_that_is_called_is_there(theirs: type, name: str) -> None:
    assert callable(getattr(theirs, name))


@pytest.mark.parametrize(("theirs", "text"), READ_BY_NAME, ids=lambda x: getattr(x, "__name__", x))
def test_each_attribute_that_is_touched_is_there(theirs: type, text: str) -> None:
    assert text in inspect.getsource(theirs)
