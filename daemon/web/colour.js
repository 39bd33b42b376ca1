// @ts-check
/** Colour scales, and the colours of things that are told apart. Pure: no page, no canvas. */

/**
 * Anchors of a perceptually uniform scale from dark violet over teal to yellow (viridis, by Smith and
 * van der Walt, who gave it away); between them colours are interpolated, which nobody sees.
 */
const HEIGHT = [
  0x440154, 0x481567, 0x482677, 0x453781, 0x404788, 0x39568c, 0x33638d, 0x2d708e, 0x287d8e, 0x238a8d,
  0x1f968b, 0x20a387, 0x29af7f, 0x3cbb75, 0x55c667, 0x73d055, 0x95d840, 0xb8de29, 0xdce319, 0xfde725,
];

/** From blue (behind) over near white to red (towards the camera), as in `residuals.png`. */
const DEVIATION = [
  0x1d4f91, 0x2f6cb0, 0x5a92c8, 0x8db8dc, 0xc3dbec, 0xf2f2f0, 0xf6cfbf, 0xeda38a, 0xdb7258,
  0xc2453a, 0x97202b,
];

/** Colours of shapes and regions: told apart also by those who see red and green alike. */
export const PALETTE = [
  '#4c86c6', '#e0913a', '#58a36c', '#c7596b', '#8f78c2', '#b59a3c', '#4fa9b8', '#b06f9e',
  '#7d8a99', '#8fae4b',
];

/** Kinds of faces, in the order of their colours. */
export const KINDS = [
  'plane', 'cylinder', 'cone', 'sphere', 'torus', 'extrusion', 'revolution', 'bicubic patches',
];

/** @typedef {[number, number, number]} Rgb red, green and blue, 0 to 255 */

/** @param {number} packed @returns {Rgb} */
const unpack = (packed) => [packed >> 16, (packed >> 8) & 255, packed & 255];

/**
 * The colour at a share of a scale.
 * @param {number[]} anchors @param {number} share 0 to 1; what is outside is clamped
 * @returns {Rgb}
 */
function along(anchors, share) {
  const at = Math.min(1, Math.max(0, share)) * (anchors.length - 1);
  const below = Math.min(anchors.length - 2, Math.floor(at));
  const a = unpack(anchors[below]);
  const b = unpack(anchors[below + 1]);
  const t = at - below;
  const mixed = [0, 1, 2].map((k) => Math.round(a[k] + (b[k] - a[k]) * t));
  return /** @type {Rgb} */ (mixed);
}

/** @param {number} share @returns {Rgb} */
export const heightColour = (share) => along(HEIGHT, share);

/** @param {number} share 0 behind, 0.5 none, 1 towards the camera @returns {Rgb} */
export const deviationColour = (share) => along(DEVIATION, share);

/**
 * 256 colours of a scale as words of a canvas's pixels.
 * @param {(share: number) => Rgb} scale
 */
export function table(scale) {
  const bytes = new Uint8ClampedArray(1024);
  for (let k = 0; k < 256; k += 1) bytes.set([...scale(k / 255), 255], 4 * k);
  return new Uint32Array(bytes.buffer);
}

/**
 * Colour of a kind of face; kinds of later versions get the last one.
 * @param {string} kind
 */
export function kindColour(kind) {
  const at = KINDS.indexOf(kind);
  return PALETTE[at < 0 ? PALETTE.length - 2 : at];
}

/** @param {number} label */
export const regionColour = (label) => PALETTE[(((label - 1) % PALETTE.length) + PALETTE.length) % PALETTE.length];

/** @param {string} text such as `#4c86c6` @returns {Rgb} red, green and blue, 0 to 1 */
export function fraction(text) {
  return /** @type {Rgb} */ (unpack(parseInt(text.slice(1), 16)).map((part) => part / 255));
}

/**
 * Round numbers that divide a range, for axes and legends.
 * @param {number} least @param {number} most @param {number} about how many are wanted
 */
export function ticks(least, most, about) {
  if (!(most > least) || !(about > 0)) return Number.isFinite(least) ? [least] : [];
  const rough = (most - least) / about;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough * 0.999) ?? rough;
  const found = [];
  for (let k = Math.ceil(least / step - 1e-9); k * step <= most + step * 1e-9; k += 1) {
    found.push(Number((k * step).toPrecision(12)));
  }
  return found;
}
