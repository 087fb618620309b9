/* ---- Files of marks: {subject, name, place: [x, y, z] as text}. ---- */

const FORMATS = {
  csv: (marks) => "subject,x,y,z,name\n" + marks.map((m) => [m.subject, ...m.place, m.name].map(quoted).join(",") + "\n").join(""),
  pp: (marks, mesh) => {
    const user = [...new Set(marks.map((m) => m.subject))].join(", ");
    const points = marks.map((m) => ` <point x="${m.place[0]}" y="${m.place[1]}" z="${m.place[2]}" active="1" name="${escaped(m.name)}"/>\n`);
    return `<!DOCTYPE PickedPoints>\n<PickedPoints>\n <DocumentData>\n  <User name="${escaped(user)}"/>\n  <DataFileName name="${escaped(mesh)}"/>\n` +
      `  <templateName name=""/>\n </DocumentData>\n${points.join("")}</PickedPoints>\n`;
  },
  "mrk.json": (marks) => {
    const markups = [...new Set(marks.map((m) => m.subject))].map((subject) => ({
      type: "Fiducial", name: subject, coordinateSystem: "LPS",
      controlPoints: marks.filter((m) => m.subject === subject).map((m, i) => (
        { id: String(i + 1), label: m.name, position: m.place.map(Number), positionStatus: "defined" })),
    }));
    const schema = "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/";
    return JSON.stringify({ "@schema": `${schema}markups-schema-v1.0.3.json#`, markups }, null, 1) + "\n";
  },
};

const quoted = (text) => (/[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
const escaped = (text) => text.replace(/[&<>"\n\r\t]/g, (c) => `&#${c.charCodeAt(0)};`);

/** Marks in a file of any of the three formats, told apart by what they hold. */
function readMarks(text) {
  const start = text.trimStart()[0];
  const marks = start === "<" ? readPickedPoints(text) : start === "{" ? readMarkups(text) : readTable(text);
  for (const { place } of marks) {
    if (place.length !== 3 || !place.every((x) => x !== "" && Number.isFinite(Number(x)))) throw new Error("a coordinate is missing or no number");
  }
  return marks;
}

function readPickedPoints(text) {
  const tree = new DOMParser().parseFromString(text, "text/xml");
  if (tree.documentElement.tagName !== "PickedPoints") throw new Error("this is no file of MeshLab's picked points");
  const subject = tree.querySelector("User")?.getAttribute("name") ?? "";
  return [...tree.querySelectorAll("point")].filter((p) => p.getAttribute("active") !== "0").map((p) => (
    { subject, name: p.getAttribute("name") ?? "", place: ["x", "y", "z"].map((a) => p.getAttribute(a) ?? "") }));
}

function readMarkups(text) {
  const lists = JSON.parse(text).markups;
  if (!Array.isArray(lists)) throw new Error("this is no file of 3D Slicer's markups");
  return lists.flatMap((list) => {
    const turn = list.coordinateSystem === "RAS" ? -1 : 1; // Slicer takes a mesh's coordinates for LPS
    return (list.controlPoints ?? []).filter((p) => (p.positionStatus ?? "defined") === "defined").map((p) => (
      { subject: list.name ?? "", name: p.label ?? "", place: p.position.map((x, axis) => String(axis < 2 ? turn * x : x)) }));
  });
}

function readTable(text) {
  const rows = [[]]; let cell = "", inside = false;
  for (let i = 0; i < text.length; i++) {
    const c = text[i];
    if (inside) { if (c !== '"') cell += c; else if (text[i + 1] === '"') { cell += c; i++; } else inside = false; }
    else if (c === '"') inside = true;
    else if (c === ",") { rows.at(-1).push(cell); cell = ""; }
    else if (c === "\n") { rows.at(-1).push(cell); cell = ""; rows.push([]); }
    else if (c !== "\r" && c !== "\ufeff") cell += c;
  }
  rows.at(-1).push(cell);
  const [head, ...body] = rows.filter((row) => row.length > 1), column = (name) => head ? head.indexOf(name) : -1;
  for (const name of ["subject", "x", "y", "z"]) if (column(name) < 0) throw new Error(`the column ${name} is missing`);
  return body.map((row) => ({ subject: row[column("subject")], name: row[column("name")] ?? "", place: ["x", "y", "z"].map((a) => (row[column(a)] ?? "").trim()) }));
}
