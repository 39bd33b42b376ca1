//! The messages of both directions.

use crate::commands::*;
use crate::decoder::Packet;
use crate::events::*;
use crate::wire::{MessageError, Reader, Writer};

/// A message: a kind, and fields in a fixed order.
pub trait Message: Sized {
    /// The first byte of the body.
    const KIND: u8;

    /// The message's name, for logs.
    const NAME: &'static str;

    /// Appends the fields.
    fn encode(&self, out: &mut Writer);

    /// Takes the fields.
    ///
    /// # Errors
    /// What [`MessageError`] says.
    fn decode(input: &mut Reader<'_>) -> Result<Self, MessageError>;
}

/// A message from the host that is answered, with the request's id as tag, by a message
/// of one type, or by [`Rejected`].
pub trait Request: Message {
    /// The answer when the request is granted.
    type Reply: Message;
}

macro_rules! direction {
    ($(#[$doc:meta])* $name:ident { $($(#[$item_doc:meta])* $message:ident,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Eq)]
        #[allow(clippy::large_enum_variant)] // Kept by value: nothing here may allocate.
        pub enum $name {
            $(#[doc = concat!("See [`", stringify!($message), "`].")] $message($message),)*
        }

        impl $name {
            /// The kinds of this direction, with the messages' names.
            pub const KINDS: &'static [(u8, &'static str)] =
                &[$(($message::KIND, $message::NAME),)*];

            /// The message in a packet.
            ///
            /// # Errors
            /// [`MessageError`], when the packet is not a message of this direction.
            pub fn decode(packet: &Packet) -> Result<Self, MessageError> {
                let mut input = Reader::new(&packet.payload);
                let message = match packet.kind {
                    $($message::KIND => Self::$message($message::decode(&mut input)?),)*
                    kind => return Err(MessageError::UnknownKind(kind)),
                };
                input.finish()?;
                Ok(message)
            }

            /// The message's name, for logs.
            #[must_use]
            pub fn name(&self) -> &'static str {
                match self {
                    $(Self::$message(_) => $message::NAME,)*
                }
            }

            /// Frames the message.
            #[must_use]
            pub fn frame(&self, tag: u16) -> crate::Frame {
                match self {
                    $(Self::$message(message) => crate::Frame::new(tag, message),)*
                }
            }
        }

        $(impl From<$message> for $name {
            fn from(message: $message) -> Self {
                Self::$message(message)
            }
        })*
    };
}

direction! {
    /// What a host sends.
    HostMessage {
        Hello,
        Identify,
        GetCalibration,
        GetLimits,
        Heartbeat,
        Home,
        Move,
        SetLaser,
        Scan,
        CloseScan,
        Abort,
        ClearFaults,
        Continue,
        ClearNamed,
        Grant,
        Resend,
    }
}

direction! {
    /// What a device sends.
    DeviceMessage {
        HelloReply,
        Nameplate,
        Calibration,
        Limits,
        Status,
        HomeStarted,
        MoveStarted,
        LaserSet,
        ScanAccepted,
        ScanClosed,
        Aborted,
        FaultsCleared,
        ScanContinued,
        NamedCleared,
        Rejected,
        Banner,
        StatusChanged,
        ColumnFragment,
        ColumnEnd,
        ScanEnd,
    }
}
