// @ts-check
/**
 * The range image as it comes in: columns of nodes on a lattice. Pure.
 *
 * Node (i, j) lies at x = i * pitch, y = j * pitch. With a step n only every n-th node of every
 * n-th column is kept; indices stay those of the fine lattice.
 */

/** What stands where there is no node. */
export const NONE = -2147483648;

/** Nodes kept at most; beyond that every second one goes. */
const MOST_NODES = 4_000_000;

/** Never negative. @param {number} a @param {number} b */
const remainder = (a, b) => ((a % b) + b) % b;

/** @typedef {{i: number, j_first: number, z_um: (number | null)[]}} LiveColumn */

export class Lattice {
  /** @param {number} pitchMm @param {number} [step] @param {number} [mostNodes] */
  constructor(pitchMm, step = 1, mostNodes = MOST_NODES) {
    this.pitchMm = pitchMm;
    this.step = step;
    this.mostNodes = mostNodes;
    /** What remains of the fine indices of kept nodes when divided by the step. */
    this.iRest = 0;
    this.jRest = 0;
    /** Indices of the kept lattice: (fine index - rest) / step. */
    this.i0 = 0;
    this.j0 = 0;
    this.columns = 0;
    this.rows = 0;
    this.z = new Int32Array(0);
    this.nodes = 0;
    /** Counts changes, so that whoever has drawn it knows whether it is the same still. */
    this.version = 0;
    this.leastUm = Infinity;
    this.mostUm = -Infinity;
  }

  /**
   * A lattice of what the service tells of an image.
   * @param {{pitch_mm: number, step?: number, columns: LiveColumn[]}} image
   */
  static of(image) {
    const lattice = new Lattice(image.pitch_mm, image.step || 1);
    const first = image.columns.find((column) => column.z_um.length > 0);
    if (first) {
      lattice.iRest = remainder(first.i, lattice.step);
      lattice.jRest = remainder(first.j_first, lattice.step);
    }
    for (const column of image.columns) lattice.put(column, lattice.step);
    return lattice;
  }

  /** Distance of the kept nodes, millimetres. */
  get spacingMm() {
    return this.pitchMm * this.step;
  }

  get empty() {
    return this.nodes === 0;
  }

  /**
   * Puts a column in; one that is there already is replaced.
   * @param {LiveColumn} column @param {number} [every] fine nodes from one value to the next
   */
  put(column, every = 1) {
    if (column.z_um.length === 0 || remainder(column.i - this.iRest, this.step) !== 0) return;
    const i = (column.i - this.iRest) / this.step;
    this.version += 1;
    const stride = Math.max(1, Math.round(this.step / every));
    // The first of its nodes that the kept lattice has.
    let skip = 0;
    while (stride > 1 && skip < stride && remainder(column.j_first + skip * every - this.jRest, this.step) !== 0) skip += 1;
    const count = Math.ceil((column.z_um.length - skip) / stride);
    if (count <= 0) return;
    const j = Math.round((column.j_first + skip * every - this.jRest) / this.step);
    this.reserve(i, j, count);
    const at = (i - this.i0) * this.rows - this.j0;
    for (let k = 0; k < count; k += 1) {
      const z = column.z_um[skip + k * stride];
      const before = this.z[at + j + k];
      if (before !== NONE) this.nodes -= 1;
      if (z === null || z === undefined) {
        this.z[at + j + k] = NONE;
      } else {
        this.z[at + j + k] = z;
        this.nodes += 1;
        if (z < this.leastUm) this.leastUm = z;
        if (z > this.mostUm) this.mostUm = z;
      }
    }
    while (this.columns * this.rows > this.mostNodes) this.coarsen();
  }

  /** Makes room for nodes j to j + count of column i. @param {number} i @param {number} j @param {number} count */
  reserve(i, j, count) {
    if (this.columns === 0) {
      this.i0 = i;
      this.j0 = j;
    }
    const i0 = Math.min(this.i0, i);
    const j0 = Math.min(this.j0, j);
    const columns = Math.max(this.i0 + this.columns, i + 1) - i0;
    const rows = Math.max(this.j0 + this.rows, j + count) - j0;
    if (i0 === this.i0 && j0 === this.j0 && rows === this.rows) {
      const needed = columns * rows;
      if (needed > this.z.length) {
        const grown = new Int32Array(Math.max(needed, 2 * this.z.length)).fill(NONE);
        grown.set(this.z);
        this.z = grown;
      }
      this.columns = columns;
      return;
    }
    const moved = new Int32Array(columns * rows).fill(NONE);
    for (let c = 0; c < this.columns; c += 1) {
      const from = c * this.rows;
      moved.set(this.z.subarray(from, from + this.rows), (this.i0 + c - i0) * rows + this.j0 - j0);
    }
    Object.assign(this, { i0, j0, columns, rows, z: moved });
  }

