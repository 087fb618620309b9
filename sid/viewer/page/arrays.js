/* ---- Arrays of the page: the counterpart of encoding.py. ---- */

/** Bytes of an element that holds deflated bytes as base64. */
async function unpack(element) {
  const text = element.textContent;
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** An array from its entry: the first bytes of all numbers come first, then the second bytes, and so on. */
function readArray(bytes, entry) {
  const kind = { u2: Uint16Array, u4: Uint32Array, f4: Float32Array, f8: Float64Array }[entry.type];
  const width = kind.BYTES_PER_ELEMENT, out = new Uint8Array(entry.length * width);
  for (let b = 0; b < width; b++) {
    const start = entry.at + b * entry.length;
    for (let i = 0; i < entry.length; i++) out[i * width + b] = bytes[start + i];
  }
  const values = new kind(out.buffer);
  if (entry.delta) for (let i = 0, sum = 0; i < values.length; i++) values[i] = sum += unzigzag(values[i]);
  return values;
}

const unzigzag = (x) => (x & 1 ? -(x + 1) / 2 : x / 2);

/** The codes of a scalar over times: each row is the difference to the one before. */
function readRows(bytes, entries) {
  let before = null;
  return entries.map((entry) => {
    const codes = readArray(bytes, entry);
    for (let i = 0; i < codes.length; i++) codes[i] = (before ? before[i] : 0) + unzigzag(codes[i]); // modulo 2^16
    return (before = codes);
  });
}

/** A mesh with its arrays, ready to draw. */
async function readModel(meta, element) {
  const bytes = await unpack(element);
  const n = meta.vertices, axes = meta.position.map((entry) => readArray(bytes, entry));
  // What is drawn is centred and of radius 1, worked out in double precision: far from the origin, too.
  const middle = [], half = [];
  axes.forEach((values, a) => {
    let low = Infinity, high = -Infinity;
    for (const x of values) { if (x < low) low = x; if (x > high) high = x; }
    middle[a] = (low + high) / 2; half[a] = (high - low) / 2;
  });
  const radius = Math.hypot(...half) || 1, local = new Float32Array(3 * n);
  axes.forEach((values, a) => values.forEach((x, i) => { local[3 * i + a] = (x - middle[a]) / radius; }));
  const fields = meta.fields.map((field) => {
    if (!field.rows) return { name: field.name, exact: readArray(bytes, field.value) };
    return { name: field.name, entries: field.rows, rows: readRows(bytes, field.rows) };
  });
  return {
    meta, axes, local, middle, radius, fields, n, index: readArray(bytes, meta.index),
    number: meta.number ? readArray(bytes, meta.number) : null, marks: null,
  };
}

/** Value of a field at a vertex; `row` counts the times. */
function valueAt(field, row, vertex) {
  if (field.exact) return field.exact[vertex];
  const { low, high, log } = field.entries[row], x = low + (field.rows[row][vertex] / 32767) * (high - low);
  return log ? Math.exp(x) : x;
}

/** The vertex's number in the user's file. */
const numberOf = (model, vertex) => (model.number ? model.number[vertex] : vertex);

/** A coordinate with the digits of the file: of single precision as few as tell it apart. */
function exactText(x, single) {
  if (single) for (let digits = 6; digits < 9; digits++) {
    const shorter = +x.toPrecision(digits);
    if (Math.fround(shorter) === x) return String(shorter);
  }
  return String(single ? +x.toPrecision(9) : x);
}
const placeOf = (model, vertex) => model.axes.map((a) => exactText(a[vertex], a instanceof Float32Array));

/** The vertex nearest to a place in the mesh's coordinates, and how far it is. */
function nearestVertex(model, place) {
  let best = -1, least = Infinity;
  const [x, y, z] = model.axes;
  for (let i = 0; i < model.n; i++) {
    const d = (x[i] - place[0]) ** 2 + (y[i] - place[1]) ** 2 + (z[i] - place[2]) ** 2;
    if (d < least) { least = d; best = i; }
  }
  return [best, Math.sqrt(least)];
}
