"""H17: a value that is older than promised says so."""

from gateway.core.store import Store
from gateway.tag import Quality, Sample

GOOD = Sample("a", 42.0, Quality.GOOD, 7, 1.0)


def test_a_tag_that_nobody_read_is_waiting() -> None:
    sample = Store().sample("a", 9)
    assert (sample.value, sample.quality, sample.time) == (None, Quality.WAITING, 9)


def test_uncertain_after_two_periods_bad_after_five() -> None:
    store = Store()
    store.put(GOOD, at=100.0)
    assert store.aged("a", 1.0, 102.0, 50) is None
    stale = store.aged("a", 1.0, 102.1, 50)
    assert stale is not None
    assert (stale.value, stale.quality, stale.time) == (42.0, Quality.STALE, 7)
    assert store.aged("a", 1.0, 103.0, 50) is None, "told once"
    dead = store.aged("a", 1.0, 105.1, 50)
    assert dead is not None
    assert (dead.value, dead.quality, dead.time) == (None, Quality.NO_COMMUNICATION, 50)
    assert store.aged("a", 1.0, 200.0, 50) is None


def test_a_bad_sample_does_not_age() -> None:
    store = Store()
    store.put(Sample("a", None, Quality.REFUSED, 7), at=1.0)
    assert store.aged("a", 1.0, 1000.0, 50) is None
