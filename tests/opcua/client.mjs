// An OPC UA client that shares no code with the gateway. Carries out a list of steps and prints a JSON
// object with what it saw, one line per step:  node client.mjs <url> <user or -> <password> <steps as JSON>
import {
  AttributeIds, DataType, MessageSecurityMode, OPCUAClient, SecurityPolicy, TimestampsToReturn, UserTokenType,
} from "node-opcua";

const [url, user, password, steps] = process.argv.slice(2);
const DRIVES = 2;

const id = (name) => `ns=${DRIVES};s=${name}`;
const say = (seen) => console.log(JSON.stringify(seen));
const plain = (value) => ({
  value: value.value.value, type: DataType[value.value.dataType],
  status: value.statusCode.name, time: value.sourceTimestamp?.toISOString() ?? null,
});

const actions = {
  async browse(session, { node, children }) {
    const found = await session.browse(node ?? id(children));
    return found.references.map((reference) => reference.browseName.toString());
  },
  async read(session, { tag }) {
    return plain(await session.read({ nodeId: id(tag), attributeId: AttributeIds.Value }));
  },
  async analog(session, { tag }) {
    const path = (name) => id(`${tag}/${name}`);
    const [range, unit] = await session.read([
      { nodeId: path("EURange") }, { nodeId: path("EngineeringUnits") },
    ]);
    return {
      low: range.value.value.low, high: range.value.value.high,
      unit: unit.value.value.displayName.text, code: unit.value.value.unitId,
    };
  },
  async write(session, { tag, value }) {
    const status = await session.write({
      nodeId: id(tag), attributeId: AttributeIds.Value, value: { value: { dataType: DataType.Double, value } },
    });
    return status.name;
  },
  async both(session, { slow, fast }) {
    const order = [];
    await Promise.all([
      actions.write(session, slow).then(() => order.push("write")),
      actions.read(session, fast).then(() => order.push("read")),
    ]);
    return order;
  },
  async call(session, { drive, command, args = [] }) {
    const result = await session.call({
      objectId: id(`${drive}/MethodSet`), methodId: id(`${drive}.${command}`),
      inputArguments: args.map((value) => ({ dataType: DataType.Double, value })),
    });
    return { status: result.statusCode.name, outputs: (result.outputArguments ?? []).map((o) => o.value) };
  },
  async monitor(session, { tag, interval, until }) {
    const subscription = await session.createSubscription2({
      requestedPublishingInterval: 50, requestedLifetimeCount: 100, requestedMaxKeepAliveCount: 10,
      maxNotificationsPerPublish: 0, publishingEnabled: true, priority: 1,
    });
    const item = await subscription.monitor(
      { nodeId: id(tag), attributeId: AttributeIds.Value },
      { samplingInterval: interval, queueSize: 10, discardOldest: true }, TimestampsToReturn.Both,
    );
    say({ monitoring: tag });
    const seen = await new Promise((resolve) => item.on("changed", (value) => {
      if (value.value.value === until) resolve(plain(value));
    }));
    const revised = item.result.revisedSamplingInterval;
    await subscription.terminate();
    return { ...seen, revised };
  },
};

const client = OPCUAClient.create({
  endpointMustExist: false, securityMode: MessageSecurityMode.None, securityPolicy: SecurityPolicy.None,
  connectionStrategy: { maxRetry: 0 }, clientName: "independent",
});
const identity = user === "-"
  ? { type: UserTokenType.Anonymous }
  : { type: UserTokenType.UserName, userName: user, password };

try {
  await client.connect(url);
  const session = await client.createSession(identity);
  for (const { do: name, ...rest } of JSON.parse(steps)) say(await actions[name](session, rest));
  await session.close();
} catch (error) {
  say({ error: error.message });
} finally {
  await client.disconnect();
}
