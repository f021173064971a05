"""What a browsing client finds."""

from __future__ import annotations

import pytest
from asyncua import Client, Node, ua

from gateway.bridge.api import DIAGNOSTIC
from gateway.tag import Quality, Sample
from tests.opcua.support import Running, client_of, node

pytestmark = pytest.mark.asyncio(loop_scope="session")


async def names(parent: Node, reference: int = ua.ObjectIds.HierarchicalReferences) -> list[str]:
    found = await parent.get_references(reference, ua.BrowseDirection.Forward)
    return [item.BrowseName.Name for item in found]


async def type_of(client: Client, name: str) -> int:
    return (await node(client, name).read_type_definition()).Identifier


async def test_namespaces_stand_where_they_were_promised(gateway: Running) -> None:
    async with client_of(gateway) as client:
        assert await client.get_namespace_array() == [
            "http://opcfoundation.org/UA/",
            "urn:gateway:plant7:gw1",
            "urn:gateway:plant7",
            "urn:gateway:drives",
        ]


async def test_a_drive_has_the_parts_of_a_device(gateway: Running) -> None:
    async with client_of(gateway) as client:
        drive = await client.nodes.objects.get_child(["3:DeviceSet", "2:fan-1"])
        assert drive.nodeid == ua.NodeId("fan-1", 2)
        found = await names(drive)
        assert {"ParameterSet", "MethodSet", "Identification", "monitor", "sn", "control"} <= set(found)
        assert (await drive.read_type_definition()) == ua.NodeId("DriveType", 3)


async def test_all_points_are_in_the_parameter_set_and_in_their_group(gateway: Running) -> None:
    async with client_of(gateway) as client:
        known = gateway.bridge.catalogue.drives[0].points
        points = [point.name for point in known if point.kind != DIAGNOSTIC]
        assert await names(node(client, "fan-1/ParameterSet")) == points
        assert await names(node(client, "fan-1/group/sn")) == ["run_source"]


async def test_what_the_gateway_tells_of_a_drive_is_among_its_diagnostics(gateway: Running) -> None:
    async with client_of(gateway) as client:
        assert set(await names(node(client, "fan-1/Diagnostics"))) == {
            "_timeouts",
            "_locked",
            "_lease_holder",
        }
        gateway.bridge.samples["fan-1._timeouts"] = Sample("fan-1._timeouts", 7, Quality.GOOD, 10**18)
        timeouts = node(client, "fan-1._timeouts")
        assert await timeouts.read_value() == 7
        assert await timeouts.get_access_level() == {ua.AccessLevel.CurrentRead}


async def test_lines_are_shown_below_the_gateway(gateway: Running) -> None:
    async with client_of(gateway) as client:
        line = await client.nodes.objects.get_child(["3:Gateway", "3:Lines", "2:north"])
        assert line.nodeid == ua.NodeId("_north", 2)
        assert await names(line) == ["utilisation", "MethodSet"]
        gateway.bridge.samples["_north.utilisation"] = Sample(
            "_north.utilisation", 97.5, Quality.GOOD, 10**18
        )
        assert await node(client, "_north.utilisation").read_value() == 97.5
        assert await names(node(client, "_north/MethodSet")) == ["stop_all", "run_forward_all"]


async def test_the_nameplate(gateway: Running) -> None:
    async with client_of(gateway) as client:
        maker = await node(client, "fan-1").get_child("3:Manufacturer")
        assert await maker.read_value() == "TECO"
        assert "Model" in await names(node(client, "fan-1/Identification"))


async def test_references_can_be_followed_back(gateway: Running) -> None:
    async with client_of(gateway) as client:
        parents = await node(client, "fan-1.output_frequency").get_references(
            ua.ObjectIds.HierarchicalReferences, ua.BrowseDirection.Inverse
        )
        assert {item.NodeId.Identifier for item in parents} == {"fan-1/ParameterSet", "fan-1/group/monitor"}


