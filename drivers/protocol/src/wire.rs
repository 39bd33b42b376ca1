//! How values become bytes: little endian, no padding, no lengths taken on trust.

use core::fmt;

use crate::frame::MAX_PAYLOAD;

/// Most bytes in a [`Text`].
pub const MAX_TEXT: usize = 32;

/// A short text: printable ASCII, at most [`MAX_TEXT`] bytes.
pub type Text = heapless::String<MAX_TEXT>;

/// A [`Text`] from any string: unprintable and non-ASCII characters become `?`, and what
/// is too long is cut.
#[must_use]
pub fn text(from: &str) -> Text {
    let mut out = Text::new();
    for c in from.chars().take(MAX_TEXT) {
        let c = if matches!(c, ' '..='~') { c } else { '?' };
        if out.push(c).is_err() {
            break;
        }
    }
    out
}

/// Why the payload of a frame is not the message its kind announces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MessageError {
    /// No message of this direction has this kind.
    UnknownKind(u8),
    /// The payload ends before the message does.
    TooShort,
    /// The payload has this many bytes after the message's end.
    Trailing(usize),
    /// A field has a value that its type does not allow.
    BadValue,
}

impl fmt::Display for MessageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownKind(kind) => write!(f, "unknown kind of message 0x{kind:02x}"),
            Self::TooShort => f.write_str("message ends too early"),
            Self::Trailing(bytes) => write!(f, "{bytes} bytes too many after the message"),
            Self::BadValue => f.write_str("a field has a forbidden value"),
        }
    }
}

impl core::error::Error for MessageError {}

/// Collects the payload of one message.
#[derive(Debug, Default)]
pub struct Writer {
    bytes: heapless::Vec<u8, MAX_PAYLOAD>,
}

impl Writer {
    /// Appends bytes.
    ///
    /// No message is longer than a payload (a test sends the longest of each), so nothing
    /// is ever left out; should it be, the receiver refuses the message as too short.
    pub fn put(&mut self, bytes: &[u8]) {
        let fits = self.bytes.extend_from_slice(bytes);
        debug_assert!(fits.is_ok(), "a message is longer than a payload");
    }

    /// The payload so far.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// Takes the payload of one message apart.
#[derive(Debug)]
pub struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    /// Starts at the first byte of a payload.
    #[must_use]
    pub fn new(payload: &'a [u8]) -> Self {
        Self { rest: payload }
    }

    /// The next `count` bytes.
    ///
    /// # Errors
    /// [`MessageError::TooShort`] if there are fewer.
    pub fn take(&mut self, count: usize) -> Result<&'a [u8], MessageError> {
        let (taken, rest) = self
            .rest
            .split_at_checked(count)
            .ok_or(MessageError::TooShort)?;
        self.rest = rest;
        Ok(taken)
    }

    /// The next `N` bytes as an array.
    ///
    /// # Errors
    /// [`MessageError::TooShort`] if there are fewer.
    pub fn array<const N: usize>(&mut self) -> Result<[u8; N], MessageError> {
        let (taken, rest) = self
            .rest
            .split_first_chunk::<N>()
            .ok_or(MessageError::TooShort)?;
        self.rest = rest;
        Ok(*taken)
    }

    /// Checks that the payload is used up.
    ///
    /// # Errors
    /// [`MessageError::Trailing`] if it is not.
    pub fn finish(self) -> Result<(), MessageError> {
        match self.rest.len() {
            0 => Ok(()),
            bytes => Err(MessageError::Trailing(bytes)),
        }
    }
}

/// A value with one fixed way of being written.
pub trait Wire: Sized {
    /// Appends the value.
    fn put(&self, out: &mut Writer);

    /// Takes the value.
    ///
    /// # Errors
    /// What [`MessageError`] says.
    fn get(input: &mut Reader<'_>) -> Result<Self, MessageError>;
}

macro_rules! little_endian {
    ($($int:ty),*) => {$(
        impl Wire for $int {
            fn put(&self, out: &mut Writer) {
                out.put(&self.to_le_bytes());
            }

            fn get(input: &mut Reader<'_>) -> Result<Self, MessageError> {
                input.array().map(<$int>::from_le_bytes)
            }
        }
    )*};
}

little_endian!(u8, u16, u32, i16, i32, i64);

impl Wire for bool {
    fn put(&self, out: &mut Writer) {
        u8::from(*self).put(out);
    }

    fn get(input: &mut Reader<'_>) -> Result<Self, MessageError> {
        match u8::get(input)? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(MessageError::BadValue),
        }
    }
}

impl Wire for Text {
    fn put(&self, out: &mut Writer) {
        // MAX_TEXT is far below 256.
        (self.len() as u8).put(out);
        out.put(self.as_bytes());
    }

    fn get(input: &mut Reader<'_>) -> Result<Self, MessageError> {
        let len = usize::from(u8::get(input)?);
        if len > MAX_TEXT {
            return Err(MessageError::BadValue);
        }
        let bytes = input.take(len)?;
        if !bytes.iter().all(|b| matches!(b, b' '..=b'~')) {
            return Err(MessageError::BadValue);
        }
        let text = core::str::from_utf8(bytes).map_err(|_| MessageError::BadValue)?;
        Text::try_from(text).map_err(|_| MessageError::BadValue)
    }
}

/// Declares a message: its fields stand on the wire in the order written, without gaps.
macro_rules! message {
    (
        $(#[$doc:meta])*
        $name:ident = $kind:literal {
            $($(#[$field_doc:meta])* $field:ident: $type:ty,)*
        }
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Eq)]
        pub struct $name {
            $($(#[$field_doc])* pub $field: $type,)*
        }

        impl $crate::Message for $name {
            const KIND: u8 = $kind;
            const NAME: &'static str = stringify!($name);

            fn encode(&self, out: &mut $crate::Writer) {
                let _ = &out;
                $($crate::Wire::put(&self.$field, out);)*
            }

            fn decode(input: &mut $crate::Reader<'_>) -> Result<Self, $crate::MessageError> {
                let _ = &input;
                Ok(Self { $($field: $crate::Wire::get(input)?,)* })
            }
        }
    };
}

/// Declares an enumeration of one byte. Codes that this version does not know are kept as
/// `Other`, so that a newer device is still understood as far as possible.
macro_rules! codes {
    (
        $(#[$doc:meta])*
        $name:ident {
            $($(#[$item_doc:meta])* $item:ident = $code:literal => $says:literal,)*
        }
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $name {
            $($(#[$item_doc])* $item,)*
            /// A code that this version does not know.
            Other(u8),
        }

        impl $name {
            /// The byte on the wire.
            #[must_use]
            pub fn code(self) -> u8 {
                match self {
                    $(Self::$item => $code,)*
                    Self::Other(code) => code,
                }
            }

            /// What the byte means.
            #[must_use]
            pub fn from_code(code: u8) -> Self {
                match code {
                    $($code => Self::$item,)*
                    other => Self::Other(other),
                }
            }
        }

        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                match self {
                    $(Self::$item => f.write_str($says),)*
                    Self::Other(code) => write!(f, "unknown code {code}"),
                }
            }
        }

        impl $crate::Wire for $name {
            fn put(&self, out: &mut $crate::Writer) {
                $crate::Wire::put(&self.code(), out);
            }

            fn get(input: &mut $crate::Reader<'_>) -> Result<Self, $crate::MessageError> {
                <u8 as $crate::Wire>::get(input).map(Self::from_code)
            }
        }
    };
}

pub(crate) use {codes, message};
