"""Who may command a drive, in the manner of the locking of OPC 10000-100 (Devices, section 7).

``Lock`` is that specification's: InitLock acquires the lease, RenewLock renews it, ExitLock releases it, and
BreakLock takes it over at once. Their only output is a number, so they answer Good with -1 where somebody
else holds the lease. ``Administration`` has what its methods have no room for.
"""

from __future__ import annotations

from collections.abc import Awaitable, Sequence
from typing import NamedTuple

from asyncua import ua

from gateway.bridge.api import Bridge, ControlInfo, DriveInfo, LeaseAct, PointInfo
from gateway.northbound.opcua.commands import OUTPUTS, add_arguments, argument
from gateway.northbound.opcua.model import AskCore, MethodNode, Model, TagNode, variant_type
from gateway.northbound.opcua.names import drive_node, part_of, structural
from gateway.northbound.opcua.nodes import NodeBuilder, Shape
from gateway.northbound.opcua.plain import node_id
from gateway.northbound.opcua.status import bad_value
from gateway.tag import Origin, Outcome, Role, Value, tag_of

LOCKED = {
    "Locked": "_locked",
    "LockingUser": "_lease_holder",
    "LockingClient": "_lease_through",
    "RemainingLockTime": "_lease_left",
}
"""Variables of a lock and the gateway's own points that they show."""

OK, NOT_YOURS = 0, -1
"""What the methods of a lock answer."""

MAINTENANCE_ARGUMENTS = (
    ("On", "", ua.VariantType.Boolean),
    ("Reason", "shown to whoever is refused", ua.VariantType.String),
)
CONFIRMED_ARGUMENTS = (
    ("Point", "name of the point", ua.VariantType.String),
    ("Value", "of the point's type", ua.VariantType.Variant),
    ("Confirm", "what the value does, in the words of the refusal of a plain write", ua.VariantType.String),
)


class Method(NamedTuple):
    """A method of a lock: what it does, the name of its output, what it takes, and what a person reads."""

    act: LeaseAct
    output: str
    inputs: tuple[tuple[str, str], ...]
    help: str


METHODS = {
    "InitLock": Method(
        LeaseAct.ACQUIRE, "InitLockStatus", (("Context", "passed over"),), "Acquire the lease of the drive."
    ),
    "RenewLock": Method(LeaseAct.RENEW, "RenewLockStatus", (), "Renew it; a living session does so itself."),
    "ExitLock": Method(LeaseAct.RELEASE, "ExitLockStatus", (), "Release it for somebody else to acquire."),
    "BreakLock": Method(LeaseAct.TAKE, "BreakLockStatus", (), "Take it over from whoever holds it."),
}


def add_lock(nodes: NodeBuilder, model: Model, drive: DriveInfo) -> None:
    """Add the lock of a drive: what it shows, and its methods."""
    node = drive_node(drive)
    lock = part_of(node, "Lock")
    nodes.object(lock, structural("Lock"), node, description=_rules(drive.control))
    points = {point.name: point for point in drive.points}
    for name, tag in LOCKED.items():
        if tag in points:
            _add_shown(nodes, model, lock, name, tag_of(drive.name, tag), points[tag])
    for name, method in METHODS.items():
        own = part_of(lock, name)
        nodes.method(own, structural(name), lock, method.help)
        if method.inputs:
            add_arguments(nodes, own, "InputArguments", [argument(*given) for given in method.inputs])
        told = argument(method.output, "0: done; -1: somebody else holds it, or nobody", ua.VariantType.Int32)
        add_arguments(nodes, own, "OutputArguments", [told])
        role = drive.control.takeover if method.act is LeaseAct.TAKE else Role.OPERATOR
        takes = tuple(ua.VariantType.String for _ in method.inputs)
        ask = _ask_for(drive.name, method.act)
        what = f"{drive.name}/Lock/{name}"
        model.methods[own] = MethodNode(what, role, (lock,), takes, ask, is_lock=True)


def _ask_for(drive: str, act: LeaseAct) -> AskCore:
    def ask(bridge: Bridge, values: Sequence[Value], origin: Origin, ttl: float) -> Awaitable[Outcome]:
        return bridge.lease(drive, act, origin)

    return ask


def add_administration(nodes: NodeBuilder, model: Model, drive: DriveInfo) -> None:
    """Add the methods that are for few."""
    node = drive_node(drive)
    administration = part_of(node, "Administration")
    nodes.object(administration, structural("Administration"), node, description="What only few may do.")
    for method, role, help, given, ask in (
        (
            "SetMaintenance",
            Role.ENGINEER,
            "While maintenance is on, nothing but a stop is let through.",
            MAINTENANCE_ARGUMENTS,
            _ask_maintenance(drive.name),
        ),
        (
            "WriteConfirmed",
            Role.ADMIN,
            "Write a value that does harm. Confirm with the words of the refusal.",
            CONFIRMED_ARGUMENTS,
            _ask_confirmed(drive.name),
        ),
    ):
        own = part_of(administration, method)
        nodes.method(own, structural(method), administration, help)
        add_arguments(nodes, own, "InputArguments", [argument(*one) for one in given])
        add_arguments(nodes, own, "OutputArguments", [argument(*one) for one in OUTPUTS])
        takes = tuple(kind for _, _, kind in given)
        what = f"{drive.name}/Administration/{method}"
        model.methods[own] = MethodNode(what, role, (administration,), takes, ask)


def _ask_maintenance(drive: str) -> AskCore:
    def ask(bridge: Bridge, values: Sequence[Value], origin: Origin, ttl: float) -> Awaitable[Outcome]:
        on, reason = values
        return bridge.maintain(drive, bool(on), origin, str(reason))

    return ask


def _ask_confirmed(drive: str) -> AskCore:
    def ask(bridge: Bridge, values: Sequence[Value], origin: Origin, ttl: float) -> Awaitable[Outcome]:
        point, value, confirm = values
        return bridge.write(tag_of(drive, str(point)), value, origin, ttl, confirm=str(confirm))

    return ask


def _add_shown(
    nodes: NodeBuilder, model: Model, lock: ua.NodeId, name: str, tag: str, point: PointInfo
) -> None:
    kind = variant_type(point)
    data_type = ua.ObjectIds.Duration if name == "RemainingLockTime" else kind.value
    shape = Shape(node_id(data_type), node_id(ua.ObjectIds.BaseDataVariableType), description=point.help)
    node = part_of(lock, name)
    waiting = bad_value(ua.StatusCodes.BadWaitingForInitialData)
    nodes.variable(node, structural(name), lock, shape, waiting)
    model.add(node, TagNode(tag, point, kind))


def _rules(control: ControlInfo) -> str:
    if control.lease == "off":
        return "Who may command the drive. It needs no lease."
    how = "The first command acquires it." if control.lease == "session" else "It must be acquired first."
    end = f"{control.ttl:g} s after its last renewal: {control.on_expiry or 'hold'}."
    return f"The lease of the drive. {how} {end}"
