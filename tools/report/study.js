// Content of the report of the study of many bodies: a card for each table, with a log-log plot.
const colours = {published: "--soft", sap: "--main", grid: "--limit", "two-scene": "--second",
  hashed: "--third", dense: "--fourth", convex: "--main", dented: "--second"};
const series = table => Object.keys(table.slopes);
const milliseconds = value => value === undefined ? "" : Number(value.toPrecision(3)).toString();

// [heading, value of a point] of the columns of a table
function columnsOf(table) {
  const columns = [[table.x_name, point => short(point.x)]];
  columns.push(["queries, all schemes", point => short(series(table).reduce(
    (sum, name) => sum + (point[name]?.queries ?? 0), 0))]);
  columns.push(["positive, %", point => {
    const first = point[series(table)[0]];
    return first ? milliseconds(100 * first.positive_queries / first.queries) : "";
  }]);
  const isPublished = table.points.some(point => "published_query_ms" in point);
  if (isPublished) columns.push(["published, ms", point => milliseconds(point.published_query_ms)]);
  for (const name of series(table)) {
    columns.push([name + " query, ms", point => milliseconds(point[name]?.query_ms)]);
    columns.push([name + " positive, ms",
      point => point[name]?.positive_queries ? milliseconds(point[name].positive_ms) : ""]);
    columns.push([name + " update, ms", point => milliseconds(point[name]?.update_ms)]);
    columns.push([name + " boxes, ms", point => milliseconds(point[name]?.boxes_ms)]);
  }
  if (isPublished) {
    const best = point => Math.min(...series(table).map(name => point[name]?.query_ms ?? Infinity));
    columns.push(["published / best", point =>
      "published_query_ms" in point ? short(Math.round(point.published_query_ms / best(point))) : ""]);
  }
  return columns;
}

function tableOf(table) {
  const made = element("table");
  const head = made.createTHead().insertRow();
  const columns = columnsOf(table);
  for (const [name] of columns) head.append(element("th", name));
  const body = made.createTBody();
  for (const point of table.points) {
    const row = body.insertRow();
    for (const [, show] of columns) row.append(element("td", show(point)));
  }
  return made;
}

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
  const published = table.points.filter(point => "published_query_ms" in point);
  if (published.length > 1) {
    lines.push(line("published", colours.published,
      published.map(point => ({x: point.x, y: point.published_query_ms})), true));
  }
  for (const name of series(table)) {
    lines.push(line(name, colours[name], table.points.filter(point => name in point).map(
      point => ({x: point.x, y: point[name].query_ms})), false));
  }
  // y = x through the first point of the first series
  const start = table.points.find(point => series(table)[0] in point);
  if (start !== undefined) {
    const factor = start[series(table)[0]].query_ms / start.x;
    lines.push(line("y = x, scaled", "--soft", table.points.map(point => ({x: point.x, y: factor * point.x})), true));
    lines.at(-1).pointRadius = 0;
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
      scales: {x: axis(table.x_name), y: axis("ms a query")},
    },
  });
}

const tiles = [];
for (const table of data.tables) {
  const fit = table.slopes[series(table)[0]].published_places;
  if (fit !== null) tiles.push([table.title + ": slope", fit.toFixed(2), false]);
}
showTiles(tiles);
const canvases = data.tables.map(table => addTableCard(
  table.title, table.text, tableOf(table), [slopesOf(table), ...table.findings]));
keepDrawn(() => data.tables.map((table, i) => drawLogarithms(table, canvases[i])));
showSummary();
