"""The values of the nodes: only ever what the core said, never what a client wrote."""

from __future__ import annotations

from collections.abc import Iterable

from asyncua import ua
from asyncua.server.address_space import AddressSpace, AttributeValue

from gateway.northbound.opcua.model import Model, TagNode
from gateway.northbound.opcua.status import bad_value, data_value
from gateway.tag import Quality, Sample


class Live:
    """Puts samples of watched tags into their nodes and tells the monitored items."""

    def __init__(self, space: AddressSpace, model: Model) -> None:
        self._model = model
        self._samples: dict[str, Sample] = {}
        self._values = {node: space[node].attributes[ua.AttributeIds.Value] for node in model.tags}

    def sample(self, tag: str) -> Sample | None:
        """The last sample of a watched tag; None when there is none yet."""
        return self._samples.get(tag)

    async def publish(self, sample: Sample) -> None:
        """The core told a sample."""
        self._samples[sample.tag] = sample
        for node in self._model.nodes.get(sample.tag, ()):
            await _put(self._values[node], shown(sample, self._model.tags[node]))

    def forget(self, tags: Iterable[str]) -> None:
        """Nobody watches these any more, so their values are not kept up and must not be shown."""
        for tag in tags:
            self._samples.pop(tag, None)
            for node in self._model.nodes.get(tag, ()):
                self._values[node].value = bad_value(ua.StatusCodes.BadWaitingForInitialData)


def shown(sample: Sample, node: TagNode) -> ua.DataValue:
    """What a node shows of a sample of its tag."""
    if node.text and sample.quality in (Quality.GOOD, Quality.STALE):
        named = Sample(sample.tag, sample.text or str(sample.value), sample.quality, sample.time)
        return data_value(named, node.kind)
    return data_value(sample, node.kind)


async def _put(attribute: AttributeValue, value: ua.DataValue) -> None:
    attribute.value = value
    for handle, notify in list(attribute.datachange_callbacks.items()):
        await notify(handle, value)
