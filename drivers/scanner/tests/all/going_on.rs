//! A scan taken up in the middle: the session's part, under simulated time.

use std::time::Duration;

use scanner_driver::session::{Acknowledged, Session, Ticket};

use crate::bench::{Bench, plan};
use crate::device::Device;

const TICKET: Ticket = Ticket(1 << 32);

/// Columns that were handed on before.
const HANDED: u32 = 50;

const COLUMNS: u32 = 120;

/// Asks the device to take a scan up, two columns before the first that is missing. Of those
/// handed on, the ones below `safe` are acknowledged.
fn go_on(safe: u32) -> Bench {
    let mut bench = Bench::ready(Device::homed());
    let mut acknowledged = Acknowledged::default();
    for column in 0..safe {
        acknowledged.add(column, HANDED);
    }
    bench.session.go_on(
        TICKET,
        plan(COLUMNS),
        HANDED - 2,
        HANDED,
        acknowledged,
        bench.now,
    );
    bench
}

fn acknowledge(session: &mut Session, columns: std::ops::Range<u32>, now: Duration) {
    for column in columns {
        session.acknowledge(column, now);
    }
}

fn to_its_end(mut bench: Bench) {
    bench.run_until("end", |bench| bench.over.is_some());
    assert_eq!(bench.over, Some(Ok(())));
    let indices: Vec<u32> = bench.columns.iter().map(|column| column.index).collect();
    assert_eq!(indices, (HANDED - 2..COLUMNS).collect::<Vec<_>>());
    bench.run_for(Duration::from_secs(1));
    assert!(!bench.device.has_scan(), "it is closed");
}

#[test]
fn what_becomes_safe_while_the_scan_is_taken_up_counts() {
    let mut bench = go_on(20);
    // Nothing has been sent yet.
    acknowledge(&mut bench.session, 20..30, bench.now);
    bench.cut = true;
    bench.step();
    // It has been sent, and is not answered.
    acknowledge(&mut bench.session, 30..HANDED, bench.now);
    bench.cut = false;
    to_its_end(bench);
}

#[test]
fn columns_measured_again_are_kept_by_the_device_until_they_have_come() {
    let mut bench = go_on(HANDED);
    // The answer and the first columns are lost; it is given again, and what is safe is told
    // before the columns are asked for.
    bench.cut = true;
    bench.run_for(Duration::from_millis(200));
    assert!(bench.device.sent_columns() > HANDED);
    bench.cut = false;
    to_its_end(bench);
}

#[test]
fn more_columns_are_measured_again_than_the_device_can_keep() {
    let mut bench = Bench::ready(Device {
        max_credits: 1,
        ..Device::homed()
    });
    let mut acknowledged = Acknowledged::default();
    for column in 0..HANDED {
        acknowledged.add(column, HANDED);
    }
    let now = bench.now;
    bench.session.go_on(
        TICKET,
        plan(COLUMNS),
        HANDED - 30,
        HANDED,
        acknowledged,
        now,
    );
    bench.run_until("end", |bench| bench.over.is_some());
    assert_eq!(bench.columns.len() as u32, COLUMNS - HANDED + 30);
    // One column is in flight at a time, and none waits for a heartbeat.
    assert_eq!(bench.device.most_unacknowledged, 1);
    let took = bench.now - now;
    assert!(took < Duration::from_secs(10), "{took:?}");
}
