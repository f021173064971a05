"""From the shape of a profile file to the resolved profile: defaults, inheritance, names looked up."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import MappingProxyType

from gateway.mapping import facts, forms
from gateway.mapping.commands import CommandMaker
from gateway.mapping.dependent import DependentMaker
from gateway.mapping.encodings import Encodings
from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError
from gateway.mapping.inherit import Sources
from gateway.mapping.layout import Layout
from gateway.mapping.lost import PLACING
from gateway.mapping.model import RawProfile
from gateway.mapping.node import Path
from gateway.mapping.notation import Notations
from gateway.mapping.points import PointMaker
from gateway.mapping.profile import (
    OURS,
    Access,
    Broadcast,
    Command,
    Document,
    Kind,
    ModbusFacts,
    Point,
    Profile,
    Setting,
)
from gateway.mapping.settings import SettingMaker
from gateway.mapping.twins import TwinMaker
from gateway.mapping.values import Conditions


@dataclass(frozen=True, slots=True)
class Resolved:
    """A profile together with what its checks need to know about the file."""

    profile: Profile
    layout: Layout
    conditions: Conditions
    broadcast: Layout
    """The layout of what is sent to all drives at once; empty without it."""


def resolve(raw: RawProfile, report: Report) -> Resolved:
    """The profile that a file means. What cannot be resolved is complained about and left out."""
    return _Resolver(raw, report).run()


class _Resolver:
    """The tools for one file, and the order in which they are used."""

    def __init__(self, raw: RawProfile, report: Report) -> None:
        self.raw = raw
        self.report = report
        documents = {name: Document(entry.title, entry.similar) for name, entry in raw.documents.items()}
        self.documents = MappingProxyType(documents)
        if OURS in documents:
            message = f"`{OURS}` stands for what is in no document"
            report.error(("documents", OURS), message, "use another id", key=True)
        self.sources = Sources(self.documents, report)
        self.notations = Notations(raw.addresses, report)
        self.encodings = Encodings(raw.values, raw.modbus, report)
        self.broadcast_layout = Layout()

    def run(self) -> Resolved:
        raw = self.raw
        settings = self.settings()
        layout = self.layout()
        dependents = DependentMaker(layout, self.encodings, self.report)
        layout.points.update({name: dependents.with_cases(p) for name, p in layout.points.items()})
        conditions = Conditions(self.sound(layout), settings, self.report)
        points = {name: dependents.make(point, conditions) for name, point in layout.points.items()}
        dependents.look_up(layout.set_aside, conditions)
        modbus = facts.modbus_facts(raw.modbus, self.notations, self.report)
        modbus = replace(
            modbus,
            probe=raw.modbus.probe.value if raw.modbus.probe else default_probe(points),
            identity=conditions.find(raw.modbus.identity, ("modbus", "identity")),
        )
        sound = {name: point for name, point in points.items() if name not in layout.doubtful}
        maker = CommandMaker(sound, modbus, conditions, self.sources, self.report)
        twins = TwinMaker(sound, settings, self.notations, conditions, self.report)
        profile = Profile(
            name=raw.profile,
            title=raw.title,
            maker=raw.maker,
            models=tuple(raw.models),
            version=raw.version,
            documents=self.documents,
            notations=facts.notation_facts(raw.addresses, self.sources),
            serial=facts.serial_facts(raw.serial, conditions, self.report),
            modbus=modbus,
            settings=MappingProxyType(settings),
            errors=MappingProxyType(facts.error_meanings(raw.errors, conditions, self.sources, self.report)),
            points=MappingProxyType(points),
            words=MappingProxyType(layout.words),
            commands=MappingProxyType(self.commands(maker)),
            groups=MappingProxyType({name: group.help or "" for name, group in raw.groups.items()}),
            facts=facts.facts_with_provenance(raw, self.sources),
            broadcast=self.broadcast(conditions, modbus),
            simulate=twins.make(raw.simulate),
        )
        self.one_name_space(layout)
        return Resolved(profile, layout, conditions, self.broadcast_layout)

    def settings(self) -> dict[str, Setting]:
        maker = SettingMaker(self.encodings, self.sources, self.report)
        section = self.raw.settings
        entries = section.__pydantic_extra__ or {}
        made = (
            maker.make(name, entry, [(("settings",), section), (("settings", name), entry)])
            for name, entry in entries.items()
        )
        return {setting.name: setting for setting in made if setting is not None}

    def layout(self) -> Layout:
        maker = PointMaker(self.notations, self.encodings, self.sources, self.report)
        for name, group in self.raw.groups.items():
            maker.add(name, group, ("groups", name))
        return maker.layout

    def sound(self, layout: Layout) -> dict[str, Point]:
        """The points that others may be judged by: those that have no error of their own."""
        for name, keys in layout.keys.items():
            wrong = keys.wrong(self.report)
            if wrong or self.report.doubtful(keys.path) or not self.encodings.knows(keys.traits.values):
                layout.doubtful.add(name)
                self.report.lost.declare(name)
            if wrong & set(PLACING) or self.report.displaced(keys.path):
                layout.displaced.add(name)
        return {name: point for name, point in layout.points.items() if name not in layout.doubtful}

    def broadcast(self, conditions: Conditions, modbus: ModbusFacts) -> Broadcast | None:
        """What may be sent to all drives at once: its own points, and commands proved by the drives' own."""
        raw = self.raw.broadcast
        if raw is None:
            return None
        maker = PointMaker(self.notations, self.encodings, self.sources, self.report)
        maker.add("broadcast", raw, ("broadcast",))
        points = {
            name: replace(p, access=Access.WRITE, only_when=()) for name, p in maker.layout.points.items()
        }
        self.broadcast_layout = maker.layout
        sound = {name: points[name] for name in self.sound(maker.layout)}
        commands = CommandMaker(sound, modbus, conditions, self.sources, self.report)
        place: Path = ("broadcast", "commands")
        return Broadcast(
            points=MappingProxyType(points),
            words=MappingProxyType(maker.layout.words),
            commands=MappingProxyType(
                {
                    name: commands.make(name, entry, [(("broadcast",), raw), ((*place, name), entry)])
                    for name, entry in raw.commands.items()
                }
            ),
            provenance=self.sources.of([(("broadcast",), raw)]),
        )

    def commands(self, maker: CommandMaker) -> dict[str, Command]:
        section = self.raw.commands
        entries = section.__pydantic_extra__ or {}
        return {
            name: maker.make(name, entry, [(("commands",), section), (("commands", name), entry)])
            for name, entry in entries.items()
        }

    def one_name_space(self, layout: Layout) -> None:
        """Points, settings and commands share topics and node ids: each name may stand once."""
        first: dict[str, Path] = {}
        settings: list[tuple[str, Path]] = [
            (name, ("settings", name)) for name in self.raw.settings.__pydantic_extra__ or {}
        ]
        commands: list[tuple[str, Path]] = [
            (name, ("commands", name)) for name in self.raw.commands.__pydantic_extra__ or {}
        ]
        broadcasts: list[tuple[str, Path]] = [
            (name, ("broadcast", "commands", name))
            for name in (self.raw.broadcast.commands if self.raw.broadcast else ())
        ]
        for name, path in [*settings, *layout.names, *commands, *self.broadcast_layout.names, *broadcasts]:
            if path[0] not in ("groups", "broadcast") or path in dict(broadcasts).values():
                self._snake_case(name, path)
            if name in first:
                line = self.report.root.mark(first[name], key=True)[0]
                self.report.error(
                    path, f"the name `{name}` is taken", f"line {line} has it; use another", key=True
                )
            first.setdefault(name, path)

    def _snake_case(self, name: str, path: Path) -> None:
        try:
            forms.name(name)
        except FormError as error:
            self.report.error(path, error.message, error.remedy, key=True)


def default_probe(points: dict[str, Point]) -> str:
    """The first status point that can be read, else the first point that can."""
    readable = [point for point in points.values() if point.access.readable]
    status = [point for point in readable if point.kind is Kind.STATUS]
    return (status or readable)[0].name if readable else ""
