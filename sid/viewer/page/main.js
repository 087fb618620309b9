/* ---- The page: its state, and what each control does to it. ---- */

const page = JSON.parse($("meta").textContent), body = document.body;
const PLAIN = " plain"; // no field that Python names begins so by accident
const models = page.models.map(() => null); // unpacked when first shown
const state = {
  mesh: 0, field: null, scale: "log", t: null, step: null, judge: true, compare: false, on: null, vertex: -1,
  marking: page.marking, subject: "",
};
let drawing, model, sets = [], tags = [];

async function start() {
  document.title = page.title;
  if (typeof DecompressionStream === "undefined") throw new Error("This browser is too old to open this page; use one of 2023 or later.");
  const code = await unpack($("three"));
  document.head.append(element("script", { textContent: new TextDecoder().decode(code) }));
  try { drawing = new Drawing($("view"), $("stage"), globalThis.THREE ?? THREE); } catch (error) {
    throw new Error("This page draws with WebGL, which is missing or switched off in this browser. Switch on hardware acceleration in its settings, or open the page in another browser.", { cause: error });
  }
  tags = [0, 1].map(() => $("stage").appendChild(element("div", { className: "tag", hidden: true })));
  tags.divider = $("stage").appendChild(element("div", { className: "divider", hidden: true }));
  drawing.beforeView = beforeView; drawing.afterDraw = placeTags;
  drawing.resize();
  listen(); fillMeshes(); setMarking(state.marking);
  await openMesh(0);
}

// ---- a mesh

async function openMesh(i) {
  state.mesh = i;
  if (!models[i]) { models[i] = await readModel(page.models[i], $(`data-${i}`)); $(`data-${i}`).textContent = ""; models[i].marks = new Marks(); }
  if (state.mesh !== i) return; // another was asked for meanwhile
  model = models[i];
  const { meta } = model;
  drawing.show(model);
  sets = [
    ...meta.sets.map((s, k) => ({ ...s, key: "set:" + s.name, role: "detector", kind_: KINDS[k % 4], colour: COLOURS[k % 8], size: 16 })),
    ...(meta.truth ? [{ ...meta.truth, key: "truth", role: "truth", kind_: "ring", colour: "#ffffff", size: 21 }] : []),
    ...meta.people.map((s, k) => ({ ...s, key: "person:" + s.name, role: "person", kind_: "dot", colour: COLOURS[(k + 5) % 8], size: 14 })),
  ];
  for (const set of sets) set.layer = drawing.addGlyphs(set.kind_, set.colour, set.vertex, set.size);
  if (meta.times.length && state.t === null) state.t = Math.max(0, meta.times.findLastIndex((t) => t <= 0.0500001));
  state.t = Math.min(state.t ?? 0, Math.max(0, meta.times.length - 1));
  if (meta.radii) {
    state.step ??= Math.max(0, meta.radii.findLastIndex((r) => r <= 0.0300001));
    state.step = Math.min(state.step, meta.radii.length - 1);
    $("r").max = meta.radii.length - 1; $("r").value = state.step;
  }
  $("judging").hidden = !meta.radii;
  $("name").textContent = meta.name;
  $("size").textContent = `${meta.vertices.toLocaleString("en")} vertices, ${meta.faces.toLocaleString("en")} faces`;
  $("colour").hidden = !model.fields.length; $("points").hidden = !sets.length;
  $("field").replaceChildren(...model.fields.map((f) => element("option", { value: f.name, textContent: f.name })), element("option", { value: PLAIN, textContent: "plain" }));
  $("t").max = Math.max(0, meta.times.length - 1);
  drawing.reset(false); select(-1); showModel(); listMeshes();
}

/** Bring the panel and the colours in line with the state. */
function showModel() {
  chooseFirst();
  $("field").value = state.field;
  fillSets(); fillMarks(); showMarks(); colour();
}

/** The first mesh decides what is shown at the start; after that the user does. */
function chooseFirst() {
  const first = model.meta.sets.map((s) => "set:" + s.name), truth = model.meta.truth ? ["truth"] : [];
  state.on ??= [0, 1].map((side) => new Set(state.marking ? [] : [...first.slice(side, side + 1), ...truth]));
  if (state.field === null || (state.field !== PLAIN && !currentField())) state.field = model.fields[0]?.name ?? PLAIN;
}

