// @ts-check
/** A camera that turns around a point, the matrices that it draws by, and what a ray meets. Pure. */

/** @typedef {[number, number, number]} Vector */

/** Views to start from: turn about y, and tilt, degrees. */
export const STANDARD_VIEWS = { front: [0, 0], left: [-90, 0], right: [90, 0], top: [0, 89], oblique: [-32, 24] };

export class Orbit {
  constructor() {
    this.turnDeg = -32;
    this.tiltDeg = 24;
    /** @type {Vector} */
    this.centre = [0, 0, 0];
    this.radius = 1;
    this.distance = 4;
    this.fieldDeg = 28;
  }

  /**
   * Looks at vertices from where it stands, so that all of them are seen and fill the picture.
   * @param {Float32Array[]} positions @param {number} aspect width over height
   */
  fit(positions, aspect) {
    const { low, high } = box(positions);
    this.centre = /** @type {Vector} */ ([0, 1, 2].map((k) => (low[k] + high[k]) / 2));
    this.radius = Math.max(Math.hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]) / 2, 1e-6);
    // In the middle of what is seen, which is not the middle of the box.
    const { x, y, z } = this.axes;
    const seen = box(positions, (from) => [dot(from, x), dot(from, y), dot(from, z)]);
    const [right, up] = [0, 1].map((k) => (seen.low[k] + seen.high[k]) / 2);
    const depth = dot(this.centre, z);
    for (let k = 0; k < 3; k += 1) this.centre[k] = x[k] * right + y[k] * up + z[k] * depth;
    const [fx, fy] = this.focal(aspect);
    this.distance = this.radius * 1e-3;
    box(positions, (from) => {
      const beside = Math.max(Math.abs(dot(from, x) - right) * fx, Math.abs(dot(from, y) - up) * fy);
      this.distance = Math.max(this.distance, dot(from, z) - depth + beside / 0.92);
      return from;
    });
  }

  /** @param {number} turnDeg @param {number} tiltDeg */
  turn(turnDeg, tiltDeg) {
    this.turnDeg = ((this.turnDeg + turnDeg + 540) % 360) - 180;
    this.tiltDeg = Math.min(89, Math.max(-89, this.tiltDeg + tiltDeg));
  }

  /** @param {number} factor below 1 comes nearer */
  zoom(factor) {
    this.distance = Math.min(this.radius * 40, Math.max(this.radius * 0.05, this.distance * factor));
  }

  /** Shifts what is looked at, in shares of the picture's height. @param {number} right @param {number} up */
  pan(right, up) {
    const { x, y } = this.axes;
    const size = 2 * this.distance * Math.tan((this.fieldDeg * Math.PI) / 360);
    for (let k = 0; k < 3; k += 1) this.centre[k] += (x[k] * right + y[k] * up) * size;
  }

  /** Unit vectors to the right, upwards and towards the camera. */
  get axes() {
    const [t, e] = [(this.turnDeg * Math.PI) / 180, (this.tiltDeg * Math.PI) / 180];
    /** @type {Vector} */ const z = [Math.sin(t) * Math.cos(e), Math.sin(e), Math.cos(t) * Math.cos(e)];
    /** @type {Vector} */ const x = [Math.cos(t), 0, -Math.sin(t)];
    return { x, y: cross(z, x), z };
  }

  /** Where the camera is. @returns {Vector} */
  get eye() {
    const { z } = this.axes;
    return /** @type {Vector} */ ([0, 1, 2].map((k) => this.centre[k] + z[k] * this.distance));
  }

  /** From the part frame to the canvas's frame, by columns. @param {number} aspect width over height */
  matrix(aspect) {
    const { x, y, z } = this.axes;
    const eye = this.eye;
    const view = [
      x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0,
      -dot(x, eye), -dot(y, eye), -dot(z, eye), 1,
    ];
    const near = Math.max(this.distance - this.radius * 3, this.distance * 0.01);
    const far = this.distance + this.radius * 3;
    const [fx, fy] = this.focal(aspect);
    const projection = [
      fx, 0, 0, 0, 0, fy, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0,
    ];
    return multiply(projection, view);
  }

  /** Focal lengths; in narrow pictures the width decides. @param {number} aspect */
  focal(aspect) {
    const f = 1 / Math.tan((this.fieldDeg * Math.PI) / 360);
    return aspect >= 1 ? [f / aspect, f] : [f, f * aspect];
  }

  /**
   * The ray through a place of the picture.
   * @param {number} u -1 left to 1 right @param {number} v -1 below to 1 above @param {number} aspect
   * @returns {{from: Vector, to: Vector}}
   */
  ray(u, v, aspect) {
    const { x, y, z } = this.axes;
    const [fx, fy] = this.focal(aspect);
    const to = [0, 1, 2].map((k) => (x[k] * u) / fx + (y[k] * v) / fy - z[k]);
    return { from: this.eye, to: /** @type {Vector} */ (to) };
  }
}

