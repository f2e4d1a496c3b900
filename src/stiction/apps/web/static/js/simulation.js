// Questions to the simulation: one question of a kind is on its way at a time, and only the latest one waits.

import { ServerError, openSocket } from "./api.js";

const RECONNECT_DELAY_MS = 1000;
const LOST = "The connection to the server was lost. The page tries again; if stiction serve has ended, start it once more.";

/** Read an answer: length of the JSON text (4 bytes), the text, then the arrays that {"$array": [first, length]} names. */
export function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const text = new TextDecoder().decode(new Uint8Array(buffer, 4, length));
  return JSON.parse(text, (_, value) =>
    Array.isArray(value?.$array) ? new Float32Array(buffer, 4 + length + 4 * value.$array[0], value.$array[1]) : value,
  );
}

/** GET an answer with arrays. */
export async function getPacked(path, signal) {
  const response = await fetch(path, { signal });
  if (!response.ok) throw new ServerError((await response.json().catch(() => ({}))).error ?? `The server answered ${response.status}.`, response.status);
  return unpack(await response.arrayBuffer());
}

/** A connection that asks questions. `onLost(text)` is called when it breaks, with "" when it is there again. */
export class Simulation {
  constructor(path, onLost = () => {}) {
    this.path = path;
    this.onLost = onLost;
    this.waiting = new Map();
    this.asked = new Map();
    this.count = 0;
    this.closed = false;
    this.connect();
  }

  connect() {
    this.socket = openSocket(this.path);
    this.socket.binaryType = "arraybuffer";
    this.socket.addEventListener("open", () => {
      this.onLost("");
      for (const kind of [...this.waiting.keys()]) this.send(kind);
    });
    this.socket.addEventListener("message", (event) => this.receive(event.data));
    this.socket.addEventListener("close", () => {
      if (this.closed) return;
      for (const [kind, question] of this.asked) if (!this.waiting.has(kind)) this.waiting.set(kind, question);
      this.asked.clear();
      this.onLost(LOST);
      setTimeout(() => !this.closed && this.connect(), RECONNECT_DELAY_MS);
    });
  }

  /** Ask; `onAnswer(answer)` gets it, `onError(text)` a message that can be shown. A newer question replaces this one. */
  ask(kind, values, width, onAnswer, onError) {
    this.count += 1;
    this.waiting.set(kind, { kind, id: this.count, values, width: Math.round(width), onAnswer, onError });
    this.send(kind);
    return this.count;
  }

  send(kind) {
    if (this.socket.readyState !== WebSocket.OPEN || this.asked.has(kind) || !this.waiting.has(kind)) return;
    const question = this.waiting.get(kind);
    this.waiting.delete(kind);
    this.asked.set(kind, question);
    const { id, values, width } = question;
    this.socket.send(JSON.stringify({ kind, id, values, width }));
  }

  receive(data) {
    const answer = typeof data === "string" ? JSON.parse(data) : unpack(data);
    const question = this.asked.get(answer.kind);
    if (!question || question.id !== answer.id) return;
    this.asked.delete(answer.kind);
    if (answer.again && !this.waiting.has(answer.kind)) {
      this.waiting.set(answer.kind, question);
      setTimeout(() => !this.closed && this.send(answer.kind), RECONNECT_DELAY_MS);
      this.onLost(answer.error);
      return;
    }
    if (answer.error) question.onError(answer.error);
    else question.onAnswer(answer, this.waiting.has(answer.kind));
    if (this.waiting.has(answer.kind)) this.send(answer.kind);
  }

  close() {
    this.closed = true;
    this.socket.close();
  }
}