const currentField = () => model.fields.find((f) => f.name === state.field);

function colour() {
  const field = currentField();
  $("scale").hidden = !field; $("bar").toggleAttribute("hidden", !field); $("time").hidden = !field?.rows;
  if (!field) { drawing.shade.fill(0); drawing.recolour(); return; }
  const possible = hasLogarithm(field), scale = state.scale === "log" && !possible ? "linear" : state.scale;
  $("scale").options[0].disabled = !possible; $("scale").value = scale;
  state.ticks = shadeOf(model, field, field.rows ? state.t : 0, scale, drawing.shade);
  fillBar($("bar"), state.ticks);
  if (field.rows) { $("t").value = state.t; $("t-value").textContent = short(timeNow()); }
  drawing.recolour();
}
function timeNow() {
  const times = model.meta.times, row = Math.floor(state.t), w = state.t - row;
  return Math.exp(Math.log(times[row]) * (1 - w) + Math.log(times[Math.min(row + 1, times.length - 1)]) * w);
}
function setTime(t) {
  if (!model.meta.times.length) return;
  state.t = Math.min(model.meta.times.length - 1, Math.max(0, t));
  if (!currentField()?.rows) { state.field = model.fields.find((f) => f.rows)?.name ?? state.field; $("field").value = state.field; }
  colour(); describe();
}

// ---- points and scores

function fillSets() {
  const scored = Boolean(model.meta.radii), sides = state.compare ? [0, 1] : [0];
  const head = () => element("tr", {}, ...sides.map((s) => element("th", { textContent: state.compare ? "AB"[s] : "" })), element("th"), element("th"),
    element("th", { textContent: state.compare ? "n" : "points", title: "number of points" }),
    ...(scored ? [["FNE", "False negative error: share of the ground truth that is missed"], ["FPE", "False positive error: share of the points that are false"],
      ["IoU", "Found, over ground truth and points together"]].map(([textContent, title]) => element("th", { textContent, title })) : []));
  const row = (set) => {
    const boxes = sides.map((side) => {
      const box = element("input", { type: "checkbox", checked: state.on[side].has(set.key), id: `box-${sets.indexOf(set)}-${side}` });
      box.onchange = () => toggle(set.key, side);
      return element("td", {}, labelled(box, set.name + (state.compare ? ", view " + "AB"[side] : "")));
    });
    const label = element("label", { textContent: set.name, htmlFor: `box-${sets.indexOf(set)}-0`, title: set.name });
    const cells = [...boxes, element("td", {}, glyphSvg(set.kind_, set.colour)), element("td", { className: "name" }, label), element("td", { textContent: set.vertex.length })];
    if (scored) {
      const s = set.found && scoresAt(set, model.meta.truth, state.step);
      cells.push(...["fne", "fpe", "iou"].map((m) => element("td", { textContent: s ? s[m].toFixed(2) : "" })));
    }
    return element("tr", { data: { set: set.key } }, ...cells);
  };
  const people = sets.filter((s) => s.role === "person");
  $("sets").replaceChildren(head(), ...sets.filter((s) => s.role !== "person").map(row));
  $("people").hidden = !people.length;
  if (people.length) {
    $("people-count").textContent = `What ${people.length} ${people.length === 1 ? "person" : "people"} marked`;
    const all = sides.map((side) => {
      const box = element("input", { type: "checkbox", checked: people.every((p) => state.on[side].has(p.key)) });
      box.onchange = () => { for (const p of people) state.on[side][box.checked ? "add" : "delete"](p.key); fillSets(); drawing.dirty(); };
      return element("td", {}, labelled(box, "all people"));
    });
    $("persons").replaceChildren(element("tr", {}, ...all, element("td"), element("td", { className: "name", textContent: "all" }),
      element("td", { textContent: people.reduce((sum, p) => sum + p.vertex.length, 0) }), ...(scored ? [0, 1, 2].map(() => element("td")) : [])), ...people.map(row));
  }
  fillLegend();
}

/** The set against which a view's ground truth is judged: the first that is switched on. */
const judged = (side) => sets.find((s) => state.on[side].has(s.key) && s.found);

