import { h } from "./dom.js";
export const title = "Files";
export async function render(root) {
  root.append(h("h1", {}, "Files"));
}
