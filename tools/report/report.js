// What reports of every kind are put together from; the page carries their data as JSON.
"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const colour = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const short = value => {
  if (typeof value !== "number") return String(value);
  if (Number.isInteger(value)) return value.toLocaleString("en-US");
  return Math.abs(value) >= 100 ? value.toFixed(0) : Number(value.toPrecision(3)).toString();
};
const megabytes = bytes => short(Math.round(bytes / 1048576)) + " MB";

function element(kind, text, className) {
  const made = document.createElement(kind);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  return made;
}

// --- the figures that a person looks for first: [label, value, whether it is bad]
function showTiles(tiles) {
  for (const [label, value, isBad] of tiles) {
    const tile = element("div", undefined, isBad ? "tile bad" : "tile");
    tile.append(element("b", value), element("span", label));
    document.getElementById("tiles").append(tile);
  }
}

function showSummary() {
  for (const [key, value] of Object.entries(data.summary)) {
    const row = document.getElementById("summary").insertRow();
    row.insertCell().textContent = key;
    row.insertCell().textContent = typeof value === "object" ? JSON.stringify(value) : short(value);
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

// Draws charts, and draws them again when the page changes its colours: makeCharts returns them.
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
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
}

function showPlots(plots) {
  const canvases = plots.map(({title, text}) => {
    const card = element("section", undefined, "card");
    const box = element("div", undefined, "plot");
    const canvas = element("canvas");
    box.append(canvas);
    card.append(element("h2", title), element("p", text), box);
    document.getElementById("plots").append(card);
    return canvas;
  });
  keepDrawn(() => plots.map((plot, i) => drawPlot(plot, canvases[i])));
}