function fillLegend() {
  if (!model.meta.radii) return;
  $("r-value").textContent = model.meta.radii[state.step];
  const set = judged(0) ?? sets.find((s) => s.found);
  const entry = (glyph, text) => element("span", {}, glyph, " " + text);
  const { kind_, colour: c } = set ?? { kind_: "disc", colour: COLOURS[0] };
  $("legend").hidden = !state.judge;
  $("legend").replaceChildren(entry(glyphSvg(kind_, c), "right"), entry(glyphSvg("ring", "#fff"), "found"),
    entry(glyphSvg(kind_, c, false), "false"), entry(glyphSvg("ring", "#fff", false), "missed"));
  const names = (state.compare ? [0, 1] : [0]).map((side) => judged(side)?.name).filter(Boolean);
  $("judged-by").textContent = !state.judge ? "" : names.length ? `Found and missed: by ${[...new Set(names)].join(" in A, by ")}${new Set(names).size > 1 ? " in B" : ""}.` : "Switch on a detector to see what it finds and misses.";
}

function toggle(key, side = 0) {
  const on = state.on[side];
  if (!on.delete(key)) on.add(key);
  fillSets(); drawing.dirty();
}
function setStep(step) { state.step = +step; $("r").value = step; fillSets(); listMeshes(); drawing.dirty(); }

function beforeView(side) {
  const by = judged(side);
  for (const set of sets) {
    set.layer.visible = state.on[side].has(set.key);
    const first = !state.judge || !model.meta.radii ? null : set.role === "truth" ? by?.found : set.right;
    drawing.judge(set.layer, first ?? null, state.step ?? 0);
  }
  if (markLayer) { markLayer.visible = state.marking; drawing.judge(markLayer, null, 0); }
}

/** Vertices of the glyphs that a view shows. */
function* shown(side) {
  for (const set of sets) if (state.on[side].has(set.key)) yield* set.vertex;
  if (state.marking) for (const mark of model.marks.list) yield mark.vertex;
}

// ---- a vertex

function select(vertex) { state.vertex = vertex; drawing.choose(vertex); describe(); }

function describe() {
  const v = state.vertex;
  $("curves").replaceChildren();
  if (v < 0) { $("vertex").replaceChildren(element("p", { className: "soft", textContent: sets.length ? "Click the mesh, or press N for the next point." : "Click the mesh." })); return; }
  const rows = [["number", String(numberOf(model, v))], ["x, y, z", placeOf(model, v).join(", ")]];
  for (const field of model.fields) {
    if (field.exact) rows.push([field.name, String(+field.exact[v].toPrecision(7))]);
    else if (field.rows && field === currentField()) rows.push([`${field.name} at t = ${short(model.meta.times[Math.round(state.t)])}`, short(valueAt(field, Math.round(state.t), v))]);
  }
  for (const set of sets) {
    const i = set.vertex.indexOf(v);
    if (i < 0) continue;
    const saliency = set.saliency && !model.fields.some((f) => f.name === "saliency") ? `saliency ${+set.saliency[i].toPrecision(7)}` : "";
    const verdict = set.right && model.meta.radii ? (set.right[i] <= state.step ? "right" : "false") : set.role === "truth" && judged(0) ? (judged(0).found[i] <= state.step ? "found" : "missed") : "";
    rows.push([set.name, [`point ${i + 1} of ${set.vertex.length}`, set.kind?.[i], saliency, verdict].filter(Boolean).join(", ")]);
  }
  const copy = element("button", { className: "small", textContent: "Copy", id: "copy" });
  copy.onclick = () => copyText(rows.map((r) => r.join("\t")).join("\n"), copy);
  const face = element("button", { className: "small", textContent: "Face", title: "key F" });
  face.onclick = () => drawing.face(v);
  const next = (by, textContent) => Object.assign(element("button", { className: "small", textContent }), { onclick: () => nextPoint(by) });
  $("vertex").replaceChildren(element("dl", {}, ...rows.flatMap(([key, value]) => [element("dt", { textContent: key }), element("dd", { textContent: value })])),
    element("div", { className: "row" }, copy, face, ...(sets.length ? [next(-1, "\u2039 Previous"), next(1, "Next \u203a")] : [])));
  $("curves").replaceChildren(...model.fields.filter((f) => f.rows && f.rows.length > 1).map((f) => curve(f, model.meta.times, v, state.t)));
}

async function copyText(text, button) {
  try { await navigator.clipboard.writeText(text); } catch {
    const area = body.appendChild(element("textarea", { value: text })); area.select(); document.execCommand("copy"); area.remove();
  }
  button.textContent = "Copied"; setTimeout(() => { button.textContent = "Copy"; }, 1200);
}

