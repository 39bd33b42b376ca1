//! Where a device meets a host.

pub mod memory;
pub mod pty;
pub mod usb;
