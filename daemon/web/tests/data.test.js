// Tests of what is kept and drawn: node --test daemon/web/tests/
import assert from 'node:assert/strict';
import { test } from 'node:test';

import { deviationImage, parameters } from '../facts.js';
import { readGlb } from '../glb.js';
import { Lattice, NONE } from '../lattice.js';
import { Model, underWay } from '../model.js';
import { Orbit, meets } from '../orbit.js';

/** A column of a plane z = i + 10 j, micrometres, from j to j + count. */
const column = (i, j, count, hole = NaN) => ({ i, j_first: j, z_um: Array.from({ length: count }, (_, k) => (j + k === hole ? null : i + 10 * (j + k))) });

test('columns that come in any order lie where they belong', () => {
  const lattice = new Lattice(0.5);
  for (const one of [column(3, -2, 5, 1), column(5, 4, 3), column(-1, -7, 2), column(4, 0, 1)]) lattice.put(one);
  assert.equal(lattice.at(3, -2), 3 - 20);
  assert.equal(lattice.at(3, 1), NONE);
  assert.equal(lattice.at(5, 6), 5 + 60);
  assert.equal(lattice.at(-1, -7), -1 - 70);
  assert.equal(lattice.at(99, 0), NONE);
  assert.equal(lattice.nodes, 4 + 3 + 2 + 1);
  assert.deepEqual(lattice.nearest(1.6, -0.9), { i: 3, j: -2, xMm: 1.5, yMm: -1, zMm: -0.017 });
  assert.deepEqual(lattice.bounds, { xMin: -0.75, xMax: 2.75, yMin: -3.75, yMax: 3.25 });
  assert.deepEqual(lattice.profile(3).filter(({ zMm }) => zMm !== null).map(({ yMm }) => yMm), [-1, -0.5, 0, 1]);
});

test('a column that comes again takes the place of the first', () => {
  const lattice = new Lattice(1);
  lattice.put(column(0, 0, 4));
  lattice.put(column(0, 0, 4, 2));
  assert.equal(lattice.nodes, 3);
  assert.equal(lattice.at(0, 2), NONE);
});

test('an image with a step takes later columns of the fine lattice', () => {
  const lattice = Lattice.of({ pitch_mm: 0.25, step: 3, columns: [-5, -2, 1].map((i) => ({ i, j_first: 2, z_um: [2, 5, 8].map((j) => i + 10 * j) })) });
  for (let i = 2; i <= 7; i += 1) lattice.put(column(i, -3, 20));
  assert.equal(lattice.columns, 5);
  for (let c = 0; c < lattice.columns; c += 1) {
    for (const { yMm, zMm } of lattice.profile(lattice.i0 + c)) {
      if (zMm === null) continue;
      const i = lattice.xMm(lattice.i0 + c) / 0.25;
      assert.ok(Math.abs(zMm * 1000 - (i + 10 * (yMm / 0.25))) < 1e-9, `${i} ${yMm} ${zMm}`);
    }
  }
  assert.equal(lattice.spacingMm, 0.75);
});

test('more nodes than are kept become fewer, each where it was', () => {
  const lattice = new Lattice(1, 1, 500);
  for (let i = -21; i < 59; i += 1) lattice.put(column(i, -9, 40));
  assert.ok(lattice.columns * lattice.rows <= 500 && lattice.step > 1);
  let seen = 0;
  for (let c = 0; c < lattice.columns; c += 1) {
    for (let r = 0; r < lattice.rows; r += 1) {
      const z = lattice.at(lattice.i0 + c, lattice.j0 + r);
      if (z === NONE) continue;
      seen += 1;
      assert.equal(z, lattice.xMm(lattice.i0 + c) + 10 * lattice.yMm(lattice.j0 + r));
    }
  }
  assert.equal(seen, lattice.nodes);
  assert.ok(seen >= 120);
});

test('a stray node does not spoil the colours', () => {
  const lattice = new Lattice(1);
  for (let i = 0; i < 100; i += 1) lattice.put({ i, j_first: 0, z_um: Array.from({ length: 100 }, (_, j) => 1000 + i + j) });
  lattice.put({ i: 100, j_first: 0, z_um: [90000] });
  const [least, most] = lattice.range();
  assert.ok(least >= 0.9 && least <= 1.1 && most < 2, `${least} ${most}`);
});

