//! The device's memory of what it has answered, so that a retry is not carried out twice.

use crate::decoder::Packet;
use crate::frame::Frame;

/// Remembers the last request and its reply.
///
/// A host has one request open at a time and repeats it, byte for byte and with the same
/// request id, until it is answered. A device that asks this memory first carries each
/// request out once, however often the request or its reply is lost.
#[derive(Debug, Clone, Default)]
pub struct OnceOnly {
    last: Option<(Packet, Frame)>,
}

impl OnceOnly {
    /// The reply given before, if this very request was the last one answered.
    #[must_use]
    pub fn recall(&self, request: &Packet) -> Option<&Frame> {
        self.last
            .as_ref()
            .filter(|(answered, _)| answered == request)
            .map(|(_, reply)| reply)
    }

    /// Keeps the reply to a request that has been carried out.
    pub fn remember(&mut self, request: Packet, reply: Frame) {
        self.last = Some((request, reply));
    }

    /// Forgets all, as at a new session.
    pub fn forget(&mut self) {
        self.last = None;
    }
}