/** @param {ArrayLike<number>} a @param {ArrayLike<number>} b */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** @param {ArrayLike<number>} a @param {ArrayLike<number>} b @returns {Vector} */
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** @param {number[]} a @param {number[]} b */
function multiply(a, b) {
  const product = new Float32Array(16);
  for (let c = 0; c < 4; c += 1) {
    for (let r = 0; r < 4; r += 1) {
      let sum = 0;
      for (let k = 0; k < 4; k += 1) sum += a[4 * k + r] * b[4 * c + k];
      product[4 * c + r] = sum;
    }
  }
  return product;
}

/**
 * How far along a ray it meets the nearest of some triangles; Infinity if none.
 * @param {{from: Vector, to: Vector}} ray @param {Float32Array} position @param {Uint32Array} indices
 */
export function meets(ray, position, indices) {
  let nearest = Infinity;
  const [ox, oy, oz] = ray.from;
  const [dx, dy, dz] = ray.to;
  for (let k = 0; k + 2 < indices.length; k += 3) {
    const a = 3 * indices[k];
    const b = 3 * indices[k + 1];
    const c = 3 * indices[k + 2];
    const e1x = position[b] - position[a], e1y = position[b + 1] - position[a + 1], e1z = position[b + 2] - position[a + 2];
    const e2x = position[c] - position[a], e2y = position[c + 1] - position[a + 1], e2z = position[c + 2] - position[a + 2];
    const px = dy * e2z - dz * e2y, py = dz * e2x - dx * e2z, pz = dx * e2y - dy * e2x;
    const determinant = e1x * px + e1y * py + e1z * pz;
    if (Math.abs(determinant) < 1e-12) continue;
    const tx = ox - position[a], ty = oy - position[a + 1], tz = oz - position[a + 2];
    const u = (tx * px + ty * py + tz * pz) / determinant;
    if (u < 0 || u > 1) continue;
    const qx = ty * e1z - tz * e1y, qy = tz * e1x - tx * e1z, qz = tx * e1y - ty * e1x;
    const v = (dx * qx + dy * qy + dz * qz) / determinant;
    if (v < 0 || u + v > 1) continue;
    const t = (e2x * qx + e2y * qy + e2z * qz) / determinant;
    if (t > 1e-9 && t < nearest) nearest = t;
  }
  return nearest;
}

/**
 * The box around vertices, each of which may be seen in another frame.
 * @param {Float32Array[]} positions @param {(from: Vector) => Vector} [seen]
 * @returns {{low: Vector, high: Vector}}
 */
export function box(positions, seen = (from) => from) {
  /** @type {Vector} */ const low = [Infinity, Infinity, Infinity];
  /** @type {Vector} */ const high = [-Infinity, -Infinity, -Infinity];
  for (const position of positions) {
    for (let k = 0; k + 2 < position.length; k += 3) {
      const at = seen([position[k], position[k + 1], position[k + 2]]);
      for (let r = 0; r < 3; r += 1) {
        low[r] = Math.min(low[r], at[r]);
        high[r] = Math.max(high[r], at[r]);
      }
    }
  }
  return high[0] >= low[0] ? { low, high } : { low: [-1, -1, -1], high: [1, 1, 1] };
}
