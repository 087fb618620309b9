/* ---- Glyphs of points. They differ by shape and by colour (Okabe, Ito), each with a black rim. ---- */

const COLOURS = ["#E69F00", "#009E73", "#CC79A7", "#F0E442", "#D55E00", "#56B4E9", "#0072B2", "#999999"];
const KINDS = ["disc", "square", "triangle", "diamond", "ring", "dot", "pin"];
const circle = (r) => `M${r} 0A${r} ${r} 0 1 1 ${-r} 0A${r} ${r} 0 1 1 ${r} 0Z`;
const OUTLINES = { // in a square from -1 to 1; the shader below draws the same
  disc: circle(0.72), square: "M-.62-.62H.62V.62H-.62Z", triangle: "M0-1 .9.55H-.9Z", diamond: "M0-.87.87 0 0 .87-.87 0Z",
  ring: circle(0.72), dot: circle(0.5), pin: "M0 .9-.6-.1A.62.62 0 1 1 .6-.1Z",
};
const CROSS = "M-.4-.4.4.4M.4-.4-.4.4";

/** A glyph as [outline, fill, stroke, stroke width] steps, for SVG and for the saved picture alike. */
function glyphSteps(kind, colour, good = true) {
  if (kind === "ring") {
    const steps = [[OUTLINES.ring, "none", "#000", 0.6], [OUTLINES.ring, "none", colour, good ? 0.34 : 0.2]];
    return good ? steps : [...steps, [circle(0.2), colour, "#000", 0.16]];
  }
  if (good) return [[OUTLINES[kind], colour, "#000", 0.18]];
  return [[OUTLINES[kind], "#fff", "#000", 0.42], [OUTLINES[kind], "none", colour, 0.24], [CROSS, "none", "#000", 0.22]];
}

const SVG = "http://www.w3.org/2000/svg";
function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}
function glyphSvg(kind, colour, good = true) {
  return svg("svg", { class: "glyph", viewBox: "-1.1 -1.1 2.2 2.2", "aria-hidden": "true" },
    ...glyphSteps(kind, colour, good).map(([d, fill, stroke, width]) => svg("path", { d, fill, stroke, "stroke-width": width })));
}

// Points keep their size on the screen. A point that is false shows as an open, crossed glyph; ground truth that is missed as
// a thin ring with a dot in it.
const POINT_VERTEX = `
  uniform float size; attribute float first; varying float from;
  void main() {
    from = first;
    vec4 eye = modelViewMatrix * vec4(position, 1.0);
    gl_Position = projectionMatrix * eye;
    gl_Position.z -= 0.012 * gl_Position.w / -eye.z;  // before the surface on which it lies
    gl_PointSize = size;
  }`;
const POINT_FRAGMENT = `
  uniform vec3 colour; uniform float kind, step, judged, size; varying float from;
  float outline(vec2 p) {
    if (kind < 0.5 || kind > 3.5) return length(p) - 0.72;
    if (kind < 1.5) return max(abs(p.x), abs(p.y)) - 0.62;
    if (kind < 2.5) return max(abs(p.x) * 0.865 + p.y * 0.5, -p.y - 0.05) - 0.5;
    return abs(p.x) + abs(p.y) - 0.87;
  }
  void main() {
    vec2 p = gl_PointCoord * 2.0 - 1.0; p.y = -p.y;
    float pixel = 2.0 / size, d = outline(p);
    bool good = judged < 0.5 || from <= step;
    vec3 c = colour;
    if (kind > 5.5) d = min(length(p - vec2(0.0, 0.3)) - 0.55, max(abs(p.x) * 0.86 - (p.y + 0.9) * 0.5, p.y - 0.1));
    else if (kind > 4.5) d = length(p) - 0.5;
    if (kind > 3.5 && kind < 4.5) {
      d = abs(length(p) - 0.72) - (good ? 0.16 : 0.09);
      if (!good) d = min(d, length(p) - 0.2);
    } else if (!good) {
      float cross = max(min(abs(p.x - p.y), abs(p.x + p.y)) - 0.14, max(abs(p.x), abs(p.y)) - 0.42);
      if (cross < 0.0) c = vec3(0.0); else if (d < -0.2) c = vec3(1.0);
    }
    if (d > 1.6 * pixel) discard;
    if (d > 0.0) c = vec3(0.0);
    gl_FragColor = vec4(c, 1.0);
  }`;