  /** Keeps every second node of every second column. */
  coarsen() {
    const finer = { i0: this.i0, j0: this.j0, columns: this.columns, rows: this.rows, z: this.z };
    this.step *= 2;
    const i0 = Math.ceil(finer.i0 / 2);
    const j0 = Math.ceil(finer.j0 / 2);
    const columns = Math.floor((finer.i0 + finer.columns - 1) / 2) - i0 + 1;
    const rows = Math.floor((finer.j0 + finer.rows - 1) / 2) - j0 + 1;
    const z = new Int32Array(Math.max(0, columns * rows)).fill(NONE);
    let nodes = 0;
    for (let c = 0; c < columns; c += 1) {
      const from = (2 * (i0 + c) - finer.i0) * finer.rows;
      for (let r = 0; r < rows; r += 1) {
        const value = finer.z[from + 2 * (j0 + r) - finer.j0];
        z[c * rows + r] = value;
        if (value !== NONE) nodes += 1;
      }
    }
    Object.assign(this, { i0, j0, columns, rows, z, nodes });
  }

  /** x of a kept column, millimetres. @param {number} i */
  xMm(i) {
    return (this.iRest + i * this.step) * this.pitchMm;
  }

  /** y of a kept row, millimetres. @param {number} j */
  yMm(j) {
    return (this.jRest + j * this.step) * this.pitchMm;
  }

  /** z in micrometres at indices of the kept lattice, or NONE. @param {number} i @param {number} j */
  at(i, j) {
    const c = i - this.i0;
    const r = j - this.j0;
    if (c < 0 || r < 0 || c >= this.columns || r >= this.rows) return NONE;
    return this.z[c * this.rows + r];
  }

  /**
   * The node nearest to a place, millimetres; z is null where nothing is.
   * @param {number} xMm @param {number} yMm
   * @returns {{i: number, j: number, xMm: number, yMm: number, zMm: number | null}}
   */
  nearest(xMm, yMm) {
    const i = Math.round((xMm / this.pitchMm - this.iRest) / this.step);
    const j = Math.round((yMm / this.pitchMm - this.jRest) / this.step);
    const z = this.at(i, j);
    return { i, j, xMm: this.xMm(i), yMm: this.yMm(j), zMm: z === NONE ? null : z / 1000 };
  }

  /**
   * What is in a column: y and z in millimetres, z null where nothing is.
   * @param {number} i @returns {{yMm: number, zMm: number | null}[]}
   */
  profile(i) {
    if (i < this.i0 || i >= this.i0 + this.columns) return [];
    const points = [];
    for (let r = 0; r < this.rows; r += 1) {
      const z = this.z[(i - this.i0) * this.rows + r];
      points.push({ yMm: this.yMm(this.j0 + r), zMm: z === NONE ? null : z / 1000 });
    }
    return points;
  }

  /** Outer limits in x and y: half a node beyond the outermost. */
  get bounds() {
    return {
      xMin: this.xMm(this.i0 - 0.5), xMax: this.xMm(this.i0 + this.columns - 0.5),
      yMin: this.yMm(this.j0 - 0.5), yMax: this.yMm(this.j0 + this.rows - 0.5),
    };
  }

  /**
   * Limits for colours, millimetres: what all but a few nodes lie within, so that a stray one does
   * not spoil the picture.
   * @param {number} [left] share that may lie outside on either side
   * @returns {[number, number] | null}
   */
  range(left = 0.002) {
    if (this.nodes === 0) return null;
    const least = this.leastUm;
    const span = this.mostUm - least;
    if (span === 0) return [least / 1000, least / 1000];
    const bins = new Uint32Array(1024);
    const used = this.columns * this.rows;
    let counted = 0;
    for (let k = 0; k < used; k += 1) {
      const z = this.z[k];
      if (z === NONE) continue;
      bins[Math.min(1023, Math.floor(((z - least) / span) * 1024))] += 1;
      counted += 1;
    }
    const most = Math.floor(left * counted);
    let low = 0;
    let high = 1023;
    for (let sum = bins[0]; sum <= most && low < high; low += 1) sum += bins[low + 1];
    for (let sum = bins[1023]; sum <= most && high > low; high -= 1) sum += bins[high - 1];
    return [(least + (span * low) / 1024) / 1000, (least + (span * (high + 1)) / 1024) / 1000];
  }

  /**
   * Pixels of the image, a node each, upper row first.
   * @param {Uint32Array} pixels columns * rows words @param {Uint32Array} colours 256 words
   * @param {number} leastMm @param {number} mostMm
   */
  paint(pixels, colours, leastMm, mostMm) {
    const least = leastMm * 1000;
    const factor = 255 / Math.max(1, mostMm * 1000 - least);
    for (let c = 0; c < this.columns; c += 1) {
      const from = c * this.rows;
      for (let r = 0; r < this.rows; r += 1) {
        const z = this.z[from + r];
        const at = (this.rows - 1 - r) * this.columns + c;
        pixels[at] = z === NONE ? 0 : colours[Math.min(255, Math.max(0, Math.round((z - least) * factor)))];
      }
    }
  }
}
