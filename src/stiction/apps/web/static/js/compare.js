import { h } from "./dom.js";
export const title = "Compare";
export async function render(root) {
  root.append(h("h1", {}, "Compare"));
}
