// viewer.cjs FOLDER URL TOPIC MESSAGES PROTOCOL: a client made of Foxglove's own libraries, below FOLDER/node_modules: the protocol
// (@foxglove/ws-protocol), schemas (@foxglove/rosmsg) and CDR (@foxglove/rosmsg2-serialization), which are those of Foxglove and
// Lichtblick. Prints a line of JSON for what the server says of itself, for all channels, and for each message.
const { createRequire } = require("module");
const [folder, url, topic, messages, protocol] = process.argv.slice(2);
const from = createRequire(folder + "/package.json");
const { FoxgloveClient } = from("@foxglove/ws-protocol");
const { parse } = from("@foxglove/rosmsg");
const { MessageReader } = from("@foxglove/rosmsg2-serialization");
const WebSocket = from("ws");

const print = (what) => console.log(JSON.stringify(what, (_, value) =>
  typeof value === "bigint" ? value.toString() : value instanceof Uint8Array ? Buffer.from(value).toString("base64") : value));
const fail = (error) => { print({ error: String(error) }); process.exit(1); };

const client = new FoxgloveClient({ ws: new WebSocket(url, [protocol]) });
let left = Number(messages);
let decode;
client.on("error", fail);
client.on("close", (event) => left > 0 && fail(`closed: ${event.code} ${event.reason}`));
client.on("serverInfo", (info) => print({ info }));
client.on("status", (status) => print({ status }));
client.on("advertise", (channels) => {
  print({ channels });
  const found = channels.find((one) => one.topic === topic);
  if (found && !decode) {
    if (found.encoding === "cdr") {
      const reader = new MessageReader(parse(found.schema, { ros2: true }));
      decode = (data) => reader.readMessage(data);
    } else {
      decode = (data) => JSON.parse(new TextDecoder().decode(data));
    }
    client.subscribe(found.id);
  }
});
client.on("message", ({ timestamp, data }) => {
  if (left > 0) {
    print({ timestamp, message: decode(data) });
    if (--left === 0) {
      client.close();  // and the program ends when all is printed
    }
  }
});
