import { h } from "./dom.js";
export const title = "Loops";
export async function render(root) {
  root.append(h("h1", {}, "Loops"));
}
