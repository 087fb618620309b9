/* ---- Pieces of the panel. Text reaches the page as text alone, never as HTML. ---- */

const $ = (id) => document.getElementById(id);
function element(tag, properties = {}, ...children) {
  const node = Object.assign(document.createElement(tag), properties);
  for (const [key, value] of Object.entries(properties.data ?? {})) node.dataset[key] = value;
  node.append(...children);
  return node;
}
const labelled = (node, text) => { node.setAttribute("aria-label", text); return node; };

function fillBar(bar, ticks) {
  const width = bar.clientWidth || 298, inside = (s) => 2 + s * (width - 4);
  bar.setAttribute("viewBox", `0 0 ${width} 36`);
  const stops = RAMP.map((c, i) => svg("stop", { offset: i / (RAMP.length - 1), "stop-color": c }));
  bar.replaceChildren(svg("linearGradient", { id: "ramp" }, ...stops),
    svg("rect", { x: 2, y: 2, width: width - 4, height: 13, rx: 2, fill: "url(#ramp)", stroke: "currentColor", "stroke-opacity": 0.3 }),
    ...ticks.flatMap(([s, text]) => {
      const anchor = s < 0.03 ? "start" : s > 0.97 ? "end" : "middle";
      return [svg("path", { d: `M${inside(s)} 15v5`, stroke: "currentColor" }), svg("text", { x: inside(s), y: 32, "text-anchor": anchor }, text)];
    }));
}

/** A curve over t at a vertex, with the time that is shown. */
function curve(field, times, vertex, t) {
  const W = 298, H = 96, left = 44, right = 8, top = 20, bottom = 16;
  const values = field.rows.map((_, k) => valueAt(field, k, vertex)), logarithmic = values.every((v) => v > 0);
  const ys = logarithmic ? values.map(Math.log) : values, xs = times.map(Math.log), low = Math.min(...ys), high = Math.max(...ys);
  const x = (u) => left + ((u - xs[0]) / (xs.at(-1) - xs[0] || 1)) * (W - left - right);
  const y = (v) => top + (1 - (v - low) / (high - low || 1)) * (H - top - bottom);
  const row = Math.floor(t), now = xs[row] + (t - row) * ((xs[row + 1] ?? xs[row]) - xs[row]);
  const label = (text, at) => svg("text", at, text);
  return svg("svg", { viewBox: `0 0 ${W} ${H}`, role: "img", "aria-label": `${field.name} over t, from ${short(values[0])} to ${short(values.at(-1))}` },
    label(`${field.name} over t`, { x: left, y: 12, "font-weight": 600 }),
    svg("path", { d: `M${left} ${top}V${H - bottom}H${W - right}`, fill: "none", stroke: "currentColor", opacity: 0.4 }),
    svg("path", { d: `M${x(now)} ${top}V${H - bottom}`, stroke: "var(--accent)", "stroke-dasharray": "3 3" }),
    svg("polyline", { points: ys.map((v, k) => `${x(xs[k])},${y(v)}`).join(" "), fill: "none", stroke: "currentColor", "stroke-width": 1.8 }),
    label(short(Math.max(...values)), { x: left - 5, y: top + 8, "text-anchor": "end" }),
    label(short(Math.min(...values)), { x: left - 5, y: H - bottom, "text-anchor": "end" }),
    label(short(times[0]), { x: left, y: H - 3 }), label(short(times.at(-1)), { x: W - right, y: H - 3, "text-anchor": "end" }));
}
