/* ---- The drawing: one mesh and its glyphs, in one view or two. ----
   The group turns and the camera stands, so two views are linked by construction. */

const SURFACE_VERTEX = `
  attribute float shade; varying float s; varying vec3 n, p;
  void main() {
    s = shade; n = normalMatrix * normal;
    vec4 eye = modelViewMatrix * vec4(position, 1.0);
    p = eye.xyz; gl_Position = projectionMatrix * eye;
  }`;
const SURFACE_FRAGMENT = `
  uniform sampler2D ramp; varying float s; varying vec3 n, p;
  void main() {
    vec3 colour = texture2D(ramp, vec2((clamp(s, 0.0, 1.0) * 8.0 + 0.5) / 9.0, 0.5)).rgb;
    vec3 m = normalize(n);
    if (dot(m, p) > 0.0) m = -m;  // both sides of an open surface are lit
    float key = max(dot(m, normalize(vec3(-0.45, 0.7, 0.8))), 0.0), front = max(dot(m, normalize(-p)), 0.0);
    float sheen = pow(max(dot(m, normalize(vec3(-0.3, 0.5, 1.0))), 0.0), 40.0);
    gl_FragColor = vec4(colour * (0.38 + 0.40 * key + 0.30 * front) + 0.06 * sheen, 1.0);
  }`;

