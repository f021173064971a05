"""What every key of a site file means, for the reference and for editors. Data."""

from __future__ import annotations

from collections.abc import Mapping

from gateway.mapping.meanings import Meaning

M = Meaning

SITE: Mapping[str, Mapping[str, Meaning]] = {
    "RawSite": {
        "site": M("name of the plant: letters, digits, `-`, `_`", "plant7"),
        "gateway": M("name of this gateway within it", "gw1"),
        "profiles": M(
            "folders of profiles, sought before the site's own and the built-in ones", "[./drives]"
        ),
        "lines": M("name to line", "{north: {port: /dev/ttyUSB0, serial: 9600 8N2, drives: {...}}}"),
        "names": M("how drives, points and commands are called outside"),
        "starts": M(
            "groups of drives that start one after another, to limit the inrush",
            "{hall-2: {drives: [fan-1, fan-2], apart: 5s}}",
        ),
        "rates": M(
            "rate class to period; `fast`, `normal` and `slow` always exist",
            "{fast: 500ms}",
            "fast 200ms, normal 1s, slow 30s",
        ),
        "writes": M("whether anything is written to any drive"),
        "comm_loss": M("what drives must do when the line dies", "stop", "what they do is only shown"),
        "opcua": M("the OPC UA server", default="none"),
        "mqtt": M("the brokers"),
        "web": M("the web page; not served by this version"),
        "data": M("folder of journal, outbox and certificates", "/var/lib/gateway"),
    },
    "Line": {
        "port": M(
            "device path, `tcp://host:port` (RTU over TCP), `modbus://host:port` (Modbus TCP), `simulated`",
            "/dev/ttyUSB0",
        ),
        "framing": M("must be written when a drive speaks both", "ascii", "rtu"),
        "serial": M("speed and format; only a `modbus://` port needs none", "9600 8N2", "required"),
        "rs485": M("options of the transceiver", "{echo: true}"),
        "broadcast": M("who may command all its drives at once", "engineer", "nobody"),
        "drives": M("name to drive", "{fan-1: {profile: teco-7200gs, unit: 5}}"),
    },
    "BroadcastRight": {"role": M("least role for running them; a stop takes an operator", "engineer")},
    "LossDemand": {
        "action": M(
            "`stop`, `keep_running` or `any`; nothing but a stop is written to a drive that does otherwise",
            "stop",
        ),
        "within": M("it must stop so soon after the line died", "3s", "whenever it does"),
    },
    "Rs485": {
        "echo": M("the transceiver gives back what is sent", "true"),
        "rts": M("how RTS switches the direction", "send_high"),
    },
    "Drive": {
        "profile": M("which model", "teco-7200gs"),
        "unit": M("its unit address on the line", "5"),
        "ranges": M(
            "point to limits in its unit; can only narrow the profile's", "{frequency_command: [0, 50]}"
        ),
        "settings": M("values of the profile's settings", "{max_frequency: 50}"),
        "limits": M(
            "point to how fast it may be changed; can only narrow the profile's",
            "{frequency_command: {step: 10, slew: 2}}",
        ),
        "wear_per_day": M(
            "point to how often in a day it may be written, instead of what `writes` says",
            "{enter_eeprom: 2}",
        ),
        "control": M("who may command it, and what happens when he goes away"),
        "comm_loss": M("what it must do when the line dies", "stop", "that of the site"),
        "names": M("how it and what belongs to it are called outside"),
    },
    "Control": {
        "lease": M(
            "`session`: the first command takes the lease; `required`: it must be taken first; `off`: none",
            "required",
        ),
        "ttl": M("how long a lease lasts that nobody renews; at least 500ms", "30s"),
        "on_expiry": M(
            "what happens then: `stop`, `hold` or `{setpoint: 20}`; must be chosen once writes are on", "stop"
        ),
        "takeover": M("least role that may take the lease away from its holder", "operator"),
        "on_reappear": M(
            "what is done about a drive that comes back running without a command: `report` or `stop`",
            "stop",
        ),
    },
    "Limit": {
        "step": M("the most that one write may change it, in the unit", "10", "any"),
        "slew": M("rate at which it is taken to a new value, in the unit per second", "2", "at once"),
        "interval": M("least time between two writes", "500ms", "0ms"),
    },
    "Starts": {
        "drives": M("the drives that start one after another", "[fan-1, fan-2]"),
        "apart": M("least time between two of their starts", "5s"),
    },
    "MemberNames": {
        "node": M(
            "OPC UA node id of points and commands, the part behind `s=`",
            "<line>.<drive>.<point>",
            "<drive>.<point>",
        ),
        "browse": M("OPC UA browse name of points and commands", "<point>", "<point>"),
        "topic": M(
            "last part of the MQTT topics of points and commands; may have levels",
            "<group>/<point>",
            "<point>",
        ),
    },
    "Templates": {
        "drive_node": M("OPC UA node id of drives", "<line>.<drive>", "<drive>"),
        "drive_browse": M("OPC UA browse name of drives", "<drive>", "<drive>"),
        "drive_topic": M(
            "what all MQTT topics of a drive begin with", "<site>/<line>/<drive>", "<site>/<drive>"
        ),
    },
    "DriveNames": {
        "points": M("single points and commands", "{output_frequency: {node: FAN1.SPEED, topic: speed}}"),
    },
    "Writes": {
        "enabled": M("nothing is written to any drive until this is `true`", "true"),
        "wear_per_day": M(
            "how often in a day a point may be written that wears by it; 0: never, at most 1000", "5"
        ),
    },
    "Opcua": {
        "endpoint": M("where it listens", "opc.tcp://127.0.0.1:4840"),
        "security": M("what is offered; `none` only on this machine", "[sign_and_encrypt]"),
        "anonymous": M("whether people without a name may read; only on this machine", "read"),
        "users_file": M("who may log in; see `gateway users`", "users.yaml", "users.yaml in `data`"),
        "certificates": M(
            "folder of the own and the trusted certificates", "./pki", "certificates in `data`"
        ),
        "password": M("refused: a password may not stand in this file"),
    },
    "Mqtt": {
        "name": M("name of the section, unique in the site", "cloud", "mqtt, mqtt-2, ..."),
        "broker": M("`mqtt://`, `mqtts://`, `ws://`, `wss://`, or `embedded`", "mqtts://broker.plant7:8883"),
        "user": M("who we are there; needed on the network", "gw1"),
        "password_file": M("file with the password", "broker.password"),
        "ca_file": M(
            "certificates of authorities that vouch for the broker", "ca.pem", "those of the system"
        ),
        "client_id": M("client id", "gw1-cloud", "<site>-<gateway>-<name>"),
        "commands": M("whether this broker may command, and as whom", "{role: operator}", "no commands"),
        "publish": M("what it gets, and how often", default="monitor points at their profile's rate"),
        "sparkplug": M("not supported by this version"),
        "password": M("refused: a password may not stand in this file"),
    },
    "Commanding": {"role": M("role of those who command through it", "operator")},
    "Publish": {
        "points": M("glob patterns of point names, or with a dot of whole tags", '["output_*", fan-1.fault]'),
        "rate": M("rate class or time", "500ms"),
        "deadband": M("changes up to this are not sent, in the point's unit", "0.05", "every change"),
        "max_silence": M("sent at least this often", "60s"),
    },
    "Web": {"listen": M("address and port", "127.0.0.1:8080")},
}