test('pixels have the upper row first', () => {
  const lattice = new Lattice(1);
  lattice.put({ i: 0, j_first: 0, z_um: [0, 1000] });
  lattice.put({ i: 1, j_first: 1, z_um: [500] });
  const pixels = new Uint32Array(4);
  lattice.paint(pixels, Uint32Array.from({ length: 256 }, (_, k) => k + 1), 0, 1);
  assert.deepEqual([...pixels], [256, 129, 1, 0]);
});

/** A glTF of a triangle and two points. */
function glb(change = () => {}) {
  const floats = new Float32Array([0, 0, 0, 2, 0, 0, 0, 2, 0, /* points */ 1, 1, 5, 3, 1, 5, /* deviations */ 0.25, -0.5]);
  const bytes = new Uint8Array(floats.byteLength + 6 + 2);
  bytes.set(new Uint8Array(floats.buffer));
  bytes.set(new Uint8Array(Uint16Array.from([0, 1, 2]).buffer), floats.byteLength);
  const document = {
    asset: { version: '2.0', extras: { units: 'mm' } }, scene: 0, scenes: [{ nodes: [0] }],
    nodes: [{ children: [1, 2], scale: [0.002, 0.002, 0.002] }, { mesh: 0, translation: [1, 0, 0] }, { mesh: 1 }],
    meshes: [{ name: 'faces', primitives: [{ attributes: { POSITION: 0 }, indices: 1, extras: { face: 4, region: 2, kind: 'plane' } }] },
      { name: 'nodes', primitives: [{ mode: 0, attributes: { POSITION: 2, _DEVIATION: 3 }, extras: { pitch_mm: 2, step: 2 } }] }],
    accessors: [{ bufferView: 0, componentType: 5126, count: 3, type: 'VEC3' }, { bufferView: 1, componentType: 5123, count: 3, type: 'SCALAR' },
      { bufferView: 0, byteOffset: 36, componentType: 5126, count: 2, type: 'VEC3' }, { bufferView: 0, byteOffset: 60, componentType: 5126, count: 2, type: 'SCALAR' }],
    bufferViews: [{ buffer: 0, byteOffset: 0, byteLength: floats.byteLength }, { buffer: 0, byteOffset: floats.byteLength, byteLength: 6 }],
    buffers: [{ byteLength: bytes.length }],
  };
  change(document);
  let json = JSON.stringify(document);
  json += ' '.repeat((4 - (json.length % 4)) % 4);
  const file = new Uint8Array(28 + json.length + bytes.length);
  const view = new DataView(file.buffer);
  [0x46546c67, 2, file.length, json.length, 0x4e4f534a].forEach((word, k) => view.setUint32(4 * k, word, true));
  file.set(new TextEncoder().encode(json), 20);
  view.setUint32(20 + json.length, bytes.length, true);
  view.setUint32(24 + json.length, 0x004e4942, true);
  file.set(bytes, 28 + json.length);
  return file.buffer;
}

test('a glTF is read with places, units and extras', () => {
  const { primitives } = readGlb(glb());
  assert.equal(primitives.length, 2);
  const [face, points] = primitives;
  // glTF's metres: the root's 0.002 makes 2 mm of 1.
  assert.deepEqual([...face.attributes.POSITION].map((part) => Math.round(part * 1e6) / 1e6), [2, 0, 0, 6, 0, 0, 2, 4, 0]);
  assert.deepEqual([...face.indices], [0, 1, 2]);
  assert.deepEqual(face.extras, { face: 4, region: 2, kind: 'plane' });
  assert.equal(points.mode, 0);
  assert.deepEqual([...points.attributes._DEVIATION], [0.25, -0.5]);
});