function nextPoint(by) {
  const set = sets.find((s) => state.on[0].has(s.key)) ?? sets[0];
  if (!set?.vertex.length) return;
  const at = set.vertex.indexOf(state.vertex), n = set.vertex.length, next = set.vertex[at < 0 ? (by > 0 ? 0 : n - 1) : (at + by + n) % n];
  select(next); drawing.face(next);
}

// ---- marking

let markLayer = null, numberTags = [];

/** While a person marks, nothing shows what others or a detector found: it would sway the marks. */
function setMarking(on) {
  if (on && !state.before) {
    state.before = { on: state.on, field: state.field };
    if (state.on) state.on = [new Set(), new Set()];
    state.field = PLAIN;
  } else if (!on && state.before) {
    Object.assign(state, state.before); state.before = null;
  }
  state.marking = on;
  body.classList.toggle("marking", on); $("marking").hidden = !on; $("mark").setAttribute("aria-pressed", on);
  $("hint").textContent = on ? "click to mark a point \u00b7 drag to turn \u00b7 wheel or pinch to zoom" : "drag to turn \u00b7 wheel or pinch to zoom \u00b7 click a point to read it";
  if (model) showModel();
}

function showMarks() {
  if (markLayer) { drawing.removeGlyphs(markLayer); markLayer = null; }
  for (const tag of numberTags) tag.remove();
  const { list } = model.marks;
  if (list.length) markLayer = drawing.addGlyphs("disc", "#e6007e", list.map((m) => m.vertex), 14);
  numberTags = !state.marking ? [] : list.map((m, i) => $("stage").appendChild(element("div", { className: "number-tag", textContent: m.name || i + 1 })));
  drawing.dirty();
}

function placeTags() {
  tags.forEach((tag, side) => {
    tag.hidden = !state.compare;
    const f = drawing.frame(side), names = sets.filter((s) => state.on[side].has(s.key)).map((s) => s.name);
    tag.style.left = f.x + 10 + "px"; tag.style.top = f.y + 10 + "px";
    tag.textContent = "AB"[side] + ": " + (names.length > 4 ? `${names.length} sets of points` : names.join(", ") || "no points");
  });
  const line = drawing.frame(1), tall = drawing.height > drawing.width;
  tags.divider.hidden = !state.compare;
  Object.assign(tags.divider.style, tall ? { left: 0, top: line.y + "px", width: "100%", height: "1px" } : { left: line.x + "px", top: 0, width: "1px", height: "100%" });
  numberTags.forEach((tag, i) => {
    const mark = model.marks.list[i];
    if (!mark) return;
    const [x, y] = drawing.project(mark.vertex);
    tag.hidden = !drawing.facing(mark.vertex);
    tag.style.transform = `translate(${x + 9}px, ${y - 8}px)`;
  });
}

function fillMarks(focus = -1) {
  const { marks } = model;
  $("undo").disabled = !marks.past.length; $("redo").disabled = !marks.future.length; $("save-marks").disabled = !marks.list.length;
  $("save-marks").textContent = marks.list.length ? `Save ${marks.list.length} ${marks.list.length === 1 ? "mark" : "marks"}` : "Save marks";
  $("marks").replaceChildren(...marks.list.map((mark, i) => {
    const go = labelled(element("button", { className: "number", textContent: i + 1 }), `go to mark ${i + 1}`);
    go.onclick = () => { marks.chosen = i; select(mark.vertex); drawing.face(mark.vertex); fillMarks(); };
    const name = labelled(element("input", { value: mark.name, placeholder: "name" }), `name of mark ${i + 1}`);
    name.onchange = () => { marks.rename(i, name.value.trim()); fillMarks(); showMarks(); };
    const vertex = element("span", { className: "soft", textContent: numberOf(model, mark.vertex), title: `vertex, marked by ${mark.subject || "?"}` });
    const remove = labelled(element("button", { className: "small", textContent: "\u00d7" }), `delete mark ${i + 1}`);
    remove.onclick = () => { marks.remove(i); fillMarks(); showMarks(); };
    return element("li", { className: i === marks.chosen ? "chosen" : "" }, go, name, vertex, remove);
  }));
  const chosen = $("marks").children[marks.chosen];
  if (chosen) $("marks").scrollTop = chosen.offsetTop - $("marks").offsetTop - 60; // the list alone: the panel stays where it is
  if (focus >= 0) $("marks").querySelectorAll("input")[focus]?.focus();
}

