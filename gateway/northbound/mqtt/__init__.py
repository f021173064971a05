"""The MQTT adapter: tags on topics, commands from topics. A process of its own, one per broker.

A sample's way out: `service` takes it from the bridge, `publisher` decides by its `rules` what is worth
telling and writes it as JSON (`payload`) for a topic (`topics`), `outbox` holds it until `link` has a
connection (`connection`) with room. A command's way in: `connection` hands the message to `commander`,
which has it read (`order`, `request`), checks that it is fresh (`freshness`) and new (`once`), has the
bridge asked (`runner`), and puts the true outcome into the outbox.
"""
