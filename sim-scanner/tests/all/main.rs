//! All tests of the simulator.

mod losses;
mod presets;
mod program;
mod pty;
mod replay;
mod usbip;
