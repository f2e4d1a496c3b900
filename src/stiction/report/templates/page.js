"use strict";
(() => {
  const template = __TEMPLATE__;
  const config = {
    displaylogo: false,
    responsive: true,
    plotlyServerURL: "",
    modeBarButtonsToRemove: ["sendChartToCloud", "sendDataToCloud", "lasso2d", "select2d"],
  };
  const plots = [...document.querySelectorAll(".plot")];
  const seen = (box) => box.offsetParent !== null;

  function readLibrary() {
    const library = document.createElement("script");
    library.textContent = document.getElementById("plot-library").textContent;
    document.head.append(library);
  }

  function draw(box) {
    if (box.dataset.drawn) return;
    box.dataset.drawn = "yes";
    if (!window.Plotly) readLibrary();
    const plot = JSON.parse(box.nextElementSibling.textContent);
    Plotly.newPlot(box, plot.data, { ...plot.layout, template }, config);
  }

  const watcher = new IntersectionObserver(
    (entries) => entries.filter((entry) => entry.isIntersecting).forEach((entry) => draw(entry.target)),
    { rootMargin: "800px" },
  );
  plots.forEach((box) => watcher.observe(box));

  function openTarget() {
    const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const fold = target && target.closest("details");
    if (fold) {
      fold.open = true;
      fold.scrollIntoView();
    }
  }
  addEventListener("hashchange", openTarget);
  document.querySelectorAll('a[href^="#"]').forEach((link) => link.addEventListener("click", () => setTimeout(openTarget)));
  openTarget();

  function sort(table, column, head) {
    const down = head.getAttribute("aria-sort") === "ascending";
    const key = (row) => row.cells[column].dataset.sort;
    const empty = (value) => value === "";
    const rows = [...table.tBodies[0].rows].sort((a, b) => {
      const [x, y] = [key(a), key(b)];
      if (empty(x) || empty(y)) return empty(x) - empty(y);
      const order = isNaN(x) || isNaN(y) ? x.localeCompare(y, undefined, { numeric: true }) : x - y;
      return down ? -order : order;
    });
    table.tHead.querySelectorAll("th").forEach((other) => other.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    table.tBodies[0].append(...rows);
  }
  document.querySelectorAll("table.sortable").forEach((table) =>
    table.tHead.querySelectorAll("th").forEach((head, column) =>
      head.querySelector("button").addEventListener("click", () => sort(table, column, head))));

  const paper = { whole: 680, half: 330, shrink: 0.76 };
  addEventListener("beforeprint", () => plots.filter(seen).forEach((box) => {
    draw(box);
    const height = Math.max(240, paper.shrink * parseFloat(box.dataset.height));
    box.style.height = `${height}px`;
    Plotly.relayout(box, { autosize: false, width: box.closest(".columns") ? paper.half : paper.whole, height });
  }));
  addEventListener("afterprint", () => plots.filter((box) => box.dataset.drawn).forEach((box) => {
    box.style.height = `${box.dataset.height}px`;
    Plotly.relayout(box, { autosize: true, width: null, height: null });
  }));
})();
