// Tests of the modules that know no page: node --test daemon/web/tests/
import assert from 'node:assert/strict';
import { test } from 'node:test';

import { deviationColour, heightColour, table, ticks } from '../colour.js';
import { Rate, bytes, clock, fixed, settingLines, withUncertainty } from '../format.js';
import { Words, choose } from '../i18n.js';
import { patient } from '../patience.js';
import { parseRoute, routeTo, tokenIn } from '../route.js';
import { SseParser, backoffMs } from '../sse.js';

/** Lightness of a colour after CIE 1976, 0 to 100. */
function lightness([r, g, b]) {
  const [x, y, z] = [r, g, b].map((part) => {
    const share = part / 255;
    return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
  });
  const luminance = 0.2126 * x + 0.7152 * y + 0.0722 * z;
  return luminance > 0.008856 ? 116 * Math.cbrt(luminance) - 16 : 903.3 * luminance;
}

test('heights become lighter evenly', () => {
  const steps = Array.from({ length: 21 }, (_, k) => lightness(heightColour(k / 20)));
  const mean = (steps[20] - steps[0]) / 20;
  assert.ok(mean > 3, `the scale spans ${mean * 20} of lightness`);
  for (let k = 1; k < steps.length; k += 1) {
    const step = steps[k] - steps[k - 1];
    assert.ok(step > 0.5 * mean && step < 1.6 * mean, `step ${k} is ${step}, the mean ${mean}`);
  }
  assert.deepEqual(heightColour(-1), heightColour(0));
  assert.deepEqual(heightColour(2), heightColour(1));
});

test('no deviation is lightest, and both signs are as far from it', () => {
  const middle = lightness(deviationColour(0.5));
  for (const far of [0.1, 0.3, 0.5]) {
    const [below, above] = [0.5 - far, 0.5 + far].map((share) => lightness(deviationColour(share)));
    assert.ok(below < middle && above < middle);
    assert.ok(Math.abs(below - above) < 12, `${below} and ${above} at ${far}`);
  }
});

test('a table of colours is what a canvas takes', () => {
  const words = table(heightColour);
  assert.equal(words.length, 256);
  assert.deepEqual([...new Uint8Array(words.buffer, 4 * 255, 4)], [...heightColour(1), 255]);
});

test('ticks are round and inside', () => {
  assert.deepEqual(ticks(-24.2, 48.9, 4), [-20, 0, 20, 40]);
  assert.deepEqual(ticks(0, 1, 5), [0, 0.2, 0.4, 0.6, 0.8, 1]);
  assert.deepEqual(ticks(-0.0031, 0.0031, 4), [-0.002, 0, 0.002]);
  assert.deepEqual(ticks(3, 3, 4), [3]);
  assert.deepEqual(ticks(NaN, NaN, 4), []);
});

test('events are parsed however they are cut', () => {
  const text = ': hello\r\n\r\nevent: status\r\nid: 7\r\ndata: {"a":\r\ndata: 1}\r\n\r\nevent:column\ndata:x\n\nid\ndata: y\r\rdata: left out';
  const expected = [
    { event: 'status', data: '{"a":\n1}', id: '7' }, { event: 'column', data: 'x', id: '7' }, { event: 'message', data: 'y', id: '' },
  ];
  for (let size = 1; size <= text.length; size += 1) {
    const parser = new SseParser();
    const found = [];
    for (let at = 0; at < text.length; at += size) found.push(...parser.push(text.slice(at, at + size)));
    assert.deepEqual(found, expected, `in pieces of ${size}`);
  }
});

test('attempts to come back grow apart, up to a bound', () => {
  const waits = Array.from({ length: 12 }, (_, k) => backoffMs(k, 1));
  for (let k = 1; k < waits.length; k += 1) assert.ok(waits[k] >= waits[k - 1]);
  assert.equal(waits[0], 500);
  assert.equal(waits.at(-1), 5000);
  assert.equal(backoffMs(3, 0), backoffMs(3, 1) / 2);
});

test('routes come back as they went', () => {
  for (const [view, argument] of [['machine', ''], ['result', '20261129T190322.900Z-a b/\u00e9'], ['room', '']]) {
    assert.deepEqual(parseRoute(routeTo(view, argument)), { view, argument });
  }
  assert.deepEqual(parseRoute('#/nonsense/x'), { view: 'machine', argument: '' });
  assert.deepEqual(parseRoute('#/result/%E0%A4%A'), { view: 'result', argument: '' });
});