test('a damaged glTF is refused with words', () => {
  assert.throws(() => readGlb(new ArrayBuffer(40)), /no binary glTF/);
  assert.throws(() => readGlb(glb().slice(0, 400)), /ends/);
  assert.throws(() => readGlb(glb((d) => { d.accessors[0].count = 1000; })), /ends behind/);
  assert.throws(() => readGlb(glb((d) => { d.accessors[1].byteOffset = 2; d.accessors[1].count = 2; d.accessors[0].count = 1; })), /past the vertices/);
  assert.throws(() => readGlb(glb((d) => { d.nodes[2].children = [0]; })), /too deeply/);
});

test('deviations of nodes make an image that loses nothing', () => {
  const image = deviationImage(readGlb(glb()));
  // The root's scale doubles places: 2, 6 and 2, on a lattice of 2 mm of which every second is there.
  assert.equal(image.step, 2);
  const lattice = Lattice.of(image);
  assert.equal(lattice.nearest(2, 2).zMm, 250);
  assert.equal(lattice.nearest(6, 2).zMm, -500);
  assert.equal(deviationImage({ primitives: [], extras: {} }), null);
});

test('a ray through a place of the picture meets what is drawn there', () => {
  const positions = [Float32Array.from([-10, -5, 3, 30, -5, 3, 10, 25, -20])];
  for (const [turn, tilt] of [[0, 0], [-32, 24], [140, -50]]) {
    for (const aspect of [0.5, 1, 2.2]) {
      const camera = new Orbit();
      [camera.turnDeg, camera.tiltDeg] = [turn, tilt];
      camera.fit(positions, aspect);
      const m = camera.matrix(aspect);
      let widest = 0;
      const [x, y, z] = [0, 1, 2].map((k) => (positions[0][k] + positions[0][3 + k] + positions[0][6 + k]) / 3);
      const project = (a, b, c) => [0, 1, 2, 3].map((r) => m[r] * a + m[4 + r] * b + m[8 + r] * c + m[12 + r]);
      for (let k = 0; k < 9; k += 3) {
        const [u, v, d, w] = project(...positions[0].subarray(k, k + 3));
        assert.ok(w > 0 && Math.abs(d / w) < 1);
        widest = Math.max(widest, Math.abs(u / w), Math.abs(v / w));
      }
      assert.ok(widest > 0.8 && widest <= 0.921, `${widest}`);
      const [u, v, , w] = project(x, y, z);
      const ray = camera.ray(u / w, v / w, aspect);
      const far = meets(ray, positions[0], Uint32Array.from([0, 1, 2]));
      [x, y, z].forEach((part, k) => assert.ok(Math.abs(ray.from[k] + far * ray.to[k] - part) < 1e-3));
      for (const [dx, dy] of [[45, 0], [-45, 0], [0, 40], [0, -40], [-25, 12], [25, 12]]) {
        const [a, b, , c] = project(x + dx, y + dy, z);
        assert.equal(meets(camera.ray(a / c, b / c, aspect), positions[0], Uint32Array.from([0, 1, 2])), Infinity, `beside it by ${dx}, ${dy}`);
      }
      assert.equal(meets({ from: ray.from, to: ray.to.map((part) => -part) }, positions[0], Uint32Array.from([0, 1, 2])), Infinity);
    }
  }
});

test('parameters have the digits that their uncertainty leaves', () => {
  const region = { shape: { family: 'cylinder', numbers: {
    radius_mm: { value: 36.74561, uncertainty: 0.00171 }, tube_radius_mm: null, half_angle_deg: null,
    point_mm: [1, 2, 3.00004], point_uncertainty_mm: 0.0021, direction: [0, 1, 0], direction_uncertainty_deg: 0.0043,
  } } };
  assert.deepEqual(parameters(region), [
    { key: 'radius', text: '36.7456 \u00b1 0.0017 mm' }, { key: 'point', text: '(1.0000, 2.0000, 3.0000) \u00b1 0.0021 mm' },
    { key: 'axis', text: '(0.00000, 1.00000, 0.00000) \u00b1 0.0043\u00b0' },
  ]);
  assert.deepEqual(parameters({ shape: null }), []);
});

const scan = (state, more = {}) => ({ kind: 'scan', id: 's1', name: 'a', scanner: 'left', state, columns: 0, columns_planned: 10, ...more });

