//! Bounds on what a device may announce. A damaged or hostile device must not make the host
//! reserve memory without end.

/// Most columns in a scan.
///
/// At the finest pitch in use (0.01 mm) over the longest table (2 m) there are 200,000;
/// four times that leaves room, and still keeps a scan's journal within what a disk holds.
pub const MAX_SCAN_COLUMNS: u32 = 800_000;

/// Most columns in flight, whatever the settings and the device say.
///
/// With the longest columns the protocol knows (65,535 samples of 12 bytes in memory) this
/// bounds the window at 200 MB; with the usual 256 samples it is below one.
pub const MAX_CREDITS: u16 = 256;

/// Most columns that are compared when a scan goes on, and as many again from before a gap in
/// the object. What lies in between is measured on the way.
pub const MAX_OVERLAP: u16 = 16;

/// Samples below which columns measured again prove little: an object that is moved before so
/// many of it have been measured, in [`MAX_OVERLAP`] columns in a row, may go on being measured
/// where it stands then.
pub const PROOF_SAMPLES: usize = 16;

/// Most bytes kept for sending. Heartbeats, grants and resend requests stop growing it
/// here, when a device does not read.
pub(crate) const MAX_OUTBOX: usize = 8 * 1024;

/// Most bytes kept of what a wrong device says, to show to the user.
pub(crate) const HEARD_EXCERPT: usize = 48;
