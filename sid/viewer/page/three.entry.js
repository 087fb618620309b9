// What the viewer takes of three.js. `npm ci && npm run build` in this folder makes three.min.js of it.
export {
  BufferAttribute, BufferGeometry, Color, ColorManagement, DataTexture, DoubleSide, DynamicDrawUsage, Euler, Group,
  LinearFilter, Mesh, PerspectiveCamera, Points, Quaternion, Raycaster, Scene, ShaderMaterial, Vector2, Vector3,
  WebGLRenderer,
} from "three";
