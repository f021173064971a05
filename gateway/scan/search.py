"""The scan itself as a generator: it yields what is to be done next and is sent what came of it. Pure."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field

from gateway.mapping.profile import Profile
from gateway.scan.ask import Answer, Ask
from gateway.scan.judge import Suggestion, suggestions
from gateway.scan.order import Plan, Round, Setting
from gateway.scan.signature import checks_of


@dataclass(frozen=True, slots=True)
class SetTo:
    """Open the port in this setting."""

    round: Round


@dataclass(frozen=True, slots=True)
class Query:
    """Ask a unit. ``settle``: then let as much time pass again, so that no late reply is left behind."""

    unit: int
    ask: Ask
    patience: float
    settle: bool = False


@dataclass(frozen=True, slots=True)
class Found:
    """Somebody answers. ``answer`` is the first one; ``suggestions`` are all profiles, the best first."""

    setting: Setting
    unit: int
    answer: Answer
    suggestions: tuple[Suggestion, ...]

    @property
    def likely(self) -> list[Suggestion]:
        """The profiles that fit well enough to be named."""
        return [suggestion for suggestion in self.suggestions if suggestion.likely]


@dataclass(slots=True)
class Report:
    """What a scan brought so far."""

    found: list[Found] = field(default_factory=list)
    unclear: list[tuple[Setting, int]] = field(default_factory=list)
    """Where something came back that is no reply."""
    tried: list[Setting] = field(default_factory=list)
    """Settings that were tried to the end."""
    asked: int = 0


Step = SetTo | Query | Found
Scan = Generator[Step, Answer | None, None]


def search(plan: Plan, report: Report) -> Scan:
    """Try every round of a plan; ``report`` tells at any time what is known."""
    for each in plan.rounds:
        yield SetTo(each)
        known = {found.unit for found in report.found if found.setting.alike == each.setting.alike}
        before = len(report.found)
        for unit in each.units:
            if unit not in known:
                yield from _unit(plan, each, unit, report)
        report.tried.append(each.setting)
        if len(report.found) > before and not plan.all_rounds:
            return


def _unit(plan: Plan, each: Round, unit: int, report: Report) -> Scan:
    for ask in each.asks:
        answer = yield from _asked(Query(unit, ask, plan.patience), report)
        if answer.reply is not None:
            answers = yield from _identify(plan, Query(unit, ask, plan.patience), answer, report)
            judged = suggestions(plan.profiles, each.setting, unit, answers)
            found = Found(each.setting, unit, answer, tuple(judged))
            report.found.append(found)
            yield found
            return
        if answer.noise and (each.setting, unit) not in report.unclear:
            report.unclear.append((each.setting, unit))


def _identify(
    plan: Plan, first: Query, answer: Answer, report: Report
) -> Generator[Step, Answer | None, dict[Ask, Answer]]:
    """Put to the unit whatever tells the profiles apart."""
    answers = {first.ask: answer}
    for ask in _telling(plan.profiles, plan.forbidden):
        if ask not in answers:
            answers[ask] = yield from _asked(Query(first.unit, ask, first.patience, settle=True), report)
    return answers


def _telling(profiles: tuple[Profile, ...], forbidden: frozenset[int]) -> list[Ask]:
    asks = dict.fromkeys(check.ask for p in profiles for check in checks_of(p))
    return [ask for ask in asks if forbidden.isdisjoint(range(ask.address, ask.address + ask.count))]


def _asked(query: Query, report: Report) -> Generator[Step, Answer | None, Answer]:
    report.asked += 1
    answer = yield query
    assert answer is not None
    return answer
