"""Golden transcripts: what goes over the wire in a given situation, compared as text.

Set ``TRANSCRIPTS=write`` in the environment to write them anew after a wanted change, and read the diff.
"""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from gateway.line.interface import Priority, Read, Want, Write
from tests.line.bench import Bench, FakeUnit, facts

FOLDER = Path(__file__).parent.parent / "transcripts"
SCENES: dict[str, Callable[[], Bench]] = {}


def scene(play: Callable[[], Bench]) -> Callable[[], Bench]:
    SCENES[play.__name__] = play
    return play


@scene
def section_11_of_the_7200gs() -> Bench:
    """60 Hz forward, 30 Hz forward, 30 Hz reverse, stop: the document's four steps."""
    bench = Bench([facts()], [FakeUnit()]).start()
    bench.run(1)
    for words in ((1, 6000), (1, 3000), (3, 3000), (0,)):
        bench.ask(Write(5, 1, words), Priority.COMMAND if words[0] else Priority.STOP)
        bench.run(0.1)
    return bench


@scene
def polling_two_units_and_a_write_between() -> Bench:
    """Two units in their phases; a setpoint goes out as soon as the wire is free, then its proof."""
    fakes = [FakeUnit(u, registers={0x20: 5, 0x24: 6000}) for u in (5, 6)]
    bench = Bench([facts(5), facts(6)], fakes).start(Want(5, 0x20, 5, 0.2), Want(6, 0x24, 1, 0.4))
    bench.run(0.45)
    bench.ask(Write(5, 2, (3000,)))
    bench.ask(Read(5, 2, 1))
    bench.run(0.4)
    return bench


@scene
def a_lost_reply_and_its_late_answer() -> Bench:
    """After a time-out the next read has another length; the late answer is left aside."""
    fake = FakeUnit(registers={0x20: 5, 0x28: 400})
    bench = Bench([facts()], [fake]).start(Want(5, 0x20, 1, 0.5), Want(5, 0x28, 1, 0.5))
    bench.run(0.4)
    delays = iter([0.06])
    fake.late = lambda: next(delays, 0.0)
    bench.run(0.7)
    return bench


@scene
def loop_back_after_silence() -> Bench:
    """A unit with function 08H is put in step by a nonce."""
    fake = FakeUnit(functions=(3, 8, 16), registers={0x20: 5})
    unit = facts(functions=(3, 8, 16), loop_back=True)
    bench = Bench([unit], [fake]).start(Want(5, 0x20, 1, 0.5))
    bench.run(0.4)
    fake.on = False
    bench.run(0.12)
    fake.on = True
    bench.run(0.5)
    return bench


@scene
def noise_strangers_and_exceptions() -> Bench:
    """A stranger's frame before the reply; then busy, said as exception 06H."""
    fake = FakeUnit(before=bytes.fromhex("00 FF 07 03 02 00 00 31 84"), registers={0x24: 3000})
    bench = Bench([facts()], [fake]).start(Want(5, 0x24, 1, 0.5))
    bench.run(0.3)
    fake.before, fake.refuse = b"", {16: 6}
    bench.ask(Write(5, 1, (1,)))
    bench.run(0.1)
    return bench


@pytest.mark.parametrize("name", SCENES)
def test_transcript(name: str) -> None:
    bench = SCENES[name]()
    text = f"# {SCENES[name].__doc__}\n{bench.transcript()}"
    path = FOLDER / f"{name}.txt"
    if os.environ.get("TRANSCRIPTS") == "write":
        path.write_text(text)
    assert text == path.read_text()


def test_no_transcript_is_left_over() -> None:
    ours = {path.stem for path in FOLDER.glob("*.txt")}
    assert ours >= set(SCENES)