@pytest.mark.parametrize(
    ("point", "definition", "kind"),
    [
        ("running", ua.ObjectIds.TwoStateDiscreteType, ua.VariantType.Boolean),
        ("output_frequency", ua.ObjectIds.AnalogUnitType, ua.VariantType.Double),
        ("frequency_command", ua.ObjectIds.AnalogUnitRangeType, ua.VariantType.Double),
        ("scan_count", ua.ObjectIds.DataItemType, ua.VariantType.Int64),
        ("run_source", ua.ObjectIds.MultiStateValueDiscreteType, ua.VariantType.Int32),
    ],
)
async def test_points_have_data_access_types(
    gateway: Running, point: str, definition: int, kind: ua.VariantType
) -> None:
    async with client_of(gateway) as client:
        assert await type_of(client, f"fan-1.{point}") == definition
        assert await node(client, f"fan-1.{point}").read_data_type_as_variant_type() == kind


async def test_units_and_ranges_are_told(gateway: Running) -> None:
    async with client_of(gateway) as client:
        command = node(client, "fan-1.frequency_command")
        unit = await (await command.get_child("0:EngineeringUnits")).read_value()
        assert (unit.UnitId, unit.DisplayName.Text) == (4740186, "Hz")
        limits = await (await command.get_child("0:EURange")).read_value()
        assert (limits.Low, limits.High) == (0.0, 60.0)
        assert await (await command.get_child("0:ValuePrecision")).read_value() == 2.0


async def test_enumerations_tell_their_values(gateway: Running) -> None:
    async with client_of(gateway) as client:
        values = await (await node(client, "fan-1.run_source").get_child("0:EnumValues")).read_value()
        assert [(item.Value, item.DisplayName.Text) for item in values] == [
            (0, "line"),
            (1, "operator_or_terminals"),
        ]


async def test_origin_and_register_are_told(gateway: Running) -> None:
    async with client_of(gateway) as client:
        frequency = node(client, "fan-1.output_frequency")
        assert (await frequency.read_description()).Text == "Source: sim 9.2."
        assert await (await frequency.get_child("0:Definition")).read_value() == "register 0024H"


@pytest.mark.parametrize(
    ("point", "access"), [("output_frequency", 1), ("frequency_command", 3), ("run_source", 3), ("run", 1)]
)
async def test_only_writable_points_say_so(gateway: Running, point: str, access: int) -> None:
    async with client_of(gateway) as client:
        level = await node(client, f"fan-1.{point}").read_attribute(ua.AttributeIds.AccessLevel)
        assert level.Value.Value == access


@pytest.mark.parametrize(("user", "access"), [("", 1), ("viewer", 1), ("operator", 1), ("engineer", 3)])
async def test_user_access_level_is_the_users_own(gateway: Running, user: str, access: int) -> None:
    async with client_of(gateway, user) as client:
        level = await node(client, "fan-1.run_source").read_attribute(ua.AttributeIds.UserAccessLevel)
        assert level.Value.Value == access


async def test_methods_tell_their_arguments(gateway: Running) -> None:
    async with client_of(gateway) as client:
        method = node(client, "fan-1.run_forward")
        (argument,) = await (await method.get_child("0:InputArguments")).read_value()
        assert argument.Name == "frequency"
        assert argument.DataType == ua.NodeId(ua.ObjectIds.Double)
        assert argument.Description.Text == "0 to 60 Hz"
        outputs = await (await method.get_child("0:OutputArguments")).read_value()
        assert [output.Name for output in outputs] == ["verdict", "reason"]


async def test_a_command_without_arguments_has_no_input_arguments(gateway: Running) -> None:
    async with client_of(gateway) as client:
        assert await names(node(client, "fan-1.stop")) == ["OutputArguments"]


async def test_the_active_configuration_can_be_read(gateway: Running) -> None:
    async with client_of(gateway) as client:
        digest = await client.nodes.objects.get_child(["3:Gateway", "3:ConfigurationDigest"])
        assert await digest.read_value() == "d" * 64