test('a token is found in the address, and nothing else is taken for one', () => {
  assert.equal(tokenIn('#token=relief_12%2F'), 'relief_12/');
  assert.equal(tokenIn('#/scans'), '');
  assert.equal(tokenIn('#/result/token=x'), '');
});

test('figures are written as they are read', () => {
  assert.equal(fixed(-0.0004, 2), '0.00');
  assert.equal(fixed(-1.5, 1), '\u22121.5');
  assert.equal(fixed(null, 2), '\u2013');
  assert.deepEqual(withUncertainty(36.7456123, 0.0017), { value: '36.7456', uncertainty: '0.0017' });
  assert.deepEqual(withUncertainty(1234.5, 23), { value: '1235', uncertainty: '23' });
  assert.deepEqual(withUncertainty(5, 0), { value: '5.0000', uncertainty: '0' });
  assert.equal(bytes(999), '999 B');
  assert.equal(bytes(690046), '690 kB');
  assert.equal(bytes(999_600_000), '1.0 GB');
  assert.equal(clock(71.6), '1:12');
  assert.equal(clock(3725), '1:02:05');
});

test('settings are read line by line, and a wrong line is named', () => {
  assert.deepEqual(settingLines('regrid.pitch_mm = 0.5\n\nsegment.background=keep\nregrid.roi_z_mm = [-30, 60]\n'), {
    settings: { 'regrid.pitch_mm': 0.5, 'segment.background': 'keep', 'regrid.roi_z_mm': [-30, 60] }, wrong: null,
  });
  assert.equal(settingLines('a.b = 1\npitch 3').wrong, 2);
});

test('the rate is of the latest columns, and begins anew with a scan', () => {
  const rate = new Rate(1000);
  assert.equal(rate.perSecond, null);
  for (let k = 0; k < 100; k += 1) rate.add(k * 100, k);
  assert.equal(rate.perSecond, 10);
  for (let k = 0; k < 30; k += 1) rate.add(10000 + k * 50, 100 + k);
  assert.ok(Math.abs(rate.perSecond - 20) < 0.01, `${rate.perSecond}`);
  assert.ok(Math.abs(rate.left(149) - 1) < 0.001);
  rate.add(20000, 1);
  assert.equal(rate.perSecond, null);
});

test('the language is the first of those that there are', () => {
  assert.equal(choose(['fr', 'ko-KR', 'en']), 'ko');
  assert.equal(choose(['EN-gb']), 'en');
  assert.equal(choose([]), 'en');
});

test('words take values, plurals, and fall back', () => {
  const words = new Words('en', { nodes: '{count} nodes', 'nodes.one': '{count} node', 'stage.to-do': 'to do' }, { old: 'old {x}' });
  assert.equal(words.say('nodes', { count: 1 }), '1 node');
  assert.equal(words.say('nodes', { count: 3 }), '3 nodes');
  assert.equal(words.say('old', {}), 'old {x}');
  assert.equal(words.say('missing'), 'missing');
  assert.equal(words.word('stage', 'to do'), 'to do');
  assert.equal(words.word('stage', 'of a later version'), 'of a later version');
});

test('a busy service is asked again, and nothing else is', async () => {
  let asked = 0;
  let waited = 0;
  const busy = (times, kind = 'busy-regridding') => () => {
    asked += 1;
    return asked <= times ? Promise.reject(Object.assign(new Error('busy'), { kind })) : Promise.resolve(asked);
  };
  const wait = () => Promise.resolve(waited += 1);
  assert.equal(await patient(busy(3), () => true, wait), 4);
  assert.equal(waited, 3);
  asked = 0;
  await assert.rejects(patient(busy(3), () => asked < 2, wait), /busy/);
  assert.equal(asked, 2);
  asked = 0;
  await assert.rejects(patient(busy(1, 'no-image'), () => true, wait), /busy/);
  assert.equal(asked, 1);
  asked = 0;
  await assert.rejects(patient(busy(1e6), () => true, wait), /busy/);
  assert.ok(asked < 1000);
});
