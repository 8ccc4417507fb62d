// Content of the report of the inequality of culling: for each count of objects a card with the costs of the tests over the
// triangles of an object, as ratios to the cheapest test.
const tests = ["none", "spheres", "boxes", "exact boxes", "triangles"];
const colours = {none: "--soft", spheres: "--main", boxes: "--second", "exact boxes": "--limit", triangles: "--text"};
const sum = timed => timed.cull_ms + timed.draw_ms;
const cheapest = point => tests.reduce((a, b) => sum(point.tests[b]) < sum(point.tests[a]) ? b : a);
const ratio = (point, test) => sum(point.tests[test]) / sum(point.tests[cheapest(point)]);
const three = value => Number(value.toPrecision(3)).toString();

const tableOf = field => makeTable(
  ["triangles an object", "test", "kept", "cull, ms", "draw, ms", "sum, ms", "over the cheapest"],
  field.points.flatMap(point => tests.map(test => {
    const timed = point.tests[test];
    return [short(point.triangles), test, short(timed.kept), three(timed.cull_ms), three(timed.draw_ms), three(sum(timed)),
      ratio(point, test).toFixed(3)];
  })));

function drawRatios(field, canvas) {
  const line = test => ({
    label: test, data: field.points.map(point => ({x: point.triangles, y: ratio(point, test)})), showLine: true,
    borderColor: colour(colours[test]), backgroundColor: colour(colours[test]), borderWidth: 1.5,
    borderDash: test === "none" ? [6, 4] : [], pointRadius: 2.5,
  });
  const title = text => ({display: true, text});
  const places = field.points.map(point => point.triangles);
  return new Chart(canvas, {
    type: "scatter", data: {datasets: tests.map(line)},
    options: {
      animation: false, maintainAspectRatio: false,
      plugins: {legend: {align: "end", labels: {boxWidth: 18, boxHeight: 1}}},
      scales: {
        x: {type: "logarithmic", title: title("triangles an object"), min: places[0], max: places[places.length - 1],
          afterBuildTicks: scale => { scale.ticks = places.map(value => ({value})); },
          ticks: {maxRotation: 0, callback: short}},
        y: {title: title("cull + draw, over the cheapest test"), min: 1},
      },
    },
  });
}

// Tests whose cost is within kAlike of the cheapest one: less is noise.
const kAlike = 1.01;
const alike = point => tests.filter(test => ratio(point, test) <= kAlike);
const flips = field => field.points.map(
  point => `${short(point.triangles)} triangles: ${alike(point).join(", ")}`).join("; ") + ".";

showTiles(data.fields.map(field => [
  `${short(field.objects)} objects without a test, over the cheapest one`,
  "up to " + Math.max(...field.points.map(point => ratio(point, "none"))).toFixed(2), false]));
const canvases = data.fields.map(field => addTableCard(
  `${short(field.objects)} objects`, "Cheapest within 1 %: " + flips(field), tableOf(field)));
keepDrawn(() => data.fields.map((field, i) => drawRatios(field, canvases[i])));
showSummary();
