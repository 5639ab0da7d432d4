"use strict";
// Hover values, their files, sorting and printing. Text from recordings only ever becomes text content.
for (const block of document.querySelectorAll("script.hover")) hover(block.previousElementSibling, block);
for (const button of document.querySelectorAll("th button")) button.addEventListener("click", () => sort(button));
for (const button of document.querySelectorAll("button.csv")) button.addEventListener("click", () => save(button));
const opened = [];
addEventListener("beforeprint", () => {
  for (const one of document.querySelectorAll("details:not([open]):not(.screen)")) { one.open = true; opened.push(one); }
});
addEventListener("afterprint", () => { for (const one of opened.splice(0)) one.open = false; });

function hover(svg, block) {
  const panels = JSON.parse(block.textContent).filter((panel) => panel.series.some((one) => one.x.length));
  if (!panels.length) return;
  const cursor = document.createElementNS("http://www.w3.org/2000/svg", "path");
  cursor.setAttribute("class", "cursor");
  svg.append(cursor);
  const tip = document.createElement("div");
  tip.className = "tip";
  tip.setAttribute("role", "status");
  tip.hidden = true;
  svg.parentElement.append(tip);
  let now = { panel: 0, x: null };

  function show(panel, x, y) {
    const found = panel.series.filter((one) => one.x.length).map((one) => ({ one, k: nearest(one, panel, x, y) }));
    const off = ({ one, k }) => Math.abs(one.x[k] - x) + (panel.nearest === "point" ? Math.abs(one.y[k] - y) : 0);
    // Few points near by are what somebody points at, more than the curve that passes everywhere.
    const close = found.filter((one) => off(one) < 14).sort((a, b) => a.one.x.length - b.one.x.length);
    const first = (panel.nearest === "x" && close[0]) || found.reduce((best, next) => (off(next) < off(best) ? next : best));
    const at = first.one.x[first.k];
    const beside = found.map(({ one }) => ({ one, k: nearest(one, panel, at, y) }));
    const shown = panel.nearest === "point" ? [first] : beside.filter(({ one, k }) => Math.abs(one.x[k] - at) < 4);
    cursor.setAttribute("d", `M${at} ${panel.box[1]}v${panel.box[3]}` +
      shown.map(({ one, k }) => `M${one.x[k] - 3} ${one.y[k]}h6M${one.x[k]} ${one.y[k] - 3}v6`).join(""));
    tip.replaceChildren(...[`${panel.x}: ${first.one.at[first.k]}`, panel.y + ":",
      ...shown.map(({ one, k }) => `${one.name} ${one.value[k]}`)].map((text) => {
      const row = document.createElement("div");
      row.textContent = text;
      return row;
    }));
    tip.hidden = false;
    const figure = svg.parentElement, frame = figure.getBoundingClientRect(), place = svg.getBoundingClientRect();
    const scale = place.width / svg.viewBox.baseVal.width, seen = place.left - frame.left + at * scale;
    const left = seen + tip.offsetWidth + 12 > figure.clientWidth ? seen - tip.offsetWidth - 12 : seen + 12;
    tip.style.left = `${figure.scrollLeft + Math.max(0, left)}px`;
    tip.style.top = `${place.top - frame.top + panel.box[1] * scale}px`;
    now = { panel: panels.indexOf(panel), x: at };
  }

  function nearest(one, panel, x, y) {
    let best = 0, least = Infinity;
    for (let k = 0; k < one.x.length; k++) {
      const off = panel.nearest === "point" ? Math.hypot(one.x[k] - x, one.y[k] - y) : Math.abs(one.x[k] - x);
      if (off < least) { least = off; best = k; }
    }
    return best;
  }

  function hide() { tip.hidden = true; cursor.removeAttribute("d"); }

  svg.addEventListener("pointermove", (event) => {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    const panel = panels.find(({ box }) => point.x >= box[0] - 6 && point.x <= box[0] + box[2] + 6 &&
      point.y >= box[1] && point.y <= box[1] + box[3]);
    if (panel) show(panel, point.x, point.y); else hide();
  });
  svg.addEventListener("pointerleave", hide);
  svg.addEventListener("blur", hide);
  svg.addEventListener("keydown", (event) => {
    const turn = { ArrowUp: -1, ArrowDown: 1 }[event.key], step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (event.key === "Escape") hide();
    if (!turn && !step) return;
    event.preventDefault();
    const panel = panels[Math.min(panels.length - 1, Math.max(0, now.panel + (turn || 0)))];
    const longest = panel.series.reduce((a, b) => (b.x.length > a.x.length ? b : a));
    const x = now.x ?? longest.x[0], onward = longest.x.filter((at) => (at - x) * (step || 0) > 0.05);
    const next = onward.length ? (step > 0 ? Math.min(...onward) : Math.max(...onward)) : x;
    show(panel, next, longest.y[longest.x.indexOf(next)] ?? longest.y[0]);
  });
}

function save(button) {
  const panels = JSON.parse(button.closest("figure").querySelector("script.hover").textContent);
  const rows = panels.flatMap((panel) => panel.series.flatMap((one) =>
    one.x.map((_, k) => [one.name, panel.x, one.at[k], panel.y, one.value[k]])));
  const quoted = [["series", "x", "value", "y", "value"], ...rows].map((row) =>
    row.map((cell) => (cell && !isNaN(cell) ? cell : `"${cell.replaceAll('"', '""')}"`)).join(","));
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([quoted.join("\n") + "\n"], { type: "text/csv" }));
  link.download = `${document.title}.csv`;
  link.click();
  URL.revokeObjectURL(link.href);
}

function sort(button) {
  const head = button.closest("th"), body = head.closest("table").tBodies[0];
  const column = head.cellIndex, down = head.getAttribute("aria-sort") === "ascending";
  const value = (row) => row.cells[column].querySelector("data")?.value ?? row.cells[column].textContent;
  const order = (a, b) => {
    const x = value(a), y = value(b);
    // What is not known stands last whichever way the column is sorted.
    if (!x || !y) return (x === "") - (y === "");
    const both = isNaN(x) || isNaN(y) ? x.localeCompare(y, undefined, { numeric: true }) : x - y;
    return down ? -both : both;
  };
  body.append(...[...body.rows].sort(order));
  for (const other of head.parentElement.cells) other.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", down ? "descending" : "ascending");
}
