//! The driver against a small device of its own: session alone under simulated time, then
//! the thread over memory and over a pseudo-terminal.

// A helper that unwraps fails its test, as it should.
#![allow(clippy::unwrap_used, clippy::panic)]

mod bench;
mod device;
mod faults;
mod going_on;
mod hostile;
mod link;
mod opening;
mod pause;
mod pty;
mod recovery;
mod resume;
mod scans;
mod taken_up;
mod usb;
