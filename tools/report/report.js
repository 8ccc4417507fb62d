// Draws the report of one flight from the JSON that the page carries.
"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const colour = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const short = value => {
  if (typeof value !== "number") return String(value);
  if (Number.isInteger(value)) return value.toLocaleString("en-US");
  return Math.abs(value) >= 100 ? value.toFixed(0) : Number(value.toPrecision(3)).toString();
};
const megabytes = bytes => short(Math.round(bytes / 1048576)) + " MB";

// --- the figures that a person looks for first
const s = data.summary;
const tiles = [
  ["frames", short(s.frames), false],
  ["triangles, most", short(s.triangles_max) + " of " + short(s.budget), s.over_budget_frames > 0],
  ["certified error, median", short(s.error_px_median) + " px", false],
];
if ("measured_error_px_max" in s) {
  tiles.push(["measured error, most", short(s.measured_error_px_max) + " px", s.uncertified_frames > 0]);
  tiles.push(["movement between frames, most", short(s.max_pop_px) + " px", false]);
}
tiles.push(["update, median / 99 %",
  short(s.update_ms_median) + " / " + short(s.update_ms_p99) + " ms", false]);
tiles.push(["memory, peak", megabytes(s.peak_bytes) + " of " + megabytes(s.memory_bytes),
  s.peak_bytes > s.memory_bytes]);
tiles.push(["frames with late chunks", short(s.late_frames), false]);
if ("distance_m" in s) tiles.push(["distance driven", short(s.distance_m) + " m", false]);
if ("fell_through" in s) tiles.push(["fell through", short(s.fell_through), s.fell_through > 0]);
for (const [label, value, isBad] of tiles) {
  const tile = document.createElement("div");
  tile.className = isBad ? "tile bad" : "tile";
  const number = document.createElement("b");
  number.textContent = value;
  const text = document.createElement("span");
  text.textContent = label;
  tile.append(number, text);
  document.getElementById("tiles").append(tile);
}

for (const [key, value] of Object.entries(s)) {
  const row = document.getElementById("summary").insertRow();
  row.insertCell().textContent = key;
  row.insertCell().textContent = typeof value === "object" ? JSON.stringify(value) : short(value);
}

// --- plots: [title, what it says, [[label, values, colour, dashed, stepped]]]
const level = value => data.time.map(() => value);
const plots = [
  ["Triangles", "What a frame draws; never more than the budget.", [
    ["triangles", data.triangles, "--main"], ["budget", level(data.budget), "--limit", true]]],
  ["Screen error, px", "Certified for every ground point in view, at most" +
    (data.measured ? "; measured by brute force below it." : "."), [
    ["certified", data.error, "--main"],
    ...(data.measured ? [["measured", data.measured, "--second"]] : [])]],
  ...(data.pop ? [["Movement between frames, px",
    "Largest displacement of the displayed surface under fixed points.",
    [["movement", data.pop, "--main"]]]] : []),
  ["Update, ms", "Pager and triangulator together, one thread.", [["update", data.update, "--main"]]],
  ["Resident chunks, MB", "Never above the ceiling.", [
    ["resident", data.resident, "--main"], ["ceiling", level(data.ceiling), "--limit", true]]],
  ["Late chunks", "Wanted by the frame and not there: drawn coarser, inside the certified error.", [
    ["late", data.late, "--main", false, true]]],
  ...data.extra.map(column => [column.name, "", [[column.name, column.values, "--main"]]]),
];

const charts = [];
function draw() {
  while (charts.length) charts.pop().destroy();
  Chart.defaults.color = colour("--soft");
  Chart.defaults.borderColor = colour("--grid");
  Chart.defaults.font.family = "system-ui, 'DejaVu Sans', sans-serif";
  plots.forEach(([, , series], index) => {
    charts.push(new Chart(document.getElementById("plot" + index), {
      type: "line",
      data: {
        labels: data.time,
        datasets: series.map(([label, values, name, dashed, stepped]) => ({
          label, data: values.map((y, i) => ({x: data.time[i], y})), borderColor: colour(name),
          backgroundColor: colour(name), borderWidth: dashed ? 1.25 : 1.5,
          borderDash: dashed ? [6, 4] : [], stepped: Boolean(stepped), pointRadius: 0,
        })),
      },
      options: {
        animation: false, maintainAspectRatio: false, parsing: false,
        interaction: {mode: "index", intersect: false},
        plugins: {
          legend: {display: series.length > 1, align: "end",
            labels: {boxWidth: 18, boxHeight: 1}},
          tooltip: {callbacks: {title: items => items[0].parsed.x.toFixed(2) + " s"}},
        },
        scales: {
          x: {type: "linear", min: data.time[0], max: data.time[data.time.length - 1],
            title: {display: true, text: "seconds"}, grid: {display: false},
            ticks: {maxTicksLimit: 9, callback: value => short(Number(value.toFixed(1)))}},
          y: {beginAtZero: true, ticks: {maxTicksLimit: 6}},
        },
      },
    }));
  });
}

plots.forEach(([title, text], index) => {
  const card = document.createElement("section");
  card.className = "card";
  const heading = document.createElement("h2");
  heading.textContent = title;
  const words = document.createElement("p");
  words.textContent = text;
  const box = document.createElement("div");
  box.className = "plot";
  const canvas = document.createElement("canvas");
  canvas.id = "plot" + index;
  box.append(canvas);
  card.append(heading, words, box);
  document.getElementById("plots").append(card);
});
draw();
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
