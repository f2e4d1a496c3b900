// An OPC UA server of node-opcua for tests: one loop at 10 Hz, with history and bad values. It prints each value that it
// sets as a line [tag, milliseconds since 1970, value, status]; the first line is "ready". A file of such lines, as second
// argument, is the history of an earlier run.
const { OPCUAServer } = require("node-opcua-server");
const { DataType } = require("node-opcua-variant");
const { DataValue } = require("node-opcua-data-value");
const { StatusCodes, getStatusCodeFromCode } = require("node-opcua-status-code");
const { existsSync, readFileSync } = require("fs");
const port = Number(process.argv[2]);
const history = process.argv[3];

(async () => {
  const server = new OPCUAServer({ port, resourcePath: "/plant", allowAnonymous: true });
  await server.initialize();
  const space = server.engine.addressSpace;
  const own = space.getOwnNamespace();
  const area = own.addFolder(space.rootFolder.objects, { browseName: "Unit 1" });
  const loop = own.addObject({ organizedBy: area, browseName: "FIC-101" });
  const nodes = {};
  for (const [role, unit, high] of [["PV", "m3/h", 50], ["OP", "%", 100], ["SP", "m3/h", 50]]) {
    nodes[role] = own.addAnalogDataItem({
      componentOf: loop, browseName: role, dataType: "Double", definition: role, valuePrecision: 0.01,
      engineeringUnitsRange: { low: 0, high }, instrumentRange: { low: 0, high },
      engineeringUnits: { namespaceUri: "http://www.opcfoundation.org/UA/units/un/cefact", unitId: 0,
        displayName: { text: unit }, description: { text: unit } },
      minimumSamplingInterval: 10,
    });
    space.installHistoricalDataNode(nodes[role], { maxOnlineValues: 100000 });
  }
  function set(role, value, status) {
    const now = new Date();
    const data = { dataType: DataType.Double, value };
    nodes[role].setValueFromSource(data, status || StatusCodes.Good, now);
    console.log(JSON.stringify([`FIC-101.${role}`, now.getTime(), value, (status || StatusCodes.Good).value]));
  }
  if (history && existsSync(history)) {
    for (const line of readFileSync(history, "utf8").split("\n").filter(Boolean)) {
      const [tag, milliseconds, value, status] = JSON.parse(line);
      await nodes[tag.split(".")[1]].varHistorian.push(new DataValue({
        value: { dataType: DataType.Double, value }, sourceTimestamp: new Date(milliseconds),
        statusCode: getStatusCodeFromCode(status),
      }));
    }
  }
  await server.start();
  console.log("ready");
  set("SP", 42.5);
  let k = 0;
  setInterval(() => {
    set("PV", 10 + k / 100, k % 17 === 3 ? StatusCodes.BadNoCommunication : undefined);
    set("OP", 50 + k / 100);
    k += 1;
  }, 100);
  process.stdin.resume();
  process.stdin.on("end", () => process.exit(0));
})();
