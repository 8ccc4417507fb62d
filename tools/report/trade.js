// Content of the report of trade-offs: for each dial a card with its front (loss over cost) or its curves, and a table of
// all figures. Two documents are drawn and listed side by side.
const machineOf = i => data.documents.length < 2 ? "" : "AB"[i];
const three = value => Number(value.toPrecision(3)).toString();
const columnOf = (table, key) => table.columns.find(column => column.key === key);
const axisText = column => column.unit ? `${column.title}, ${column.unit}` : column.title;
const isTime = column => column.unit === "ms" || column.unit === "ns";

// The tables of one dial and terrain, one of each document that has it.
const groups = new Map();
data.documents.forEach((documentOfRun, i) => documentOfRun.tables.forEach(table => {
  const key = table.key + "\n" + table.terrain;
  if (!groups.has(key)) groups.set(key, []);
  groups.get(key).push({table, machine: machineOf(i), isSecond: i > 0});
}));

const figureText = figure => {
  if (!figure) return "";
  if (figure.low === figure.high) return three(figure.median);
  return `${three(figure.median)} (${three(figure.low)} to ${three(figure.high)})`;
};

function tableOf(group) {
  // without those that no row has: drawing, where no device opens
  const columns = group[0].table.columns.filter(
    column => group.some(({table}) => table.rows.some(line => line.figures[column.key])));
  const isCompared = group.length > 1;
  const headings = [...(isCompared ? ["run"] : []), group[0].table.axis || "value", "front", "presets",
    ...columns.flatMap(column => isTime(column) ? [axisText(column), "over the reference loop"] : [axisText(column)]),
    "repetitions", "command"];
  const cellsOf = (line, machine) => {
    const figures = columns.map(column => line.figures[column.key]);
    const repetitions = Math.max(0, ...figures.map(figure => figure ? figure.repetitions : 0));
    return [...(isCompared ? [machine] : []), line.label, line.on_front ? "yes" : "", line.presets.join(", "),
      ...columns.flatMap((column, i) => isTime(column)
        ? [figureText(figures[i]), figures[i] ? three(figures[i].ratio) : ""] : [figureText(figures[i])]),
      String(repetitions), line.command];
  };
  return makeTable(headings, group.flatMap(({table, machine}) => table.rows.map(line => cellsOf(line, machine))));
}

// In two lines where one is longer than a plot is high.
function linesOf(text) {
  const middle = text.indexOf(" ", text.length / 2);
  return text.length > 28 && middle > 0 ? [text.slice(0, middle), text.slice(middle + 1)] : text;
}

// A logarithmic axis where all values are positive and far apart.
function scaleOf(text, values) {
  const low = Math.min(...values), high = Math.max(...values);
  const isWide = low > 0 && high > 8 * low;
  return {
    type: isWide ? "logarithmic" : "linear", beginAtZero: !isWide, title: {display: true, text},
    ticks: {maxRotation: 0, callback: value => {
      if (!isWide) return short(value);
      const digit = Math.round(value / 10 ** Math.floor(Math.log10(value) + 1e-9));
      return [1, 2, 5].includes(digit) ? short(value) : "";
    }},
  };
}

const hover = {
  label: item => {
    const {line, table} = item.raw;
    const texts = table.columns.filter(column => line.figures[column.key]).map(
      column => `${axisText(column)}: ${figureText(line.figures[column.key])}`);
    return [line.label + (line.presets.length ? ` (${line.presets.join(", ")})` : ""), ...texts];
  },
};

function chartOf(canvas, datasets, x, y) {
  const points = datasets.flatMap(dataset => dataset.data);
  return new Chart(canvas, {
    type: "scatter", data: {datasets},
    options: {
      animation: false, maintainAspectRatio: false,
      interaction: {mode: "nearest", intersect: false},
      plugins: {legend: {align: "end", labels: {boxWidth: 18, boxHeight: 1}}, tooltip: {callbacks: hover}},
      scales: {x: scaleOf(x, points.map(point => point.x)), y: scaleOf(linesOf(y), points.map(point => point.y))},
    },
  });
}

// Loss over cost: the front as a line, what it beats as points, presets as triangles.
function drawFront(group, canvas) {
  const {table: first} = group[0];
  const cost = columnOf(first, first.cost), loss = columnOf(first, first.loss);
  const datasets = [];
  for (const {table, machine, isSecond} of group) {
    const points = table.rows.filter(line => line.figures[table.cost] && line.figures[table.loss]).map(line => ({
      x: line.figures[table.cost].median, y: line.figures[table.loss].median, line, table}));
    const style = name => ({borderColor: colour(name), backgroundColor: colour(name), borderWidth: 1.5});
    const name = text => (machine ? machine + ": " : "") + text;
    const front = points.filter(point => point.line.on_front).sort((a, b) => a.x - b.x);
    const beaten = points.filter(point => !point.line.on_front);
    const chosen = points.filter(point => point.line.presets.length);
    datasets.push({label: name("front"), data: front, showLine: true, pointRadius: 3.5, ...style(isSecond ? "--second" : "--main")});
    if (beaten.length) datasets.push({label: name("beaten"), data: beaten, pointRadius: 3.5, ...style(isSecond ? "--third" : "--soft")});
    if (chosen.length) {
      datasets.push({label: name("presets"), data: chosen, pointStyle: "triangle", pointRadius: 7, ...style("--limit"),
        backgroundColor: "transparent"});
    }
  }
  return chartOf(canvas, datasets, axisText(cost), axisText(loss));
}

// Every column of times over the value of the dial.
function drawCurves(group, canvas) {
  const names = ["--main", "--second", "--limit", "--third", "--fourth"];
  const datasets = [];
  for (const {table, machine, isSecond} of group) {
    table.columns.filter(isTime).forEach((column, i) => datasets.push({
      label: (machine ? machine + ": " : "") + column.title, showLine: true, pointRadius: 2.5, borderWidth: 1.5,
      borderDash: isSecond ? [6, 4] : [], borderColor: colour(names[i % 5]), backgroundColor: colour(names[i % 5]),
      data: table.rows.filter(line => line.figures[column.key]).map(
        line => ({x: line.value, y: line.figures[column.key].median, line, table})),
    }));
  }
  const {table} = group[0];
  return chartOf(canvas, datasets, table.axis, table.columns.find(isTime).unit);
}

const all = [...groups.values()];
showTiles([
  ...data.documents.map((run, i) => [`${machineOf(i)} ${run.machine.processor}, ${run.machine.threads} threads, ${
    run.machine.compiler}, ${run.machine.build}`.trim(), `${run.quick ? "quick, " : ""}${short(Math.round(run.seconds))} s`, false]),
  ...data.documents.map((run, i) => [`${machineOf(i)} reference loop, ${figureText(run.reference_loop_ms)} ms`.trim(),
    three(run.reference_loop_ms.median) + " ms", false]),
]);
const canvases = all.map(group => {
  const {table} = group[0];
  const notes = group.flatMap(({table: {findings}, machine}) => findings.map(text => (machine ? machine + ": " : "") + text));
  return addTableCard(table.title + (table.terrain ? ", " + table.terrain : ""), table.text, tableOf(group), notes);
});
keepDrawn(() => all.map((group, i) => (group[0].table.cost ? drawFront : drawCurves)(group, canvases[i])));
showSummary();