test('events change what is known, and a status is the whole of it', () => {
  const model = new Model();
  const scanner = (name, more = {}) => ({ name, link: 'ready', endpoint: name, laser: { laser: 'off', at: '', cause: '' }, ...more });
  model.take({ kind: 'status', version: '1', scanners: [scanner('left'), scanner('right')] }, 0);
  assert.deepEqual([...model.scanners.keys()], ['left', 'right']);
  model.take(scan('scanning'), 0);
  assert.ok(underWay(model.scanners.get('left').scan));
  for (let k = 1; k <= 5; k += 1) {
    model.take({ kind: 'column', scan: 's1', scanner: 'left', columns: k, columns_planned: 10, x_mm: -k * 0.5, pitch_mm: 0.5, live: [column(-k, 0, 3)] }, k * 100);
  }
  const live = model.live.get('left');
  assert.equal(live.lattice.nodes, 15);
  assert.deepEqual(live.planMm, [-5, -0.5]);
  assert.ok(live.whole);
  model.missed();
  assert.ok(!live.whole && !live.asked);
  assert.equal(live.rate.perSecond, 10);
  assert.equal(model.scanners.get('left').scan.columns, 5);
  model.take({ kind: 'scanner', name: 'left', link: 'trouble', endpoint: 'left', problem: 'interlock open' }, 600);
  assert.equal(model.scanners.get('left').problem, 'interlock open');
  assert.equal(model.scanners.get('left').laser.laser, 'off');
  model.take({ kind: 'laser', scanner: 'left', laser: 'on', at: '', cause: 'a scan begins' }, 650);
  assert.equal(model.scanners.get('left').laser.laser, 'on');
  assert.equal(model.scanners.get('left').laser.kind, undefined);
  assert.equal(model.scanners.get('right').laser.laser, 'off');
  model.take({ kind: 'scanner', name: 'left', link: 'ready', endpoint: 'left' }, 700);
  assert.equal(model.scanners.get('left').problem, undefined);
  model.take(scan('complete', { columns: 10 }), 800);
  assert.equal(model.scanners.get('left').scan, null);
  assert.equal(model.lastScan.get('left').state, 'complete');
  model.take({ kind: 'status', version: '1', scanners: [scanner('right')] }, 900);
  assert.deepEqual([...model.scanners.keys()], ['right']);
});

test('a scan that ended while nobody listened is not taken for one under way', () => {
  const model = new Model();
  const status = { kind: 'status', version: '1', scanners: [{ name: 'left', scan: scan('scanning', { columns: 4 }) }] };
  model.take(status, 0);
  assert.ok(underWay(model.lastScan.get('left')));
  model.take({ ...status, scanners: [{ name: 'left' }] }, 100);
  assert.equal(model.lastScan.has('left'), false);
  assert.equal(model.live.get('left').scan, 's1');
});

test('an image that comes late lies under the columns that came before it', () => {
  const model = new Model();
  model.take({ kind: 'status', version: '1', scanners: [{ name: 'left', scan: scan('scanning', { columns: 4 }) }] }, 0);
  model.take({ kind: 'column', scan: 's1', scanner: 'left', columns: 5, columns_planned: 10, x_mm: 5, pitch_mm: 1, live: [column(4, 0, 3), column(5, 0, 3)] }, 0);
  const live = model.live.get('left');
  live.under({ pitch_mm: 1, step: 1, columns: [column(1, 0, 3), column(2, 0, 3), { i: 4, j_first: 0, z_um: [7, 7, 7] }] });
  assert.deepEqual([1, 2, 3, 4, 5].map((i) => live.lattice.at(i, 1)), [11, 12, NONE, 14, 15]);
});

test('a job that is over has no progress', () => {
  const model = new Model();
  model.take({ kind: 'progress', job: 3, stage: 'segment', fraction: 0.5 }, 0);
  assert.deepEqual(model.progress.get(3), { stage: 'segment', fraction: 0.5 });
  model.take({ kind: 'job', id: 3, state: 'done' }, 0);
  assert.equal(model.progress.has(3), false);
});