function placeMark(vertex) {
  const { marks } = model, there = marks.at(vertex);
  if (there >= 0) marks.chosen = there;
  else marks.add({ subject: state.subject, name: "", place: placeOf(model, vertex), vertex });
  say(""); select(vertex); fillMarks(); showMarks();
}

function changeMarks(what) {
  const { marks } = model;
  if (what === "delete") { if (marks.chosen >= 0) marks.remove(marks.chosen); } else marks[what]();
  fillMarks(); showMarks();
}

const say = (text, warning = false) => { $("mark-message").textContent = text; $("mark-message").className = warning ? "warning" : ""; };

/** The text of the file of marks, or a message on what is missing. */
function marksText(format) {
  const { list } = model.marks;
  if (format === "csv" && list.some((m) => !m.subject)) { say("Type your name first: it tells your marks from those of others.", true); $("subject").focus(); return null; }
  return FORMATS[format](list, model.meta.name);
}
function saveMarks() {
  const format = $("format").value, text = marksText(format);
  if (text === null) return;
  const people = [...new Set(model.marks.list.map((m) => m.subject))];
  download(new Blob([text]), `${model.meta.name}_marks${people.length === 1 && people[0] ? "_" + people[0] : ""}.${format}`);
  model.marks.saved = true;
  say(`Saved ${model.marks.list.length} marks as ${format}, in the folder of downloads.`);
}

/** Add the marks of a file. Each is shown at the vertex nearest to it and keeps its own place. */
function addMarks(text, name = "the file") {
  let read;
  try { read = readMarks(text); } catch (error) { say(`${name} could not be read: ${error.message}.`, true); return; }
  let off = 0;
  const marks = read.map((mark) => {
    const [vertex, distance] = nearestVertex(model, mark.place.map(Number));
    if (distance > 0.1 * model.radius) off++;
    return { ...mark, vertex };
  });
  model.marks.change([...model.marks.list, ...marks]);
  say(off ? `${off} of ${marks.length} marks in ${name} lie off this mesh; do they belong to another?` : `Added ${marks.length} marks of ${name}.`, off > 0);
  fillMarks(); showMarks();
}

// ---- the list of meshes

function fillMeshes() {
  $("meshes").hidden = page.models.length < 2;
  $("meshes").open = innerWidth > 700;
  $("mesh-count").textContent = `${page.models.length} meshes`;
  const detectors = [...new Set(page.models.flatMap((m) => (m.radii ? m.sets.map((s) => s.name) : [])))];
  const orders = [["order", "as given"], ["name", "by name"], ["vertices", "by size"], ...detectors.map((d) => ["fne:" + d, `by FNE of ${d}`])];
  $("mesh-sort").replaceChildren(...orders.map(([value, textContent]) => element("option", { value, textContent })));
}
function listMeshes() {
  if (page.models.length < 2) return;
  const wanted = $("mesh-search").value.trim().toLowerCase(), [order, detector] = $("mesh-sort").value.split(/:(.*)/s);
  const rows = page.models.map((m, i) => {
    const set = order === "fne" && m.radii ? m.sets.find((s) => s.name === detector) : null;
    return { m, i, fne: set ? scoresAt(set, m.truth, Math.min(state.step ?? 0, m.radii.length - 1)).fne : null };
  }).filter(({ m }) => m.name.toLowerCase().includes(wanted));
  const key = { order: (a, b) => a.i - b.i, name: (a, b) => a.m.name.localeCompare(b.m.name), vertices: (a, b) => b.m.vertices - a.m.vertices, fne: (a, b) => (b.fne ?? -1) - (a.fne ?? -1) };
  $("mesh-list").replaceChildren(...rows.sort(key[order]).map(({ m, i, fne }) => {
    const note = order === "fne" ? (fne === null ? "" : `FNE ${fne.toFixed(2)}`) : m.vertices.toLocaleString("en");
    const button = element("button", { onclick: () => openMesh(i) }, element("span", { textContent: m.name }), element("span", { textContent: note }));
    button.setAttribute("role", "option"); button.setAttribute("aria-selected", i === state.mesh);
    return button;
  }));
}

