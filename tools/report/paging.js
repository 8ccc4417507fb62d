// Content of the report of flights over simulated storage: one row for each cell, the policies side by side.
const policies = ["deadline", "distance", "oracle"].filter(
  policy => data.cells.some(cell => policy in cell.runs));
const anyRun = cell => Object.values(cell.runs)[0];
const fileName = path => path.split("/").pop();
const percent = share => (100 * share).toFixed(1);
const figure = value => value < 100 ? value.toFixed(2)
  : value.toLocaleString("en-US", {maximumFractionDigits: 0});

// [heading, key of the target, value of a run, [heading of the ratio, key of the ratio, target]]
const groups = [
  ["late frames", "late_frames", run => short(run.late_frames),
    ["of distance", "late_ratio", data.targets.late]],
  ["late excess error, px s", "late_excess_error_px_s", run => figure(run.late_excess_error_px_s),
    ["of oracle", "excess_ratio", data.targets.excess]],
  ["wasted, %", "wasted_share", run => percent(run.wasted_share)],
  ["contact late", "contact_late", run => short(run.contact_late)],
  ["peak, MB", "peak_bytes", run => (run.peak_bytes / 1048576).toFixed(1)],
];
const places = [
  ["path", run => fileName(run.path)],
  ["m/s", run => run.speed === null ? "" : short(run.speed)],
  ["latency, ms", run => short(run.latency_ms)],
  ["MB/s", run => short(run.bandwidth_mb)],
  ["memory, MB", run => short(run.memory_mb)],
  ["radius", (run, cell) => "distance" in cell.runs ? short(cell.runs.distance.radius) : ""],
];
const ratioText = value => value === null ? "" : value === "inf" ? "∞" : figure(value);

// Missed targets are marked at the policy `deadline`, the memory ceiling at every policy.
const isMissed = (cell, key, policy) => cell.missed.includes(key) &&
  (policy === "deadline" || key === "peak_bytes");

function showTable() {
  const table = document.getElementById("table");
  const head = table.createTHead();
  const upper = head.insertRow(), lower = head.insertRow();
  for (const [name] of places) {
    const cell = element("th", name);
    cell.rowSpan = 2;
    upper.append(cell);
  }
  for (const [name, , , ratio] of groups) {
    const cell = element("th", name, "first");
    cell.colSpan = policies.length + (ratio ? 1 : 0);
    upper.append(cell);
    policies.forEach((policy, i) => lower.append(element("th", policy, i === 0 ? "first" : "")));
    if (ratio) lower.append(element("th", ratio[0]));
  }
  const body = table.createTBody();
  for (const cell of data.cells) {
    const row = body.insertRow();
    for (const [, show] of places) row.append(element("td", show(anyRun(cell), cell)));
    for (const [, key, show, ratio] of groups) {
      policies.forEach((policy, i) => {
        const run = cell.runs[policy];
        const marks = [i === 0 ? "first" : "", run && isMissed(cell, key, policy) ? "bad" : ""];
        row.append(element("td", run ? show(run) : "", marks.join(" ")));
      });
      if (ratio) {
        row.append(element("td", ratioText(cell[ratio[1]]), cell.missed.includes(key) ? "bad" : ""));
      }
    }
  }
}

const count = key => data.cells.filter(cell => cell.missed.includes(key)).length;
const {late, excess, wasted} = data.targets;
const targets = [
  ["late frames above " + short(100 * late) + " %" + " of distance's, the oracle having none", "late_frames"],
  ["late excess error above " + excess + " of the oracle's, it being late too", "late_excess_error_px_s"],
  ["more than " + short(100 * wasted) + " %" + " of the bytes wasted", "wasted_share"],
  ["ground late that the oracle had in time", "contact_late"],
  ["memory above the ceiling", "peak_bytes"],
];
showTiles([["cells", short(data.cells.length), false],
  ...targets.map(([label, key]) => [label, short(count(key)), count(key) > 0])]);
showTable();
showSummary();

const colours = {deadline: "--main", distance: "--limit", oracle: "--second"};
showPlots(data.cells.filter(cell => cell.time).map(cell => {
  const run = anyRun(cell);
  return {
    title: fileName(run.path) + (run.speed === null ? "" : ", " + short(run.speed) + " m/s"),
    text: "Certified screen error, px: " + short(run.latency_ms) + " ms, " +
      short(run.bandwidth_mb) + " MB/s, " + short(run.memory_mb) + " MB of memory.",
    time: cell.time,
    series: [...Object.entries(cell.errors).map(
      ([policy, errors]) => [policy, errors, colours[policy]]),
    ["target", cell.time.map(() => cell.target), "--soft", true]],
  };
}));
