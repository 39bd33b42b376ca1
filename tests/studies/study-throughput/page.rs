//! The page with the tables.

use std::fmt::Display;

use throughput::TABLE_HEAD;

use crate::{disk, stream};

fn rows<T: Display>(rows: &[T]) -> String {
    rows.iter().map(|row| format!("{row}\n")).collect()
}

/// How the pseudo-terminal compares with memory where nothing else sets the pace.
fn compared(ways: &[throughput::Row]) -> String {
    let fast = |way: &str| -> Vec<&throughput::Row> {
        let wanted = |row: &&throughput::Row| row.way == way && row.case.line_rate_hz.is_none();
        ways.iter().filter(wanted).collect()
    };
    let (memory, terminal) = (fast("memory"), fast("pseudo-terminal"));
    let ratios = terminal
        .iter()
        .zip(&memory)
        .map(|(terminal, memory)| 100.0 * terminal.columns_per_s() / memory.columns_per_s());
    let (low, high) = ratios.fold((f64::INFINITY, 0.0_f64), |(low, high), ratio| {
        (low.min(ratio), high.max(ratio))
    });
    format!(
        "As fast as it goes, the pseudo-terminal carries {low:.0} to {high:.0} % of the columns that \
         memory does."
    )
}

pub(crate) fn page(
    usb: &str,
    ways: &[throughput::Row],
    streams: &[stream::Row],
    disks: &[disk::Row],
) -> String {
    format!(
        "# Throughput and backpressure\n\n\
         Written by `cargo xtask study throughput --usb --page docs/studies/throughput.md`. The \
         simulated device sends a recording, which takes it no time to measure, to the driver, which \
         acknowledges each column at once; 64 columns may be in flight. Each table is of one run; \
         a row as fast as it goes is the fastest of several scans. Only the relation of its rows \
         says something about another machine.\n\n\
         - **Way**: `memory` is a pair of pipes between two threads, 12 KiB each. On a pseudo-terminal, \
         and on USB, the device is a thread of the same program with the kernel in between; USB is \
         `vhci_hcd` with the vendor's interface (bulk) or a serial port (CDC-ACM).\n\
         - **On the wire**: all bytes that reach the driver, delimiters, stuffing, checksums and \
         heads of fragments included. A fragment has 15 samples (uniform) or 10 (listed).\n\
         - **Device waits for host**: it holds bytes that the way does not take (pipe or terminal \
         full; on USB, bytes that no transfer has fetched), or has no credit for the next column. \
         Measured in the simulator (`LineUse` in `sim-scanner/src/control.rs`).\n\
         - **Host waits for device**: the driver's thread is in a read and nothing is there. Measured \
         around the transport (`tests/throughput/src/host.rs`). While neither waits, both are at \
         work; on two threads both may wait at once while the kernel moves bytes.\n\
         - **Frames sent again**: frames that the device sent because the host asked for them. The \
         study fails if there is one.\n\n\
         Times and shares are from the first column that reached the driver's user to the last.\n\n\
         ## All ways, in the virtual machine\n\n\
         An emulated processor, shared with other work: all is slower than on a real one, computation \
         more than waiting.\n\n\
         {usb}\n\
         ## Without USB, on the machine itself\n\n\
         {TABLE_HEAD}\n{}\n\
         {}\n\n\
         ## Through the service\n\n\
         As fast as it takes them, from a device in memory: decoded, kept in a journal on disk, \
         acknowledged, and put on a grid while they come. The device is a thread of the same \
         program. Times are from the first columns kept to the end of the scan, when all columns \
         are in the journal and all nodes in the grid; the job is not waited for.\n\n\
         {}\n{}\n\
         ## A slow disk\n\n\
         A scan through the service, over a pseudo-terminal, on a disk that takes so much longer for \
         each sync of the journal. One sync serves 8 columns (`journal.sync_columns`) or what came in \
         its interval; the table stands while there is no credit. Times are from the first column \
         until the host closes the scan, having kept it. The study fails if a column is lost, or if the journal behind its \
         header, which holds name and time, differs from that on the quick disk in a byte.\n\n\
         {}\n{}",
        rows(ways),
        compared(ways),
        stream::TABLE_HEAD,
        rows(streams),
        disk::TABLE_HEAD,
        rows(disks)
    )
}
