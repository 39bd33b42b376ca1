// @ts-check
/**
 * What is known of the service, and how events change it. Pure: no page, no requests; the time is
 * handed in.
 */

import { Lattice, NONE } from './lattice.js';
import { Rate } from './format.js';

/** States of a scan in which more will come. */
const UNDER_WAY = ['starting', 'scanning', 'paused'];

/** @param {{state: string} | null | undefined} scan */
export const underWay = (scan) => Boolean(scan && UNDER_WAY.includes(scan.state));

/** What is shown of the scan on a scanner. */
export class Live {
  /** @param {string} scan */
  constructor(scan) {
    this.scan = scan;
    /** @type {Lattice | null} */
    this.lattice = null;
    this.columns = 0;
    this.planned = 0;
    /** @type {number | null} */
    this.xMm = null;
    /** First and latest column of which x is known: number and x. @type {[number, number][]} */
    this.known = [];
    this.rate = new Rate();
    /** An image was asked for, since the page came later than the first column. */
    this.asked = false;
    /** Every column since the first was heard, so that no image needs to be asked for. */
    this.whole = false;
  }

  /** @param {any} event @param {number} nowMs */
  column(event, nowMs) {
    if (!this.lattice || this.lattice.pitchMm !== event.pitch_mm) {
      // Under another pitch what was there means something else.
      this.lattice = new Lattice(event.pitch_mm);
    }
    if (this.known.length === 0 && event.columns <= 1) this.whole = true;
    for (const column of event.live ?? []) this.lattice.put(column);
    this.columns = event.columns;
    this.planned = event.columns_planned;
    this.xMm = event.x_mm;
    this.known = [this.known[0] ?? [event.columns, event.x_mm], [event.columns, event.x_mm]];
    this.rate.add(nowMs, event.columns);
  }

  /** x of the first and the last planned column, as far as that can be told. @returns {[number, number] | null} */
  get planMm() {
    if (this.known.length < 2 || this.planned < 2) return null;
    const [[n1, x1], [n2, x2]] = this.known;
    if (n2 - n1 < 1) return null;
    const each = (x2 - x1) / (n2 - n1);
    const ends = [x1 - (n1 - 1) * each, x2 + (this.planned - n2) * each];
    return [Math.min(...ends), Math.max(...ends)];
  }

  /** Takes an image that was asked for under the columns that have come since. @param {any} image */
  under(image) {
    const base = Lattice.of(image);
    const since = this.lattice;
    if (since && since.pitchMm === base.pitchMm) {
      for (let c = 0; c < since.columns; c += 1) {
        const z = [];
        for (let r = 0; r < since.rows; r += 1) {
          const value = since.z[c * since.rows + r];
          z.push(value === NONE ? null : value);
        }
        if (z.some((value) => value !== null)) {
          base.put({ i: since.iRest + (since.i0 + c) * since.step, j_first: since.jRest + since.j0 * since.step, z_um: z }, since.step);
        }
      }
    } else if (since && !since.empty) return;
    this.lattice = base;
  }
}

export class Model {
  constructor() {
    /** Counts what events have told of scans and scanners: an answer to an earlier question is old. */
    this.changes = 0;
    /** @type {any} */
    this.status = null;
    /** Scanners by name. @type {Map<string, any>} */
    this.scanners = new Map();
    /** Live images by scanner. @type {Map<string, Live>} */
    this.live = new Map();
    /** The latest scan on a scanner, over or not. @type {Map<string, any>} */
    this.lastScan = new Map();
    /** Scans and jobs that events told of, by id. @type {Map<string, any>} */
    this.scans = new Map();
    /** @type {Map<number, any>} */
    this.jobs = new Map();
    /** What running jobs are at. @type {Map<number, {stage: string, fraction: number}>} */
    this.progress = new Map();
    /** Results published while the page was open, newest first. @type {any[]} */
    this.published = [];
    this.connected = false;
    /** @type {number | null} */
    this.lastWordMs = null;
  }

