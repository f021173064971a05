"""The words of each diagnosis: which drive, how often, and what to do."""

from __future__ import annotations

import pytest

from gateway.core.ailments import Place, diagnosis
from gateway.line.doctor.finding import Finding, Illness
from tests.core.world import make_site

FORMAT = "9600 Bd 8N2"
CASES = [
    (Illness.PORT_DOWN, (), {}, "the port simulated: is not open: no such device"),
    (
        Illness.WRONG_FORMAT,
        (),
        {"drives": 2, "seconds": 5.1},
        "2 drives answered garbage and nothing else for 5 s: speed or format differ",
    ),
    (
        Illness.ALL_SILENT,
        (),
        {"drives": 1, "seconds": 6.0, "answered_before": 1},
        "nothing comes back any more from 1 drive that answered until 6 s ago",
    ),
    (
        Illness.ALL_SILENT,
        (),
        {"drives": 2, "seconds": 6.0, "answered_before": 0},
        "nothing came back from 2 drives in 6 s",
    ),
    (
        Illness.FOREIGN_MASTER,
        (5, 17),
        {"requests": 1, "replies": 3},
        "somebody else asks on this line: 1 request and 3 replies that are not ours, "
        "of fan-1 (unit 5) and unit 17",
    ),
    (
        Illness.TWO_DRIVES,
        (5,),
        {"second_replies": 5, "contradicting": 2},
        "fan-1 (unit 5) answers twice: 5 second replies, 2 of them saying something else",
    ),
    (
        Illness.TWO_DRIVES,
        (5,),
        {"second_replies": 5, "contradicting": 0},
        "fan-1 (unit 5) answers twice: 5 second replies",
    ),
    (
        Illness.TWO_DRIVES,
        (5,),
        {"garbled": 9, "replies": 1},
        "most replies of fan-1 (unit 5) are garbled (9, beside 1 good ones), those of other drives are not: "
        "two drives with this address talk at once, or its connection is bad",
    ),
    (
        Illness.LATE_ANSWERS,
        (5,),
        {"milliseconds": 310, "longest": 200, "replies": 3},
        "answers of fan-1 (unit 5) come after 310 ms, and its profile says 200 ms at most: "
        "it is waited for longer",
    ),
    (
        Illness.DRIVE_SILENT,
        (5,),
        {"unanswered": 1, "answering": 1},
        "fan-1 (unit 5) does not answer (1 request); 1 other does",
    ),
    (
        Illness.DRIVE_SILENT,
        (5, 6),
        {"unanswered": 3, "answering": 2},
        "fan-1 (unit 5) and fan-2 (unit 6) do not answer (3 requests); 2 others do",
    ),
    (
        Illness.NOISE,
        (),
        {"damaged": 1, "strays": 0, "replies": 9},
        "noise: 1 damaged reply, beside 9 good ones",
    ),
    (
        Illness.NOISE,
        (),
        {"damaged": 4, "strays": 2, "replies": 9},
        "noise: 4 damaged replies and 2 bursts of bytes that nobody sent, beside 9 good ones",
    ),
    (
        Illness.NOISE,
        (6,),
        {"damaged": 4, "strays": 0, "replies": 9},
        "4 damaged replies of fan-2 (unit 6) and of nobody else, beside 9 good ones",
    ),
]


@pytest.mark.parametrize(("illness", "units", "evidence", "words"), CASES)
def test_the_words_say_who_and_how_often(
    illness: Illness, units: tuple[int, ...], evidence: dict[str, float], words: str
) -> None:
    place = Place(make_site(2).lines[0], "simulated:: no such device")
    assert diagnosis(Finding(illness, units, evidence), place, 0).text == words


@pytest.mark.parametrize(("milliseconds", "reply"), [(310, "500ms"), (100, "150ms"), (101, "200ms")])
def test_the_remedy_for_late_answers_gives_room(milliseconds: int, reply: str) -> None:
    evidence = {"milliseconds": milliseconds, "longest": 50, "replies": 0}
    told = diagnosis(Finding(Illness.LATE_ANSWERS, (5,), evidence), Place(make_site().lines[0], ""), 0)
    assert f" to {reply};" in told.remedy
    assert told.text.endswith(": they are not waited for so long")
