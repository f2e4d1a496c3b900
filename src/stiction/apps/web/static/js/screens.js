// The screens: part of the address after "#/" -> its module. A module exports `title` and `render(root, params)`.
// `menu: false` keeps a screen out of the menu. `module` is loaded when the screen is first opened.

export const SCREENS = [
  { name: "drop", label: "Files", module: "./drop.js" },
  { name: "loops", label: "Loops", module: "./loops.js" },
  { name: "loop", label: "Loop", module: "./loop.js", menu: false },
  { name: "groups", label: "Groups", module: "./groups.js" },
  { name: "compare", label: "Compare", module: "./compare.js" },
  { name: "whatif", label: "What-if", module: "./whatif.js" },
  { name: "textbook", label: "Textbook", module: "./textbook.js" },
];
