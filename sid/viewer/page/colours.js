/* ---- Scalars to colours. ---- */

// Lightness falls steadily from one end to the other, so the order shows to all eyes and in grey print.
const RAMP = ["#f6f1e7", "#ebe8de", "#d8e1dd", "#b9d2d9", "#90bad3", "#659ec9", "#4579b5", "#36479a", "#2a1f66"];

/** A short text of a number: three digits. */
function short(x) {
  if (x === 0) return "0";
  const size = Math.abs(x);
  return size >= 0.001 && size < 1e5 ? String(+x.toPrecision(3)) : x.toExponential(1).replace("e+", "e").replace(".0e", "e");
}

/**
 * Shade (0 to 1) of each vertex, and the ticks of the colour bar as [place, text].
 * `t` counts the times, with fractions in between. The scale runs from the 2nd to the 99.8th percentile in the
 * logarithm: a few extreme vertices would leave all others one colour.
 */
function shadeOf(model, field, t, scale, shade) {
  const n = model.n, row = Math.floor(t), next = field.rows ? Math.min(row + 1, field.rows.length - 1) : 0, w = t - row;
  const logarithmic = scale !== "linear" && hasLogarithm(field);
  let floor = 0;
  if (field.exact) floor = maximum(field.exact) * 1e-7; // zeros have no logarithm
  for (let i = 0; i < n; i++) {
    let x = field.exact ? field.exact[i] : code(field, row, i);
    if (field.rows && w > 0) x += w * (code(field, next, i) - x);
    if (field.rows && field.entries[row].log) shade[i] = logarithmic ? x : Math.exp(x);
    else shade[i] = logarithmic ? Math.log(Math.max(x, floor)) : x;
  }
  const some = [], step = Math.max(1, Math.floor(n / 5000));
  for (let i = 0; i < n; i += step) some.push(shade[i]);
  const sorted = Float32Array.from(some).sort(), last = sorted.length - 1;
  const at = (share) => sorted[Math.round(share * last)];
  const value = logarithmic ? Math.exp : (x) => x;
  if (scale === "rank") {
    for (let i = 0; i < n; i++) shade[i] = last ? rankIn(sorted, shade[i]) / last : 0;
    return [0, 0.25, 0.5, 0.75, 1].map((share) => [share, short(value(at(share)))]);
  }
  const low = logarithmic ? at(0.02) : at(0.002), high = at(0.998), span = high - low || 1;
  for (let i = 0; i < n; i++) shade[i] = (shade[i] - low) / span;
  const places = logarithmic ? logTicks(Math.exp(low), Math.exp(high)) : linearTicks(low, high);
  return places.map((x) => [((logarithmic ? Math.log(x) : x) - low) / span, short(x)]);
}

const code = (field, row, i) => {
  const { low, high } = field.entries[row];
  return low + (field.rows[row][i] / 32767) * (high - low);
};

function maximum(values) { let m = -Infinity; for (const x of values) if (x > m) m = x; return m; }

/** Whether a field can be shown on a logarithmic scale: it is nowhere negative, and somewhere positive. */
function hasLogarithm(field) {
  if (field.logarithm === undefined) {
    field.logarithm = field.exact ? maximum(field.exact) > 0 && field.exact.every((x) => x >= 0) : field.entries.every((e) => e.log);
  }
  return field.logarithm;
}

function rankIn(sorted, x) {
  let low = 0, high = sorted.length - 1;
  while (low < high) { const middle = (low + high) >> 1; if (sorted[middle] < x) low = middle + 1; else high = middle; }
  return low;
}

function linearTicks(low, high) {
  const step0 = (high - low) / 4 || 1, power = 10 ** Math.floor(Math.log10(step0));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= step0 * 0.999);
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-9; k++) ticks.push(+(k * step).toPrecision(12));
  return ticks.length ? ticks : [low];
}

function logTicks(low, high) {
  const decades = Math.log10(high / low);
  if (decades < 0.7) return linearTicks(low, high).filter((x) => x > 0);
  const multiples = decades < 1.5 ? [1, 2, 5] : decades < 2.5 ? [1, 3] : [1], stride = Math.ceil(decades / 5), ticks = [];
  for (let d = Math.floor(Math.log10(low)); d <= Math.log10(high); d++) {
    if (multiples.length === 1 && d % stride) continue;
    for (const m of multiples) { const x = m * 10 ** d; if (x >= low * 0.999 && x <= high * 1.001) ticks.push(+x.toPrecision(3)); }
  }
  return ticks;
}
