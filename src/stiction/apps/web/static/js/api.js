// Requests to our own server. Every request that changes something carries a header that other pages cannot send.

const HEADERS = { "X-Stiction": "1" };

/** An answer of the server that is not what was asked for; `message` can be shown as it is. */
export class ServerError extends Error {
  constructor(message, status, body = {}) {
    super(message);
    this.status = status;
    this.body = body;
  }
}

async function checked(response) {
  if (response.ok) return response;
  let body = {};
  try {
    body = await response.json();
  } catch {
    body = { error: `The server answered ${response.status}.` };
  }
  throw new ServerError(body.error ?? `The server answered ${response.status}.`, response.status, body);
}

async function request(path, options) {
  try {
    return await checked(await fetch(path, { credentials: "same-origin", ...options }));
  } catch (error) {
    if (error instanceof ServerError || error.name === "AbortError") throw error;
    throw new ServerError("The server does not answer. Start stiction serve again and open the address that it prints.", 0);
  }
}

/** GET a JSON answer. `signal` (AbortSignal) ends the wait. */
export async function getJson(path, signal) {
  return (await request(path, { signal })).json();
}

/** Send JSON and return the JSON answer. */
export async function sendJson(method, path, body, signal) {
  const options = { method, body: JSON.stringify(body), headers: { ...HEADERS, "Content-Type": "application/json" }, signal };
  return (await request(path, options)).json();
}

/** Send a JSON body and return the answer as a Blob, with the name of the file that the server gives. */
export async function fetchFile(method, path, body) {
  const options = { method, headers: { ...HEADERS, "Content-Type": "application/json" } };
  if (method !== "GET") options.body = JSON.stringify(body);
  const response = await request(path, options);
  const name = /filename="([^"]+)"/.exec(response.headers.get("Content-Disposition") ?? "");
  return { blob: await response.blob(), name: name ? name[1] : "download" };
}

/** Offer a Blob as a file to save. */
export function saveFile({ blob, name }) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** Upload the bytes of a file; `onProgress` gets the share that was sent, 0 to 1. Returns the JSON answer. */
export function uploadFile(path, file, onProgress, signal) {
  return new Promise((resolve, reject) => {
    const sending = new XMLHttpRequest();
    sending.open("PUT", path);
    sending.setRequestHeader("X-Stiction", "1");
    sending.responseType = "json";
    sending.upload.addEventListener("progress", (event) => event.lengthComputable && onProgress(event.loaded / event.total));
    sending.addEventListener("load", () => {
      const body = sending.response ?? {};
      if (sending.status < 300) resolve(body);
      else reject(new ServerError(body.error ?? `The server answered ${sending.status}.`, sending.status, body));
    });
    sending.addEventListener("error", () => reject(new ServerError("The upload was cut off. Try once more.", 0)));
    sending.addEventListener("abort", () => reject(new ServerError("The upload was stopped.", 0)));
    signal?.addEventListener("abort", () => sending.abort());
    sending.send(file);
  });
}

/** Open a WebSocket to our own server. */
export function openSocket(path) {
  return new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${path}`);
}

/** Exchange the token of the address for the cookie. True when this browser may use the server. */
export async function signIn() {
  const token = /^#token=([\w-]+)/.exec(location.hash);
  if (token) {
    history.replaceState(null, "", "#/");
    await sendJson("POST", "/api/session", { token: token[1] });
    return true;
  }
  return (await getJson("/api/session")).signed_in;
}
