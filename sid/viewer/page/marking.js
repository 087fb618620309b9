/* ---- Marks of a person on a mesh, with undo. ---- */

class Marks {
  constructor() { Object.assign(this, { list: [], past: [], future: [], chosen: -1, saved: true }); }

  /** Every change makes a new list, so that the lists before and after it can be kept as they are. */
  change(list, chosen = -1) {
    this.past.push(this.list); this.future = [];
    this.list = list; this.chosen = Math.min(chosen, list.length - 1); this.saved = false;
  }
  add(mark) { this.change([...this.list, mark], this.list.length); }
  remove(i) { this.change(this.list.filter((_, k) => k !== i)); }
  rename(i, name) { if (this.list[i].name !== name) this.change(this.list.map((m, k) => (k === i ? { ...m, name } : m)), i); }
  /** Marks that bear the old name, or none, are this person's. */
  rebaptise(before, subject) { this.list = this.list.map((m) => (m.subject === before || !m.subject ? { ...m, subject } : m)); this.saved = false; }
  step(from, to) { if (from.length) { to.push(this.list); this.list = from.pop(); this.chosen = -1; this.saved = false; } }
  undo() { this.step(this.past, this.future); }
  redo() { this.step(this.future, this.past); }
  at(vertex) { return this.list.findIndex((m) => m.vertex === vertex); }
}

/** Give text to the user as a file. */
function download(content, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content); link.download = name.replace(/[\\/:*?"<>|\u0000-\u001f]/g, "_");
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
