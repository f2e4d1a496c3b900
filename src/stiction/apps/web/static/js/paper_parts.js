// The paper: its tables and figures, printed and repaired, each computed when it is first opened.

import { h, problem } from "./dom.js";
import { drawBlock } from "./report_blocks.js";
import { getPacked } from "./simulation.js";

const MAIN = ["figure2", "figure3", "figure4", "figure5", "figure6", "figure7", "figure8"];

/** The section of the paper's parts. Returns {element, destroy()}. */
export function drawPaper(options, signal) {
  const drawn = [];
  const order = [...MAIN, ...Object.keys(options.parts).filter((name) => !MAIN.includes(name))];
  const folds = order.map((name) => {
    const body = h("div", { class: "paper-part" }, h("p", { class: "note" }, "Computing …"));
    let begun = false;
    const fold = h("details", { "data-part": name }, h("summary", {}, options.parts[name], h("span", { class: "note" }, ` ${SUBJECTS[name] ?? ""}`)), body);
    fold.addEventListener("toggle", async () => {
      if (!fold.open || begun) return;
      begun = true;
      try {
        const blocks = (await getPacked(`/api/textbook/parts/${name}`, signal)).blocks.map(drawBlock);
        drawn.push(...blocks);
        body.replaceChildren(...blocks.map((block) => block.element));
      } catch (error) {
        if (signal.aborted) return;
        begun = false;
        body.replaceChildren(problem(error.message));
      }
    });
    return fold;
  });
  const element = h(
    "section",
    { class: "card paper" },
    h("h2", {}, "The paper, printed and repaired"),
    h("p", {}, "Figures 2 to 8 as the printed equations and as the repaired ones give them, then tables, equations and errata. The recorded data of the paper are not available: all curves are simulated."),
    folds,
  );
  return { element, destroy: () => drawn.forEach((block) => block.destroy()) };
}

const SUBJECTS = {
  figure2: "the mechanistic valve on two ramps",
  figure3: "fast ramps: stick, jump, follow",
  figure4: "slow ramps: stairs",
  figure5: "a flow loop whose stiction varies over the travel",
  figure6: "a level loop that cycles",
  figure7: "the Nyquist plot with its limit cycles",
  figure8: "a disturbance moves the loop to another cycle",
  table1: "parameters of the valve in both readings of their units",
  section5: "which model shows what",
  equation5: "the three-parameter model",
  "equations6and7": "the describing function",
  errata: "what is wrong in print, with proofs",
};
