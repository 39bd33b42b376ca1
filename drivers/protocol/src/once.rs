//! The device's memory of what it has answered, so that a retry is not carried out twice.

use crate::decoder::Packet;
use crate::frame::Frame;

/// The first version whose hosts number the requests of a session upwards.
const ASCENDING_SINCE_VERSION: u8 = 2;

/// Remembers the last request and its reply.
///
/// A host has one request open at a time and repeats it, byte for byte and with the same
/// request id, until it is answered. A device that asks this memory first carries each
/// request out once, however often the request or its reply is lost.
#[derive(Debug, Clone, Default)]
pub struct OnceOnly {
    last: Option<(Packet, Frame)>,
    /// The id of the last request carried out, where ids ascend.
    newest: Option<u16>,
}

impl OnceOnly {
    /// The memory at the start of a session that a greeting with this request id has opened, in
    /// this version.
    #[must_use]
    pub fn opened(tag: u16, version: u8) -> Self {
        Self {
            last: None,
            newest: (version >= ASCENDING_SINCE_VERSION).then_some(tag),
        }
    }

    /// The reply given before, if this very request was the last one answered.
    #[must_use]
    pub fn recall(&self, request: &Packet) -> Option<&Frame> {
        self.last
            .as_ref()
            .filter(|(answered, _)| answered == request)
            .map(|(_, reply)| reply)
    }

    /// Whether a request that is not the last one answered is from before it: a line with
    /// buffers has brought it late, or once more, and nobody waits for it.
    #[must_use]
    pub fn is_late(&self, request: &Packet) -> bool {
        self.newest.is_some_and(|newest| {
            let ahead = request.tag.wrapping_sub(newest);
            ahead == 0 || ahead > u16::MAX / 2
        })
    }

    /// Keeps the reply to a request that has been carried out.
    pub fn remember(&mut self, request: Packet, reply: Frame) {
        if let Some(newest) = &mut self.newest {
            *newest = request.tag;
        }
        self.last = Some((request, reply));
    }

    /// Forgets all, as at the device's start.
    pub fn forget(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Decoder;
    use crate::commands::{Home, HomeStarted};

    fn request(tag: u16) -> Packet {
        let frame = Frame::new(tag, &Home {});
        Decoder::new().next(&mut frame.as_bytes()).expect("a frame")
    }

    #[test]
    fn what_is_from_before_the_last_request_is_late_across_the_end_of_the_numbers() {
        let mut once = OnceOnly::opened(u16::MAX - 1, 2);
        assert!(once.is_late(&request(u16::MAX - 2)));
        assert!(!once.is_late(&request(u16::MAX)));
        once.remember(request(1), Frame::new(1, &HomeStarted {}));
        for late in [u16::MAX - 1, u16::MAX, 0, 1] {
            assert!(once.is_late(&request(late)), "{late}");
        }
        for new in [2, 3, 30_000] {
            assert!(!once.is_late(&request(new)), "{new}");
        }
        assert!(once.recall(&request(1)).is_some());
        // Nothing is said of the order in version 1.
        let mut once = OnceOnly::opened(9, 1);
        once.remember(request(10), Frame::new(10, &HomeStarted {}));
        assert!(!once.is_late(&request(3)));
    }
}
