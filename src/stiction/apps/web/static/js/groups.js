import { h } from "./dom.js";
export const title = "Groups";
export async function render(root) {
  root.append(h("h1", {}, "Groups"));
}
