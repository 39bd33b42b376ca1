// @ts-check
/**
 * Reads the binary glTF of a result: faces, edges and nodes with their attributes. Pure.
 *
 * It reads what such a file needs and no more: one buffer in the file itself, triangles, lines and
 * points, nodes with a translation, a scale or a matrix.
 */

/**
 * @typedef {Record<string, unknown>} Json
 * @typedef {{
 *   mesh: string, mode: number, extras: Json, count: number,
 *   attributes: Record<string, Float32Array>, indices: Uint32Array,
 * }} Primitive positions are in millimetres
 * @typedef {{primitives: Primitive[], extras: Json}} Glb
 */

/** Millimetres of glTF's unit, the metre. */
const MM = 1000;

const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
const BINARY_CHUNK = 0x004e4942;

/** Components of an accessor's type. */
const COMPONENTS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };

/** How numbers of a component type are read, and their bytes. */
const READERS = {
  5120: [1, 'getInt8', 127], 5121: [1, 'getUint8', 255], 5122: [2, 'getInt16', 32767],
  5123: [2, 'getUint16', 65535], 5125: [4, 'getUint32', 4294967295], 5126: [4, 'getFloat32', 1],
};

/**
 * @param {ArrayBuffer} buffer @returns {Glb}
 * @throws {Error} with what is wrong with the file
 */
export function readGlb(buffer) {
  const { document, binary } = chunks(buffer);
  /** @type {Primitive[]} */
  const primitives = [];
  const extras = document.asset?.extras ?? {};
  for (const { node, matrix } of placed(document)) {
    if (node.mesh === undefined) continue;
    const mesh = document.meshes?.[node.mesh];
    if (!mesh) throw new Error(`there is no mesh ${node.mesh}`);
    for (const primitive of mesh.primitives ?? []) {
      /** @type {Record<string, Float32Array>} */
      const attributes = {};
      for (const [name, at] of Object.entries(primitive.attributes ?? {})) {
        attributes[name] = Float32Array.from(accessor(document, binary, /** @type {number} */ (at)));
      }
      const position = attributes.POSITION;
      if (!position) continue;
      move(position, matrix, MM);
      const count = position.length / 3;
      const indices = primitive.indices === undefined
        ? Uint32Array.from({ length: count }, (_, k) => k)
        : Uint32Array.from(accessor(document, binary, primitive.indices));
      if (indices.some((index) => index >= count)) throw new Error('an index leads past the vertices');
      primitives.push({
        mesh: String(mesh.name ?? node.name ?? ''), mode: primitive.mode ?? 4,
        extras: { ...mesh.extras, ...primitive.extras }, count, attributes, indices,
      });
    }
  }
  return { primitives, extras };
}

/** @param {ArrayBuffer} buffer */
function chunks(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < 20 || view.getUint32(0, true) !== MAGIC) throw new Error('this is no binary glTF');
  if (view.getUint32(4, true) !== 2) throw new Error(`glTF of version ${view.getUint32(4, true)}, not 2`);
  const end = Math.min(buffer.byteLength, view.getUint32(8, true));
  if (end < view.getUint32(8, true)) throw new Error('the file ends too early');
  /** @type {any} */
  let document = null;
  let binary = new DataView(new ArrayBuffer(0));
  for (let at = 12; at + 8 <= end;) {
    const length = view.getUint32(at, true);
    const kind = view.getUint32(at + 4, true);
    if (at + 8 + length > end) throw new Error('a chunk ends behind the file');
    if (kind === JSON_CHUNK) document = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, at + 8, length)));
    if (kind === BINARY_CHUNK) binary = new DataView(buffer, at + 8, length);
    at += 8 + length + ((4 - (length % 4)) % 4);
  }
  if (!document) throw new Error('the file has no description');
  return { document, binary };
}

/** Every node with its place, as a matrix by columns. @param {any} document */
function placed(document) {
  /** @type {{node: any, matrix: number[]}[]} */
  const found = [];
  const identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  /** @param {number} at @param {number[]} parent @param {number} depth */
  const visit = (at, parent, depth) => {
    const node = document.nodes?.[at];
    if (!node) throw new Error(`there is no node ${at}`);
    if (depth > 32 || found.length > 10000) throw new Error('the nodes are nested too deeply');
    const matrix = times(parent, local(node));
    found.push({ node, matrix });
    for (const child of node.children ?? []) visit(child, matrix, depth + 1);
  };
  const scene = document.scenes?.[document.scene ?? 0];
  for (const root of scene?.nodes ?? Object.keys(document.nodes ?? {}).map(Number)) visit(root, identity, 0);
  return found;
}

/** @param {any} node */
function local(node) {
  if (node.matrix) return node.matrix;
  const [sx, sy, sz] = node.scale ?? [1, 1, 1];
  const [tx, ty, tz] = node.translation ?? [0, 0, 0];
  const [x, y, z, w] = node.rotation ?? [0, 0, 0, 1];
  return [
    (1 - 2 * (y * y + z * z)) * sx, 2 * (x * y + z * w) * sx, 2 * (x * z - y * w) * sx, 0,
    2 * (x * y - z * w) * sy, (1 - 2 * (x * x + z * z)) * sy, 2 * (y * z + x * w) * sy, 0,
    2 * (x * z + y * w) * sz, 2 * (y * z - x * w) * sz, (1 - 2 * (x * x + y * y)) * sz, 0,
    tx, ty, tz, 1,
  ];
}

/** @param {number[]} a @param {number[]} b */
function times(a, b) {
  const product = new Array(16).fill(0);
  for (let c = 0; c < 4; c += 1) {
    for (let r = 0; r < 4; r += 1) {
      for (let k = 0; k < 4; k += 1) product[4 * c + r] += a[4 * k + r] * b[4 * c + k];
    }
  }
  return product;
}

/** @param {Float32Array} position @param {number[]} m @param {number} scale */
function move(position, m, scale) {
  for (let k = 0; k < position.length; k += 3) {
    const [x, y, z] = [position[k], position[k + 1], position[k + 2]];
    for (let r = 0; r < 3; r += 1) position[k + r] = (m[r] * x + m[4 + r] * y + m[8 + r] * z + m[12 + r]) * scale;
  }
}

/**
 * The numbers of an accessor, normalised ones as shares.
 * @param {any} document @param {DataView} binary @param {number} at
 */
function accessor(document, binary, at) {
  const told = document.accessors?.[at];
  if (!told) throw new Error(`there is no accessor ${at}`);
  const components = COMPONENTS[/** @type {keyof COMPONENTS} */ (told.type)];
  const reader = READERS[/** @type {keyof READERS} */ (told.componentType)];
  if (!components || !reader) throw new Error(`accessor ${at} is of a type that is not read`);
  const [size, method, most] = /** @type {[number, 'getFloat32', number]} */ (reader);
  const numbers = new Float64Array(told.count * components);
  if (told.bufferView === undefined) return numbers;
  const view = document.bufferViews?.[told.bufferView];
  if (!view || (view.buffer ?? 0) !== 0) throw new Error(`accessor ${at} has no bytes in the file`);
  const stride = view.byteStride ?? size * components;
  const start = (view.byteOffset ?? 0) + (told.byteOffset ?? 0);
  if (told.count > 0 && start + (told.count - 1) * stride + size * components > binary.byteLength) {
    throw new Error(`accessor ${at} ends behind the file`);
  }
  for (let k = 0; k < told.count; k += 1) {
    for (let c = 0; c < components; c += 1) {
      const value = binary[method](start + k * stride + c * size, true);
      numbers[k * components + c] = told.normalized ? value / most : value;
    }
  }
  return numbers;
}
