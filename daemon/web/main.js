// @ts-check
/** Where it begins: words, token, events, views. */

import { onRefused, token } from './api.js';
import { app, askStatus, tell } from './app.js';
import { announce } from './dialogs.js';
import { Feed } from './feed.js';
import { LANGUAGES, Words, choose } from './i18n.js';
import { openJobs } from './jobs.js';
import { openMachine } from './machine.js';
import { openPreview } from './preview.js';
import { openResult } from './result.js';
import { openRoom } from './room.js';
import { tokenIn } from './route.js';
import { openScans } from './scans.js';
import { shell } from './shell.js';
import { asking, signIn } from './signin.js';

/** @param {string} language @returns {Promise<Record<string, string>>} */
const strings = async (language) => (await fetch(`/assets/strings/${language}.json`)).json();

async function begin() {
  const given = tokenIn(location.hash);
  if (given) {
    token.set(given, false);
    history.replaceState(null, '', location.pathname);
  }
  const saved = localStorage.getItem('relief.language') ?? '';
  const language = LANGUAGES.includes(saved) ? saved : choose(navigator.languages);
  document.documentElement.lang = language;
  app.words = new Words(language, await strings(language));

  const views = {
    machine: openMachine, scans: openScans, jobs: openJobs, result: openResult, preview: openPreview, room: openRoom,
  };
  shell(views, (chosen) => {
    localStorage.setItem('relief.language', chosen);
    location.reload();
  });
  listen();
}

function listen() {
  const { model } = app;
  let pending = false;
  const changed = () => {
    if (pending) return;
    pending = true;
    // At most once a frame, however fast columns come; a page in the background draws none.
    const soon = document.hidden ? (/** @type {() => void} */ f) => setTimeout(f, 200) : requestAnimationFrame;
    soon(() => {
      pending = false;
      tell('change');
    });
  };
  const feed = new Feed({
    up: () => {
      model.connected = true;
      model.lastWordMs = Date.now();
      tell('connection');
    },
    down: () => {
      model.connected = false;
      tell('connection');
      changed();
    },
    sign: () => {
      model.lastWordMs = Date.now();
    },
    event: (event, again) => {
      const before = event.kind === 'scan' ? model.scans.get(event.id)?.state : model.jobs.get(event.id)?.state;
      const kind = model.take(event, Date.now());
      if (kind === 'column') tell('live', event);
      else tell('event', event);
      if (kind === 'scan' || kind === 'scanner') askStatus();
      if (kind === 'scan' && before !== event.state) say('scan', event);
      if (kind === 'job' && before !== event.state && event.state !== 'queued') say('job', event);
      if (again || kind === 'lagged') {
        if (kind === 'lagged') askStatus();
        model.missed();
        tell('again');
      }
      changed();
    },
  });
  const start = () => {
    if (model.status) tell('again');
    feed.start();
    askStatus(0);
  };
  onRefused(() => {
    if (!asking()) {
      feed.stop();
      signIn(() => start());
    }
  });
  setInterval(() => tell('tick'), 1000);
  // Services of before told of no laser, and no event tells of room and waiting jobs.
  setInterval(() => {
    if (model.connected && !document.hidden) askStatus(0);
  }, 4500);
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => tell('theme'));
  start();
}

/** @param {'scan' | 'job'} what @param {any} item */
function say(what, item) {
  announce(app.words.say(`said.${what}`, { name: item.name, state: app.words.word(`${what}-state`, item.state) }));
}

begin();
