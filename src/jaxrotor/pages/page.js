"use strict";
// Errors are kept where a reader of the page's source, or a test, finds them.
window.addEventListener("error", (e) => { document.body.dataset.error = e.message; });

// Numbers stand right, so that their sizes are seen.
const NUMBER = /^[<>~±]?\s*[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?\s*(%|[^\d\s]\S{0,6})?$/i;
const EMPTY = new Set(["", "-", "?"]);

function value(text) {
  const found = text.replace(/[<>~±]/g, "").match(/[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?/i);
  return found && NUMBER.test(text.trim()) ? parseFloat(found[0]) : null;
}

function sortBy(table, column) {
  const head = table.tHead.rows[0].cells[column], body = table.tBodies[0];
  const down = head.getAttribute("aria-sort") === "ascending";
  for (const each of table.tHead.rows[0].cells) each.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", down ? "descending" : "ascending");
  const rows = [...body.rows].map((row) => [row, row.cells[column].textContent]);
  rows.sort(([, a], [, b]) => {
    const p = value(a), q = value(b);
    const order = p !== null && q !== null ? p - q : a.localeCompare(b);
    return down ? -order : order;
  });
  for (const [row] of rows) body.append(row);
}

function copied(table) {
  return [...table.rows].map((row) => [...row.cells].map((c) => c.textContent).join("\t")).join("\n");
}

async function copy(table, button) {
  const text = copied(table);
  try { await navigator.clipboard.writeText(text); } catch {
    const area = document.createElement("textarea");
    area.value = text;
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }
  button.textContent = "copied";
  setTimeout(() => { button.textContent = "copy"; }, 1500);
}

for (const table of document.querySelectorAll("table")) {
  const button = document.createElement("button");
  button.className = "copy";
  button.textContent = "copy";
  button.title = "Copy the table, to paste it into a spreadsheet";
  button.addEventListener("click", () => copy(table, button));
  table.caption.append(button);
  const rows = [...table.tBodies[0].rows];
  [...table.tHead.rows[0].cells].forEach((head, k) => {
    head.title = "Sort";
    head.addEventListener("click", () => sortBy(table, k));
    const texts = rows.map((row) => row.cells[k].textContent.trim());
    const told = texts.filter((text) => !EMPTY.has(text));
    if (told.length && told.every((text) => NUMBER.test(text))) {
      for (const each of [head, ...rows.map((row) => row.cells[k])]) each.classList.add("number");
    }
  });
}

function colours(printing) {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(name).trim();
  return printing ? { ink: "#1b1f24", soft: "#5b636d", line: "#9aa2ab", grid: "#e6e9ed", card: "#ffffff" }
    : { ink: of("--ink"), soft: of("--soft"), line: of("--soft"), grid: of("--grid"), card: of("--card") };
}

function template(printing) {
  const { ink, soft, line, grid, card } = colours(printing);
  const axis = {
    gridcolor: grid, zerolinecolor: line, zerolinewidth: 1, linecolor: line, showline: true, ticks: "outside",
    tickcolor: line, ticklen: 4, exponentformat: "none", automargin: true, tickfont: { color: soft, size: 12 },
    title: { font: { size: 13 }, standoff: 8 },
  };
  return { layout: {
    font: { color: ink, size: 13, family: getComputedStyle(document.body).fontFamily },
    paper_bgcolor: card, plot_bgcolor: card, xaxis: axis, yaxis: axis,
    separators: ".", // 10000 as 8000 is written
    hoverlabel: { bgcolor: card, font: { color: ink } }, legend: { font: { size: 12 } },
    annotationdefaults: { font: { color: soft, size: 12 } },
    sliderdefaults: { font: { color: soft }, bgcolor: grid, bordercolor: line, tickcolor: line },
    updatemenudefaults: { bgcolor: card, bordercolor: line, font: { color: ink } },
  } };
}

const CONFIG = {
  responsive: true, displaylogo: false, scrollZoom: false,
  modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"],
};
const plots = [...document.querySelectorAll(".plot")];

// On a phone a legend beside the panel would leave it no width: it stands below.
function fitted(div, layout) {
  if (div.clientWidth >= 560 || layout.showlegend === false) return layout;
  const { t, b } = layout.margin, more = 56;
  div.style.height = `${layout.height + more}px`;
  return { ...layout, height: layout.height + more, margin: { ...layout.margin, l: 62, r: 12, b: b + more },
    legend: { orientation: "h", x: 0, yanchor: "top", y: -(b + 2) / (layout.height - t - b) } };
}

async function draw(div) {
  const spec = JSON.parse(document.getElementById(div.dataset.spec).textContent);
  const layout = { ...fitted(div, spec.layout), template: template(false) };
  await Plotly.newPlot(div, { data: spec.data, layout, frames: spec.frames || [],
    config: { ...CONFIG, displayModeBar: div.clientWidth < 560 ? false : "hover" } });
  div.on("plotly_relayout", () => lookNear(div));
}

// A dense trace is a smear from afar, faint before its envelope; near by it is what one looks for.
const FAINT = 0.22, NEAR = 0.2;

function lookNear(div) {
  const dense = div.data.flatMap((trace, k) => (trace.meta === "dense" ? [k] : []));
  if (!dense.length) return;
  const x = div.data[dense[0]].x, [a, b] = div.layout.xaxis.range;
  const near = Math.abs(b - a) < NEAR * Math.abs(x[x.length - 1] - x[0]);
  const opacity = near ? 1 : FAINT;
  if (div.data[dense[0]].opacity !== opacity) Plotly.restyle(div, { opacity }, dense);
}

async function drawAll() {
  for (const div of plots) {
    try { await draw(div); } catch (e) { document.body.dataset.error = String(e); }
    await new Promise((next) => setTimeout(next));
  }
  document.body.dataset.drawn = plots.length;
}

if (plots.length) {
  drawAll();
  // On paper a little lower, so that two figures find room on a page.
  const themed = (printing) => plots.filter((div) => div.layout).map((div) => {
    div.dataset.height ||= div.layout.height;
    const height = div.dataset.height * (printing ? 0.75 : 1);
    div.style.height = `${height}px`;
    return Plotly.relayout(div,
      { template: template(printing), autosize: !printing, width: printing ? 680 : null, height });
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => themed(false));
  window.addEventListener("beforeprint", () => {
    for (const each of document.querySelectorAll("details")) each.open = true;
    themed(true);
  });
  window.addEventListener("afterprint", () => themed(false));
}
