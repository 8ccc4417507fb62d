// Content of the report of one flight.
const s = data.summary;
const tiles = [
  ["frames", short(s.frames), false],
  ["triangles, most", short(s.triangles_max) + " of " + short(s.budget), s.over_budget_frames > 0],
  ["certified error, median", bound(s.error_px_median) + " px", false],
];
if ("measured_error_px_max" in s) {
  tiles.push(["measured error, most", short(s.measured_error_px_max) + " px", s.uncertified_frames > 0]);
  tiles.push(["movement between frames, most", short(s.max_pop_px) + " px", false]);
}
tiles.push(["update, median / 99 %",
  short(s.update_ms_median) + " / " + short(s.update_ms_p99) + " ms", false]);
tiles.push(["memory, peak", megabytes(s.peak_bytes) + " of " + megabytes(s.memory_bytes),
  s.peak_bytes > s.memory_bytes]);
tiles.push(["late frames", short(s.late_frames), false]);
if ("distance_m" in s) tiles.push(["distance driven", short(s.distance_m) + " m", false]);
if ("fell_through" in s) tiles.push(["fell through", short(s.fell_through), s.fell_through > 0]);

const level = value => data.time.map(() => value);
const plots = [
  ["Triangles", "What a frame draws; never more than the budget.", [
    ["triangles", data.triangles, "--main"], ["budget", level(data.budget), "--limit", true]]],
  ["Screen error, px", "Certified for every ground point in view, at most" +
    (data.measured ? "; measured by brute force below it." : ".") +
    (data.note ? " It is " + data.note + "." : ""), [
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
  ...data.extra.map(column => [column.title, "", [[column.title, column.values, "--main"]]]),
];

showTiles(tiles);
showSummary();
showPlots(plots.map(([title, text, series]) => ({title, text, time: data.time, series})));
