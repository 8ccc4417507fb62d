// Content of the report of the study of many bodies: a card for each table, with a log-log plot, the published times
// beside ours, and the share of positive queries where there are any.
const colours = {published: "--soft", sap: "--main", grid: "--limit", "two-scene": "--second",
  hashed: "--third", dense: "--fourth", centroid: "--fifth", brute: "--text", convex: "--main", dented: "--second",
  "convex, crowded": "--limit", "dented, crowded": "--third"};
const series = table => Object.keys(table.slopes);
const three = value => value === undefined ? "" : Number(value.toPrecision(3)).toLocaleString("en-US",
  {maximumSignificantDigits: 3});
const microseconds = value => value === undefined ? "" : three(1e3 * value);
const publishedOf = table => table.points.filter(point => "published_query_ms" in point);

const sumOf = (table, point, key) => series(table).reduce((sum, name) => sum + (point[name]?.[key] ?? 0), 0);

// [heading, text of what was measured] of the columns of each series
const measures = [
  ["queries", totals => short(totals.queries)],
  ["positive", totals => short(totals.positive_queries)],
  ["query, us", totals => microseconds(totals.query_ms)],
  ["positive query, us", totals => totals.positive_queries ? microseconds(totals.positive_ms) : ""],
  ["update, us", totals => microseconds(totals.update_ms)],
];

// [heading, text of a point] of the columns before those of the series
function columnsOf(table) {
  const columns = [[table.x_name, point => short(point.x)]];
  if (publishedOf(table).length) {
    columns.push(["published query, us", point => microseconds(point.published_query_ms)]);
    columns.push(["published update, us", point => microseconds(point.published_update_ms)]);
  }
  columns.push(["positive, %", point => three(100 * sumOf(table, point, "positive_queries") / sumOf(table, point, "queries"))]);
  return columns;
}

function tableOf(table) {
  const made = element("table");
  const head = made.createTHead(), groups = head.insertRow(), names = head.insertRow();
  const columns = columnsOf(table);
  for (const [name] of columns) {
    const cell = element("th", name);
    cell.rowSpan = 2;
    groups.append(cell);
  }
  for (const name of series(table)) {
    const cell = element("th", name, "first");
    cell.colSpan = measures.length;
    groups.append(cell);
    measures.forEach(([heading], i) => names.append(element("th", heading, i ? "" : "first")));
  }
  const body = made.createTBody();
  for (const point of table.points) {
    const row = body.insertRow();
    for (const [, show] of columns) row.append(element("td", show(point)));
    for (const name of series(table)) {
      measures.forEach(([, show], i) =>
        row.append(element("td", name in point ? show(point[name]) : "-", i ? "" : "first")));
    }
  }
  return made;
}

const comparisonsOf = table => makeTable(
  ["", "published, us", "ours, us", "published / ours", "why they differ"],
  table.comparisons.map(({what, published_ms: published, our_ms: ours, reason}) =>
    [what, microseconds(published), microseconds(ours), three(published / ours), reason]),
  heading => heading.startsWith("why") ? "text" : "");

const slopesOf = table => "Slopes of query times: " + series(table).map(name => {
  const {all, published_places: few, without_fixed_cost: power} = table.slopes[name];
  const fits = [];
  if (power !== null) fits.push(power.toFixed(2) + " with the fixed cost apart");
  if (few !== null) fits.push(few.toFixed(2) + " over the published places");
  if (all !== null && all !== few) fits.push(all.toFixed(2) + " over all");
  return fits.length ? name + " " + fits.join(", ") : "";
}).filter(text => text).join("; ") + ".";

function drawLogarithms(table, canvas) {
  const line = (label, name, points, dashed) => ({
    label, data: points, showLine: true, borderColor: colour(name), backgroundColor: colour(name),
    borderWidth: 1.5, borderDash: dashed ? [6, 4] : [], pointRadius: 2.5,
  });
  const lines = [];
  const published = publishedOf(table);
  if (published.length > 1) {
    lines.push(line("published", colours.published,
      published.map(point => ({x: point.x, y: 1e3 * point.published_query_ms})), true));
  }
  for (const name of series(table)) {
    lines.push(line(name, colours[name], table.points.filter(point => name in point).map(
      point => ({x: point.x, y: 1e3 * point[name].query_ms})), false));
  }
  // y = x through the first published time, or else that of the first series
  const start = published.length > 1 ? published[0] : table.points.find(point => series(table)[0] in point);
  if (start !== undefined) {
    const factor = (start.published_query_ms ?? start[series(table)[0]].query_ms) / start.x;
    lines.push(line("y = x, scaled", "--soft", table.points.map(point => ({x: point.x, y: 1e3 * factor * point.x})), false));
    Object.assign(lines.at(-1), {pointRadius: 0, borderWidth: 1});
  }
  const axis = text => ({type: "logarithmic", title: {display: true, text},
    ticks: {maxRotation: 0, callback: value => {
      const power = Math.log10(value);
      return Math.abs(power - Math.round(power)) < 1e-9 ? short(value) : "";
    }}});
  return new Chart(canvas, {
    type: "scatter", data: {datasets: lines},
    options: {
      animation: false, maintainAspectRatio: false,
      plugins: {legend: {align: "end", labels: {boxWidth: 18, boxHeight: 1}}},
      scales: {x: axis(table.x_name), y: axis("us a query")},
    },
  });
}

function drawPositiveShare(table, canvas) {
  const lines = series(table).map(name => ({
    label: name, showLine: true, borderColor: colour(colours[name]), backgroundColor: colour(colours[name]),
    borderWidth: 1.5, pointRadius: 2.5,
    data: table.points.filter(point => name in point).map(
      point => ({x: point.x, y: 100 * point[name].positive_queries / point[name].queries})),
  }));
  return new Chart(canvas, {
    type: "scatter", data: {datasets: lines},
    options: {
      animation: false, maintainAspectRatio: false,
      plugins: {legend: {align: "end", labels: {boxWidth: 18, boxHeight: 1}}},
      scales: {x: {title: {display: true, text: table.x_name}},
        y: {beginAtZero: true, title: {display: true, text: "positive queries, %"}}},
    },
  });
}

// A canvas in a box of its own after an element.
function addPlotAfter(place) {
  const {plot, canvas} = makePlot();
  place.after(plot);
  return canvas;
}

function addComparisons(table, canvas) {
  if (!table.comparisons.length) return;
  const wide = element("div", undefined, "wide");
  wide.append(comparisonsOf(table));
  const note = "The published machine is not known; its share is the same in all ratios. Ours is the mean of the same scheme.";
  canvas.closest(".card").append(element("p", note), wide);
}

const tiles = [];
for (const table of data.tables) {
  const ratio = data.summary[table.key + "_least_speedup"];
  if (ratio !== undefined) tiles.push([`${table.title}: published query over our fastest, at least`, three(ratio), false]);
}
showTiles(tiles);
const charts = [];
for (const table of data.tables) {
  const canvas = addTableCard(table.title, table.text, tableOf(table), [slopesOf(table), ...table.findings]);
  charts.push(() => drawLogarithms(table, canvas));
  if (table.key === "count" || table.key === "radius") {
    const share = addPlotAfter(canvas.parentElement);
    charts.push(() => drawPositiveShare(table, share));
  }
  addComparisons(table, canvas);
}
keepDrawn(() => charts.map(draw => draw()));
showSummary();