  /** Name of a scanner, where services of before had but one without a name. @param {string | undefined} name */
  named(name) {
    if (name) return name;
    return this.scanners.keys().next().value ?? 'scanner';
  }

  /** @param {any} status */
  takeStatus(status) {
    this.status = status;
    const list = status.scanners?.length ? status.scanners
      : [{ ...status.scanner, laser: status.laser, scan: status.scan }];
    const names = new Set();
    for (const scanner of list) {
      const name = scanner.name || 'scanner';
      names.add(name);
      this.scanners.set(name, { ...scanner, name });
      if (scanner.scan) this.takeScan(scanner.scan);
      else {
        const last = this.lastScan.get(name);
        // It ended while nobody listened; how, the list of scans tells.
        if (underWay(last)) this.lastScan.delete(name);
      }
    }
    for (const name of this.scanners.keys()) if (!names.has(name)) this.scanners.delete(name);
  }

  /** @param {any} scan */
  takeScan(scan) {
    this.scans.set(scan.id, scan);
    const name = this.named(scan.scanner);
    const last = this.lastScan.get(name);
    if (!last || last.id <= scan.id) this.lastScan.set(name, scan);
    const scanner = this.scanners.get(name);
    if (scanner && (!scanner.scan || scanner.scan.id === scan.id || underWay(scan))) {
      scanner.scan = underWay(scan) ? scan : null;
    }
    if (underWay(scan)) {
      let live = this.live.get(name);
      if (!live || live.scan !== scan.id) {
        live = new Live(scan.id);
        this.live.set(name, live);
      }
      live.columns = Math.max(live.columns, scan.columns ?? 0);
      live.planned = scan.columns_planned || live.planned;
      if (scan.state === 'paused') live.rate = new Rate();
    }
  }

  /** Events were missed: what is kept of scans under way has gaps. */
  missed() {
    for (const live of this.live.values()) Object.assign(live, { asked: false, whole: false });
  }

  /** @param {any} job */
  takeJob(job) {
    this.jobs.set(job.id, job);
    if (job.state !== 'running') this.progress.delete(job.id);
  }

  /**
   * @param {any} event @param {number} nowMs
   * @returns {string} its kind
   */
  take(event, nowMs) {
    if (['scan', 'scanner', 'laser', 'status'].includes(event.kind)) this.changes += 1;
    switch (event.kind) {
      case 'status': {
        const { kind, ...status } = event;
        this.takeStatus(status);
        break;
      }
      case 'scanner': {
        const { kind, ...status } = event;
        const name = this.named(status.name);
        // What is absent from this one is so because it is over: the problem above all.
        const { laser, scan } = this.scanners.get(name) ?? {};
        this.scanners.set(name, { ...status, name, laser, scan });
        break;
      }
      case 'laser': {
        const { kind, ...laser } = event;
        const scanner = this.scanners.get(this.named(laser.scanner));
        if (scanner) scanner.laser = laser;
        break;
      }
      case 'scan': {
        const { kind, ...scan } = event;
        this.takeScan(scan);
        break;
      }
      case 'column': {
        const name = this.named(event.scanner);
        let live = this.live.get(name);
        if (!live || live.scan !== event.scan) {
          live = new Live(event.scan);
          this.live.set(name, live);
        }
        live.column(event, nowMs);
        const scan = this.scanners.get(name)?.scan;
        if (scan?.id === event.scan) scan.columns = event.columns;
        break;
      }
      case 'job': {
        const { kind, ...job } = event;
        this.takeJob(job);
        break;
      }
      case 'progress': {
        if (event.seconds === undefined) {
          this.progress.set(event.job, { stage: event.stage, fraction: event.fraction });
        } else {
          this.progress.set(event.job, { stage: event.stage, fraction: 1 });
        }
        break;
      }
      case 'published':
        this.published.unshift(event);
        this.published.length = Math.min(this.published.length, 20);
        break;
      default:
    }
    return event.kind;
  }
}
