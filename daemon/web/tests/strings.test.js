// Every string is there in every language, and every one that the page asks for exists.
import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { test } from 'node:test';

const root = new URL('..', import.meta.url);
const read = (path) => readFileSync(new URL(path, root), 'utf8');
const strings = (language) => JSON.parse(read(`strings/${language}.json`));
const sources = readdirSync(root).filter((name) => name.endsWith('.js'));

/** Groups of strings whose keys are put together while the page runs. */
const GROUPS = [
  'fault', 'scan-state', 'job-state', 'link', 'delivery', 'receiver', 'webhook', 'stage', 'kind', 'edge', 'background', 'plan', 'setting', 'parameter',
  'nav', 'theme', 'language', 'laser', 'picture', 'solid', 'result', 'jobs', 'room', 'said', 'scan',
];

test('languages have the same strings with the same values', () => {
  const [en, ko] = [strings('en'), strings('ko')];
  const plain = Object.keys(en).filter((key) => !key.endsWith('.one'));
  assert.deepEqual(Object.keys(ko), plain);
  const values = (text) => [...new Set(text.match(/\{\w+\}/g) ?? [])].sort();
  for (const key of plain) assert.deepEqual(values(ko[key]), values(en[key]), key);
  const same = plain.filter((key) => ko[key] === en[key] && !/^(language|region\.rms|picture\.height|region\.psnr)/.test(key));
  assert.deepEqual(same, [], 'not translated');
});

test('every string that is asked for exists, and none is left over', () => {
  const en = strings('en');
  const asked = new Set();
  for (const name of sources) {
    for (const [, key] of read(name).matchAll(/'([a-z]+(?:-[a-z]+)?\.[a-z0-9.-]+)'/g)) asked.add(key);
  }
  const groups = new RegExp(`^(${GROUPS.join('|')})\\.`);
  const roots = new Set(Object.keys(en).map((key) => key.split('.')[0]));
  const files = /\.(js|css|json|png|glb|html|pdf)$/;
  const missing = [...asked].filter((key) => roots.has(key.split('.')[0]) && !files.test(key) && !(key in en));
  assert.deepEqual(missing, []);
  const unused = Object.keys(en).filter((key) => !asked.has(key.replace(/\.one$/, '')) && !groups.test(key));
  assert.deepEqual(unused, []);
});

test('nothing is put into the page but as text, and nothing comes from elsewhere', () => {
  for (const name of [...sources, 'index.html', 'style.css', 'views.css']) {
    const text = read(name);
    assert.doesNotMatch(text, /innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function/, name);
    assert.doesNotMatch(text.replaceAll('http://www.w3.org/2000/svg', ''), /https?:\/\//, name);
  }
  assert.doesNotMatch(read('index.html'), / style=| on[a-z]+=|<script>|<style/);
});

test('modules stay short, and the page small', () => {
  let code = 0;
  for (const name of [...sources, 'index.html', 'style.css', 'views.css', 'icon.svg']) {
    const text = read(name);
    code += Buffer.byteLength(text);
    assert.ok(text.split('\n').length <= 360, name);
  }
  // One language is fetched.
  for (const language of ['en', 'ko']) assert.ok(code + Buffer.byteLength(read(`strings/${language}.json`)) < 256_000, `${code} bytes`);
});

test('all modules are asked for at once, and none that is not there', () => {
  const named = [...read('index.html').matchAll(/\/assets\/(\w+\.js)/g)].map(([, name]) => name);
  assert.deepEqual([...new Set(named)].sort(), sources.toSorted());
});
