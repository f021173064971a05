// An MQTT client that shares no code with the gateway. Arguments: broker URL, protocol level.
// Waits for the gateway's birth, sends a setpoint and a stop, and prints as JSON what it saw.
import { createRequire } from "node:module";

const require = createRequire(process.env.CLIENTS + "/package.json");
const mqtt = require("mqtt");
const [url, level] = process.argv.slice(2);
const seen = {};
const client = mqtt.connect(url, { protocolVersion: Number(level), reconnectPeriod: 0 });

function done(code) {
  console.log(JSON.stringify(seen));
  client.end(true, () => process.exit(code));
}

setTimeout(() => done(1), 15000);
client.on("error", (error) => { seen.error = String(error); done(1); });
client.on("connect", () => client.subscribe("plant7/#", { qos: 1 }));
client.on("message", (topic, payload) => {
  const text = payload.toString();
  seen[topic] = JSON.parse(text || "null");
  if (topic === "plant7/_gateway/gw1/status" && seen[topic].status === "online") {
    const command = { id: "js-1", v: 12.5, epoch: seen[topic].epoch, by: "js" };
    client.publish("plant7/fan-1/cmd/frequency_command", JSON.stringify(command), { qos: 1 });
  }
  if (topic === "plant7/fan-1/ack/frequency_command") client.publish("plant7/fan-1/cmd/stop", "", { qos: 1 });
  if (topic === "plant7/fan-1/ack/stop") done(0);
});
