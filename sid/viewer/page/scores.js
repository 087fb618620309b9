/* ---- Scores at a step of the slider over r. ---- */

/**
 * FNE, FPE and IoU of a set of points, as sid.evaluation works them out. `right` and `found` hold, for each point and for each
 * ground-truth point, the first step of the slider at which it counts.
 */
function scoresAt(points, truth, step) {
  const upTo = (steps) => steps.reduce((count, s) => count + (s <= step), 0);
  const found = upTo(points.found), all = points.vertex.length, wanted = truth.vertex.length;
  if (!all) return { fne: 1, fpe: 0, iou: 0 };
  return { fne: 1 - found / wanted, fpe: 1 - upTo(points.right) / all, iou: found / (wanted + all - found) };
}
