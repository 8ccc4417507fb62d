// Functions shared by all reports; the page contains the data as JSON.
"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const colour = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const short = value => {
  if (typeof value !== "number") return String(value);
  if (Number.isInteger(value)) return value.toLocaleString("en-US");
  return Number(value.toPrecision(4)).toString();
};
// Rounds up, for certified bounds.
const bound = value => {
  if (value === null || !(value > 0)) return short(value);
  const step = 10 ** (Math.floor(Math.log10(value)) - 3);
  const near = Number(value.toPrecision(4));
  return short(near < value ? Number((near + step).toPrecision(4)) : near);
};
const megabytes = bytes => short(Math.round(bytes / 1048576)) + " MB";

function element(kind, text, className) {
  const made = document.createElement(kind);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  return made;
}

// --- key figures: [label, value, whether it is bad]
function showTiles(tiles) {
  for (const [label, value, isBad] of tiles) {
    const tile = element("div", undefined, isBad ? "tile bad" : "tile");
    tile.append(element("b", value), element("span", label));
    document.getElementById("tiles").append(tile);
  }
}

function showSummary() {
  for (const [title, text, note, key] of data.rows) {
    const row = document.getElementById("summary").insertRow();
    const name = row.insertCell();
    name.textContent = title;
    name.title = key;  // the key of --json
    const cell = row.insertCell();
    cell.textContent = text;
    if (note) cell.append(element("small", " " + note));
  }
  if (data.summary.interrupted) {
    document.getElementById("notice").append(
      element("p", "Interrupted: this is what was done until then.", "notice"));
  }
}

// --- plots over time: {title, text, time, series: [[label, values, colour, dashed, stepped]]}
function drawPlot({time, series}, canvas) {
  return new Chart(canvas, {
    type: "line",
    data: {
      labels: time,
      datasets: series.map(([label, values, name, dashed, stepped]) => ({
        label, data: values.map((y, i) => ({x: time[i], y})), borderColor: colour(name),
        backgroundColor: colour(name), borderWidth: dashed ? 1.25 : 1.5,
        borderDash: dashed ? [6, 4] : [], stepped: Boolean(stepped), pointRadius: 0,
      })),
    },
    options: {
      animation: false, maintainAspectRatio: false, parsing: false,
      interaction: {mode: "index", intersect: false},
      plugins: {
        legend: {display: series.length > 1, align: "end", labels: {boxWidth: 18, boxHeight: 1}},
        tooltip: {callbacks: {title: items => items[0].parsed.x.toFixed(2) + " s"}},
      },
      scales: {
        x: {type: "linear", min: time[0], max: time[time.length - 1],
          title: {display: true, text: "seconds"}, grid: {display: false},
          ticks: {maxTicksLimit: 9, callback: value => short(Number(value.toFixed(1)))}},
        y: {beginAtZero: true, ticks: {maxTicksLimit: 6}},
      },
    },
  });
}

// Draws the charts that makeCharts returns, and redraws them when the colour scheme changes, for the printer too.
function keepDrawn(makeCharts) {
  let charts = [];
  const draw = () => {
    charts.forEach(chart => chart.destroy());
    Chart.defaults.color = colour("--soft");
    Chart.defaults.borderColor = colour("--grid");
    Chart.defaults.font.family = "system-ui, 'DejaVu Sans', sans-serif";
    charts = makeCharts();
  };
  draw();
  for (const media of ["(prefers-color-scheme: dark)", "print"]) window.matchMedia(media).addEventListener("change", draw);
}

// A canvas in a box of its own.
function makePlot() {
  const plot = element("div", undefined, "plot");
  const canvas = element("canvas");
  plot.append(canvas);
  return {plot, canvas};
}

// A table of texts. `classOf` gives the class of a column's cells by its heading; may be absent.
function makeTable(headings, rows, classOf = () => "") {
  const made = element("table");
  const head = made.createTHead().insertRow();
  for (const heading of headings) head.append(element("th", heading, classOf(heading)));
  const body = made.createTBody();
  for (const texts of rows) {
    const row = body.insertRow();
    texts.forEach((text, i) => row.append(element("td", text, classOf(headings[i]))));
  }
  return made;
}

// A card with a plot and a table below it, and the text of a note between them where there is one. Returns the canvas.
function addTableCard(title, text, table, note) {
  const card = element("section", undefined, "card");
  const {plot, canvas} = makePlot();
  const wide = element("div", undefined, "wide");
  wide.append(table);
  card.append(element("h2", title), element("p", text), plot);
  for (const line of [note].flat()) {
    if (line) card.append(element("p", line));
  }
  card.append(wide);
  const plots = document.getElementById("plots");
  plots.style.gridTemplateColumns = "1fr";  // for the width of the tables
  plots.append(card);
  return canvas;
}

function showPlots(plots) {
  const canvases = plots.map(({title, text}) => {
    const card = element("section", undefined, "card");
    const {plot, canvas} = makePlot();
    card.append(element("h2", title), element("p", text), plot);
    document.getElementById("plots").append(card);
    return canvas;
  });
  keepDrawn(() => plots.map((plot, i) => drawPlot(plot, canvases[i])));
}