// ---- a picture of what is seen, with the colour bar and the names

function picture() {
  drawing.draw();
  const canvas = $("view"), k = drawing.renderer.getPixelRatio(), out = element("canvas", { width: canvas.width, height: canvas.height + 64 * k });
  const c = out.getContext("2d"), style = getComputedStyle(body), y = canvas.height / k, field = currentField();
  c.fillStyle = style.backgroundColor; c.fillRect(0, 0, out.width, out.height); c.drawImage(canvas, 0, 0);
  c.scale(k, k); c.fillStyle = c.strokeStyle = style.color; c.font = "13px sans-serif";
  c.fillText(model.meta.name + (field ? `: ${field.name}${field.rows ? ", t = " + short(timeNow()) : ""}` : ""), 12, y + 14);
  if (field) {
    const gradient = c.createLinearGradient(12, 0, 232, 0);
    RAMP.forEach((x, i) => gradient.addColorStop(i / (RAMP.length - 1), x));
    c.fillStyle = gradient; c.fillRect(12, y + 22, 220, 12); c.fillStyle = style.color; c.font = "11px sans-serif"; c.textAlign = "center";
    for (const [s, text] of state.ticks) { c.fillRect(12 + s * 220, y + 34, 1, 4); c.fillText(text, 12 + s * 220, y + 50); }
  }
  c.textAlign = "left"; c.font = "13px sans-serif";
  let x = 260;
  for (const set of sets.filter((s) => state.on[0].has(s.key) || (state.compare && state.on[1].has(s.key)))) {
    c.save(); c.translate(x, y + 28); c.scale(8, 8);
    for (const [d, fill, stroke, width] of glyphSteps(set.kind_, set.colour)) {
      const path = new Path2D(d); c.lineWidth = width; c.strokeStyle = stroke; c.stroke(path);
      if (fill !== "none") { c.fillStyle = fill; c.fill(path); }
    }
    c.restore(); c.fillStyle = style.color; c.fillText(set.name, x + 13, y + 33); x += 34 + c.measureText(set.name).width;
  }
  return out;
}
const savePicture = () => picture().toBlob((blob) => download(blob, model.meta.name + ".png"));

function setCompare(on) {
  const front = drawing.fit();
  state.compare = on; drawing.views = on ? 2 : 1; $("compare").setAttribute("aria-pressed", on);
  drawing.zoom(drawing.fit() / front); // as large in its new frame as before
  fillSets(); drawing.dirty();
}

// ---- pointer, touch, keys and controls

