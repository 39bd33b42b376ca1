//! The device's memory of what it has carried out, so that nothing is carried out twice.

use heapless::Deque;

use crate::commands::Home;
use crate::decoder::Packet;
use crate::frame::Frame;
use crate::message::Message;

/// Requests that are known again when they come late; see [`OnceOnly::is_late`].
const KNOWN_REQUESTS: usize = 32;

/// The first version in which late requests are passed over.
const PASSES_OVER_SINCE_VERSION: u8 = 2;

/// Remembers the last request and its reply, and which requests were before it.
///
/// A host has one request open at a time and repeats it, byte for byte and with the same
/// request id, until it is answered. A device that asks this memory first carries each
/// request out once, however often the request or its reply is lost.
#[derive(Debug, Clone, Default)]
pub struct OnceOnly {
    last: Option<(Packet, Frame)>,
    /// Tags and checksums of the requests answered of late, in this session and before.
    known: Deque<(u16, u32), KNOWN_REQUESTS>,
    passes_over: bool,
}

impl OnceOnly {
    /// A session has been opened in this version, by a `Hello` of this tag.
    ///
    /// What has a tag behind that one, by less than half of the circle of tags, can only come
    /// late from now on, and is remembered. The rest is forgotten, since the host is going to
    /// use those tags.
    pub fn opened(&mut self, version: u8, tag: u16) {
        self.last = None;
        self.known.retain(|(known, _)| is_behind(*known, tag));
        self.passes_over = version >= PASSES_OVER_SINCE_VERSION;
    }

    /// The reply given before, if this very request was the last one answered.
    #[must_use]
    pub fn recall(&self, request: &Packet) -> Option<&Frame> {
        self.last
            .as_ref()
            .filter(|(answered, _)| answered == request)
            .map(|(_, reply)| reply)
    }

    /// Whether a request that is not the last one answered has been answered before: a line
    /// with buffers has brought it once more, and nobody waits for it.
    #[must_use]
    pub fn is_late(&self, request: &Packet) -> bool {
        let checksum = request.checksum();
        self.passes_over && self.known.iter().any(|(_, known)| *known == checksum)
    }

    /// Keeps the reply to a request, whether it was carried out or refused: what was refused once
    /// may be possible when the line brings it once more.
    pub fn remember(&mut self, request: Packet, reply: Frame) {
        // Those of lower kinds only ask, and must not displace one that may be repeated.
        if request.kind < Home::KIND {
            return;
        }
        if self.known.is_full() {
            self.known.pop_front();
        }
        // There is room now.
        let _ = self.known.push_back((request.tag, request.checksum()));
        self.last = Some((request, reply));
    }

    /// Forgets all, as at the device's start.
    pub fn forget(&mut self) {
        *self = Self::default();
    }
}

/// Whether a tag was counted before this one, on the shorter way around the circle.
fn is_behind(tag: u16, this: u16) -> bool {
    (1..=u16::MAX / 2).contains(&this.wrapping_sub(tag))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Decoder;
    use crate::commands::{HomeStarted, Identify};

    fn packet<M: Message>(tag: u16, message: &M) -> Packet {
        let frame = Frame::new(tag, message);
        Decoder::new().next(&mut frame.as_bytes()).expect("a frame")
    }

    fn home(tag: u16) -> Packet {
        packet(tag, &Home {})
    }

    /// As a device that is asked for this.
    fn carry_out(once: &mut OnceOnly, tag: u16) {
        assert!(!once.is_late(&home(tag)), "{tag}");
        once.remember(home(tag), Frame::new(tag, &HomeStarted {}));
    }

    #[test]
    fn what_was_carried_out_before_is_known_again() {
        let mut once = OnceOnly::default();
        once.opened(2, u16::MAX);
        for tag in 0..40 {
            carry_out(&mut once, tag);
        }
        assert!(once.recall(&home(39)).is_some());
        assert!(!once.is_late(&home(7)), "so much is not remembered");
        assert!((8..40).all(|tag| once.is_late(&home(tag))));
        // Another host begins to count where it likes.
        once.opened(2, 37);
        assert!(once.recall(&home(39)).is_none());
        carry_out(&mut once, 39);
        carry_out(&mut once, 38);
        // Nothing but an answer comes of a question.
        once.remember(packet(9, &Identify {}), Frame::new(9, &HomeStarted {}));
        assert!(!once.is_late(&packet(9, &Identify {})));
        // One that came late displaces nothing that is still repeated.
        assert!(once.recall(&home(38)).is_some());
    }

    #[test]
    fn what_an_earlier_session_asked_for_is_known_where_it_can_only_be_late() {
        let mut once = OnceOnly::default();
        once.opened(2, 0xfff0);
        for tag in [0xfff1, 0xffff, 0, 1] {
            carry_out(&mut once, tag);
        }
        // The same host goes on counting.
        once.opened(2, 2);
        for tag in [0xfff1, 0xffff, 0, 1] {
            assert!(once.is_late(&home(tag)), "{tag}");
            assert!(once.recall(&home(tag)).is_none());
        }
        // A host that begins behind them is going to use those tags.
        once.opened(2, 0xfffe);
        assert!(once.is_late(&home(0xfff1)));
        for tag in [0xffff, 0, 1] {
            carry_out(&mut once, tag);
        }
    }

    #[test]
    fn in_version_1_nothing_is_passed_over() {
        let mut once = OnceOnly::default();
        once.opened(1, 0);
        carry_out(&mut once, 1);
        carry_out(&mut once, 2);
        assert!(!once.is_late(&home(1)));
    }
}
