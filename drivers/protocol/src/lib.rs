//! The wire protocol of the slide-table scanner: frames, messages and both ends' rules,
//! without I/O.
//!
//! Host and device both use this crate: the [`Decoder`] turns bytes into [`Packet`]s, the
//! enums [`HostMessage`] and [`DeviceMessage`] turn packets into messages, and
//! [`Frame::new`] turns a message into bytes. `docs/protocol.md` describes the same
//! bytes for somebody who writes firmware in another language.
//!
//! ```
//! use scanner_protocol::{Decoder, Frame, HostMessage, commands::Heartbeat};
//!
//! let frame = Frame::new(7, &Heartbeat {});
//! let mut decoder = Decoder::new();
//! let mut bytes = frame.as_bytes();
//! let packet = decoder.next(&mut bytes).expect("one whole frame went in");
//! assert_eq!(packet.tag, 7);
//! assert_eq!(HostMessage::decode(&packet), Ok(HostMessage::Heartbeat(Heartbeat {})));
//! ```
//!
//! The crate is `no_std` and allocates nothing; every buffer has a fixed size.
#![no_std]

pub mod commands;
pub mod events;
pub mod usb;

mod decoder;
mod faults;
mod frame;
mod identity;
mod message;
mod once;
mod wire;

pub use commands::{Calibration, Head, Limits, RejectReason, Rejected, ScanPlan};
pub use decoder::{Decoder, DecoderCounts, Packet};
pub use events::{
    Activity, ColumnEnd, ColumnFragment, Reading, ResetCause, Sample, ScanEnd, ScanEndReason,
    Status,
};
pub use faults::Faults;
pub use frame::{Frame, MAX_BODY, MAX_PAYLOAD, MAX_WIRE, crc32};
pub use identity::Identity;
pub use message::{DeviceMessage, HostMessage, Message, Request};
pub use once::OnceOnly;
pub use wire::{MAX_TEXT, MessageError, Reader, Text, Wire, Writer, text};

/// The oldest version of the messages this crate speaks.
pub const MIN_VERSION: u8 = 1;

/// The newest version of the messages this crate speaks.
pub const MAX_VERSION: u8 = 2;

/// Most samples in a column.
///
/// The wire counts samples in 16 bits. Both ends check what they are told against it.
pub const MAX_COLUMN_SAMPLES: u16 = u16::MAX;

/// Most fragments in a column: what the longest column needs with every lateral listed.
pub const MAX_COLUMN_FRAGMENTS: u16 = MAX_COLUMN_SAMPLES.div_ceil(events::LISTED_SAMPLES as u16);