function listen() {
  const canvas = $("view"), down = new Map();
  let moved = 0, fingers = 0;
  canvas.addEventListener("pointerdown", (e) => {
    canvas.setPointerCapture(e.pointerId); down.set(e.pointerId, [e.offsetX, e.offsetY]); drawing.run++;
    if (down.size === 1) { moved = 0; fingers = 1; } else fingers = 2;
  });
  canvas.addEventListener("pointermove", (e) => {
    const was = down.get(e.pointerId);
    if (!was || !model) return;
    const dx = e.offsetX - was[0], dy = e.offsetY - was[1];
    moved += Math.abs(dx) + Math.abs(dy);
    if (down.size === 2) {
      const other = [...down].find(([id]) => id !== e.pointerId)[1];
      drawing.zoom(Math.hypot(was[0] - other[0], was[1] - other[1]) / Math.max(1, Math.hypot(e.offsetX - other[0], e.offsetY - other[1])));
      drawing.shift(dx / 2, dy / 2);
    } else if (e.shiftKey || e.buttons & 6) drawing.shift(dx, dy);
    else if (moved > 4) { canvas.classList.add("turning"); drawing.turn(dx * 0.008, dy * 0.008); }
    down.set(e.pointerId, [e.offsetX, e.offsetY]);
  });
  const up = (e) => {
    canvas.classList.remove("turning");
    if (!down.delete(e.pointerId) || e.type !== "pointerup" || moved > 6 || fingers > 1 || e.button !== 0 || !model) return;
    const vertex = drawing.pick(e.offsetX, e.offsetY, shown, e.pointerType === "touch" ? 18 : 9);
    if (state.marking && vertex >= 0) placeMark(vertex); else select(vertex);
  };
  canvas.addEventListener("pointerup", up); canvas.addEventListener("pointercancel", up);
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("wheel", (e) => { e.preventDefault(); drawing.zoom(Math.exp(Math.max(-60, Math.min(60, e.deltaY)) * 0.002)); }, { passive: false });
  canvas.addEventListener("webglcontextlost", (e) => { e.preventDefault(); fail("The graphics of this browser stopped. Load the page again."); });

  const move = (by) => openMesh((state.mesh + by + models.length) % models.length);
  const keys = {
    ArrowLeft: () => drawing.turn(-0.12, 0), ArrowRight: () => drawing.turn(0.12, 0), ArrowUp: () => drawing.turn(0, -0.12), ArrowDown: () => drawing.turn(0, 0.12),
    "+": () => drawing.zoom(1 / 1.15), "=": () => drawing.zoom(1 / 1.15), "-": () => drawing.zoom(1.15),
    t: () => setTime(state.t + 0.25), T: () => setTime(state.t - 0.25), c: () => setCompare(!state.compare), r: () => drawing.reset(), s: savePicture,
    m: () => setMarking(!state.marking), n: () => nextPoint(1), p: () => nextPoint(-1), f: () => state.vertex >= 0 && drawing.face(state.vertex),
    "[": () => move(-1), "]": () => move(1), Delete: () => state.marking && changeMarks("delete"), Backspace: () => state.marking && changeMarks("delete"), Escape: () => select(-1),
  };
  addEventListener("keydown", (e) => {
    const typing = e.target.matches?.("select, input:not([type=checkbox])"), control = e.ctrlKey || e.metaKey;
    if (!model || e.altKey || typing) return;
    if (control) {
      if (!state.marking || !/^[zy]$/i.test(e.key)) return;
      changeMarks(e.key.toLowerCase() === "y" || e.shiftKey ? "redo" : "undo"); e.preventDefault(); return;
    }
    if (/^[1-9]$/.test(e.key)) { if (sets[e.key - 1]) toggle(sets[e.key - 1].key); } else if (keys[e.key]) { keys[e.key](); e.preventDefault(); }
  });

  $("field").onchange = (e) => { state.field = e.target.value; colour(); describe(); };
  $("scale").onchange = (e) => { state.scale = e.target.value; colour(); };
  $("t").oninput = (e) => setTime(+e.target.value);
  $("r").oninput = (e) => { setStep(+e.target.value); describe(); };
  $("judge").onchange = (e) => { state.judge = e.target.checked; fillLegend(); drawing.dirty(); };
  $("compare").onclick = () => setCompare(!state.compare);
  $("reset").onclick = () => drawing.reset(); $("save").onclick = savePicture; $("mark").onclick = () => setMarking(!state.marking);
  $("mesh-search").oninput = listMeshes; $("mesh-sort").onchange = listMeshes;
  $("undo").onclick = () => changeMarks("undo"); $("redo").onclick = () => changeMarks("redo"); $("save-marks").onclick = saveMarks;
  $("subject").oninput = (e) => {
    const before = state.subject; state.subject = e.target.value.trim();
    for (const m of models) m?.marks.rebaptise(before, state.subject);
    say("");
  };
  $("load").onclick = () => $("file").click();
  $("file").onchange = async (e) => { const [file] = e.target.files; if (file) addMarks(await file.text(), file.name); e.target.value = ""; };
  $("stage").addEventListener("dragover", (e) => e.preventDefault());
  $("stage").addEventListener("drop", async (e) => {
    e.preventDefault();
    const [file] = e.dataTransfer.files;
    if (file) { setMarking(true); addMarks(await file.text(), file.name); }
  });
  addEventListener("beforeunload", (e) => { if (models.some((m) => m && m.marks.list.length && !m.marks.saved)) e.preventDefault(); });
  addEventListener("resize", () => { if (model) fillBar($("bar"), state.ticks ?? []); });
}

function fail(text) { $("message").textContent = text; $("message").hidden = false; $("size").textContent = ""; }

start().then(() => {
  drawing.draw(); drawing.renderer.getContext().finish();
  // For tests, and for those who like the console.
  globalThis.viewer = { page, state, models, drawing, marksText, addMarks, picture, setTime, setStep, toggle, openMesh, numberOf: (v) => numberOf(model, v), sets: () => sets };
  document.documentElement.dataset.ready = performance.now();
}).catch((error) => { fail(error.message); document.documentElement.dataset.failed = error.message; });