class Drawing {
  constructor(canvas, stage, T) {
    Object.assign(this, { canvas, stage, T, views: 1, width: 1, height: 1, distance: 4, offset: [0, 0], waiting: false, frames: 0, layers: [], model: null });
    T.ColorManagement.enabled = false; // the shaders write what the screen shows
    this.renderer = new T.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true, alpha: true });
    this.renderer.setScissorTest(true);
    this.scene = new T.Scene(); this.group = new T.Group(); this.camera = new T.PerspectiveCamera(30, 1, 0.01, 100);
    this.scene.add(this.group);
    const ramp = new Uint8Array(RAMP.flatMap((c) => [1, 3, 5].map((i) => parseInt(c.slice(i, i + 2), 16)).concat(255)));
    const map = new T.DataTexture(ramp, RAMP.length, 1);
    map.magFilter = map.minFilter = T.LinearFilter; map.needsUpdate = true;
    this.surface = new T.ShaderMaterial({ uniforms: { ramp: { value: map } }, side: T.DoubleSide, vertexShader: SURFACE_VERTEX, fragmentShader: SURFACE_FRAGMENT });
    this.chosen = this.cursor();
    this.ray = new T.Raycaster();
    this.calm = matchMedia("(prefers-reduced-motion: reduce)");
    this.beforeView = () => {}; this.afterDraw = () => {};
    new ResizeObserver(() => this.resize()).observe(stage);
  }

  /** Put a mesh in place of the one before. */
  show(model) {
    const { T } = this;
    this.clear();
    this.model = model;
    const geometry = new T.BufferGeometry();
    geometry.setAttribute("position", new T.BufferAttribute(model.local, 3));
    geometry.setIndex(new T.BufferAttribute(model.index, 1));
    geometry.computeVertexNormals(); geometry.computeBoundingSphere();
    this.shade = new Float32Array(model.n);
    geometry.setAttribute("shade", new T.BufferAttribute(this.shade, 1).setUsage(T.DynamicDrawUsage));
    this.mesh = new T.Mesh(geometry, this.surface);
    this.group.add(this.mesh, this.chosen);
    this.choose(-1);
  }

  clear() {
    for (const object of [this.mesh, ...this.layers]) if (object) { this.group.remove(object); object.geometry.dispose(); }
    this.layers = [];
  }

  recolour() { this.mesh.geometry.attributes.shade.needsUpdate = true; this.dirty(); }

  /** A layer of glyphs of one kind at vertices. */
  addGlyphs(kind, colour, vertices, size) {
    const { T } = this, n = vertices.length;
    const geometry = new T.BufferGeometry(), places = new Float32Array(3 * n);
    vertices.forEach((v, i) => places.set(this.model.local.subarray(3 * v, 3 * v + 3), 3 * i));
    geometry.setAttribute("position", new T.BufferAttribute(places, 3));
    geometry.setAttribute("first", new T.BufferAttribute(new Float32Array(n), 1));
    const uniforms = { colour: { value: new T.Color(colour) }, kind: { value: KINDS.indexOf(kind) }, size: { value: size }, step: { value: 0 }, judged: { value: 0 } };
    const layer = new T.Points(geometry, new T.ShaderMaterial({ uniforms, transparent: true, vertexShader: POINT_VERTEX, fragmentShader: POINT_FRAGMENT }));
    layer.userData = { uniforms, size, first: null };
    layer.frustumCulled = false;
    this.group.add(layer); this.layers.push(layer);
    return layer;
  }
  removeGlyphs(layer) {
    this.group.remove(layer); layer.geometry.dispose(); layer.material.dispose();
    this.layers = this.layers.filter((l) => l !== layer);
  }
  /** Which of a layer's glyphs are good at the step of r; null shows all alike. */
  judge(layer, first, step) {
    const { userData } = layer;
    userData.uniforms.judged.value = first ? 1 : 0; userData.uniforms.step.value = step + 0.5;
    userData.uniforms.size.value = userData.size * this.renderer.getPixelRatio();
    if (first && userData.first !== first) {
      layer.geometry.attributes.first.array.set(first); layer.geometry.attributes.first.needsUpdate = true; userData.first = first;
    }
  }

  cursor() {
    const { T } = this, geometry = new T.BufferGeometry();
    geometry.setAttribute("position", new T.BufferAttribute(new Float32Array(3), 3));
    const cursor = new T.Points(geometry, new T.ShaderMaterial({
      depthTest: false, transparent: true, uniforms: { size: { value: 34 } },
      vertexShader: "uniform float size; void main() { gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); gl_PointSize = size; }",
      fragmentShader: `void main() {
        vec2 p = abs(gl_PointCoord * 2.0 - 1.0); float thin = min(p.x, p.y), far = max(p.x, p.y);
        if (thin > 0.13 || far < 0.5) discard;
        gl_FragColor = vec4(thin > 0.06 ? vec3(1.0) : vec3(0.85, 0.0, 0.4), 1.0); }`,
    }));
    cursor.frustumCulled = false; cursor.renderOrder = 9;
    return cursor;
  }
  choose(vertex) {
    this.chosen.visible = vertex >= 0;
    if (vertex >= 0) {
      this.chosen.geometry.attributes.position.array.set(this.model.local.subarray(3 * vertex, 3 * vertex + 3));
      this.chosen.geometry.attributes.position.needsUpdate = true;
    }
    this.dirty();
  }

  // -- the views

  /** Place of a view in the canvas: side by side, or one above the other on a tall screen. */
  frame(side) {
    const { width, height, views } = this;
    if (views === 1) return { x: 0, y: 0, w: width, h: height };
    return height > width ? { x: 0, y: (side * height) / 2, w: width, h: height / 2 } : { x: (side * width) / 2, y: 0, w: width / 2, h: height };
  }
  aim({ w, h }) {
    const { camera } = this;
    camera.aspect = w / h; camera.position.set(this.offset[0], this.offset[1], this.distance);
    camera.near = Math.max(this.distance - 1.6, this.distance / 200); camera.far = this.distance + 2.5;
    camera.updateProjectionMatrix(); camera.updateMatrixWorld(); this.group.updateMatrixWorld(true);
  }
  draw() {
    this.waiting = false;
    if (!this.model) return;
    const pixels = this.renderer.getPixelRatio();
    this.chosen.material.uniforms.size.value = 34 * pixels;
    for (let side = 0; side < this.views; side++) {
      const f = this.frame(side), below = this.height - f.y - f.h;
      this.renderer.setViewport(f.x, below, f.w, f.h); this.renderer.setScissor(f.x, below, f.w, f.h);
      this.aim(f); this.beforeView(side);
      this.renderer.render(this.scene, this.camera);
    }
    this.frames++;
    this.afterDraw();
  }
  dirty() { if (!this.waiting) { this.waiting = true; requestAnimationFrame(() => this.draw()); } }
  resize() {
    const before = this.model ? this.fit() : 1;
    this.width = Math.max(1, this.stage.clientWidth); this.height = Math.max(1, this.stage.clientHeight);
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(this.width, this.height, false);
    if (this.model) this.distance *= this.fit() / before; // as much in sight in the new frame as in the old one
    this.dirty();
  }

  turn(x, y) { this.group.quaternion.premultiply(new this.T.Quaternion().setFromEuler(new this.T.Euler(y, x, 0))); this.dirty(); }
  zoom(factor) { this.distance = Math.min(40, Math.max(0.15, this.distance * factor)); this.dirty(); }
  shift(dx, dy) {
    const scale = (0.536 * this.distance) / this.frame(0).h; // the camera sees 30 degrees
    this.offset[0] -= dx * scale; this.offset[1] += dy * scale; this.dirty();
  }
  /** Upright, and as large as fits. */
  reset(smooth = true) {
    const { T, model } = this, axis = "xyz".indexOf(model.meta.up.at(-1)), up = new T.Vector3();
    up.setComponent(axis, model.meta.up[0] === "-" ? -1 : 1);
    const turned = new T.Quaternion().setFromUnitVectors(up, new T.Vector3(0, 1, 0));
    this.glide(turned, this.fit(turned), [0, 0], smooth);
  }
  fit(turned = this.group.quaternion) {
    const { w, h } = this.frame(0), k = Math.tan(Math.PI / 12), p = new this.T.Vector3();
    let distance = 0;
    for (let i = 0; i < this.model.n; i += 1 + (this.model.n >> 14)) {
      p.fromArray(this.model.local, 3 * i).applyQuaternion(turned);
      distance = Math.max(distance, p.z + Math.abs(p.y) / k, p.z + (Math.abs(p.x) * h) / w / k);
    }
    return distance * 1.1;
  }
  /** Turn a vertex to the front. */
  face(vertex) {
    const { T, model } = this, normal = new T.Vector3().fromArray(this.mesh.geometry.attributes.normal.array, 3 * vertex);
    normal.applyQuaternion(this.group.quaternion).normalize();
    const turned = new T.Quaternion().setFromUnitVectors(normal, new T.Vector3(0, 0.15, 1).normalize()).multiply(this.group.quaternion);
    const p = new T.Vector3().fromArray(model.local, 3 * vertex).applyQuaternion(turned);
    this.glide(turned, this.distance, this.distance < 3 ? [p.x, p.y] : this.offset);
  }
  /** Move there in a quarter of a second; at once for those who want no motion. */
  glide(quaternion, distance, offset, smooth = true) {
    const from = { q: this.group.quaternion.clone(), distance: this.distance, offset: [...this.offset] }, start = performance.now();
    const run = (this.run = (this.run ?? 0) + 1);
    const step = (now) => {
      if (run !== this.run) return;
      const u = smooth && !this.calm.matches ? Math.min(1, Math.max(0, (now - start) / 250)) : 1, e = u * u * (3 - 2 * u);
      this.group.quaternion.slerpQuaternions(from.q, quaternion, e);
      this.distance = from.distance + (distance - from.distance) * e;
      this.offset = from.offset.map((x, i) => x + (offset[i] - x) * e);
      if (u < 1) { this.draw(); requestAnimationFrame(step); } else this.dirty();
    };
    step(start);
  }

  // -- picking

  /** Where a vertex is on the canvas, in a view. */
  project(vertex, side = 0) {
    const f = this.frame(side), p = new this.T.Vector3().fromArray(this.model.local, 3 * vertex);
    this.aim(f); p.applyMatrix4(this.group.matrixWorld).project(this.camera);
    return [f.x + ((p.x + 1) / 2) * f.w, f.y + ((1 - p.y) / 2) * f.h];
  }
  /** Whether a vertex looks at the camera: quick, and nearly whether it is in sight. */
  facing(vertex) {
    const { T } = this, p = new T.Vector3().fromArray(this.model.local, 3 * vertex).applyMatrix4(this.group.matrixWorld);
    const normal = new T.Vector3().fromArray(this.mesh.geometry.attributes.normal.array, 3 * vertex).applyQuaternion(this.group.quaternion);
    return normal.dot(p.sub(this.camera.position).normalize()) < 0.35; // at a tip the normal may look a little away
  }
  sideAt(x, y) { const f = this.frame(1); return this.views > 1 && x >= f.x && y >= f.y ? 1 : 0; }
  hit(x, y) { this.ray.setFromCamera(new this.T.Vector2(x, y), this.camera); return this.ray.intersectObject(this.mesh, false)[0]; }

  /** The vertex at a place of the canvas: of a glyph within reach if one is in sight, else the nearest of the face there. */
  pick(px, py, glyphs, reach) {
    const side = this.sideAt(px, py), f = this.frame(side), p = new this.T.Vector3();
    this.aim(f);
    let best = -1, least = reach;
    for (const vertex of glyphs(side)) {
      p.fromArray(this.model.local, 3 * vertex).applyMatrix4(this.group.matrixWorld);
      const away = this.camera.position.distanceTo(p);
      p.project(this.camera);
      const d = Math.hypot(f.x + ((p.x + 1) / 2) * f.w - px, f.y + ((1 - p.y) / 2) * f.h - py);
      if (d >= least) continue;
      const front = this.hit(p.x, p.y);
      if (!front || front.distance > away - 0.03) { least = d; best = vertex; }
    }
    if (best >= 0) return best;
    const at = (x, y) => this.hit(((x - f.x) / f.w) * 2 - 1, 1 - ((y - f.y) / f.h) * 2);
    let front = at(px, py);
    for (let away = 3; !front && away <= reach; away += 3) { // a tip is easily missed by a few pixels
      for (let k = 0; k < 8 && !front; k++) front = at(px + away * Math.cos((k * Math.PI) / 4), py + away * Math.sin((k * Math.PI) / 4));
    }
    if (!front) return -1;
    this.group.worldToLocal(p.copy(front.point)); least = Infinity;
    for (const vertex of [front.face.a, front.face.b, front.face.c]) {
      const d = p.distanceToSquared(new this.T.Vector3().fromArray(this.model.local, 3 * vertex));
      if (d < least) { least = d; best = vertex; }
    }
    return best;
  }
}
