//! The bytes of every message, version by version.

mod v1;
mod v2;

use scanner_protocol::{Decoder, DeviceMessage, Frame, HostMessage, Message};

/// The message is written as these bytes, and read back from them.
fn check<M: Message + PartialEq + std::fmt::Debug>(tag: u16, message: M, hex: &str) {
    let bytes: Vec<u8> = hex
        .split(' ')
        .map(|byte| u8::from_str_radix(byte, 16).expect("two hexadecimal digits"))
        .collect();
    assert_eq!(Frame::new(tag, &message).as_bytes(), bytes, "{}", M::NAME);
    let packet = Decoder::new().next(&mut &bytes[..]).expect("one frame");
    assert_eq!((packet.kind, packet.tag), (M::KIND, tag));
    let mut input = scanner_protocol::Reader::new(&packet.payload);
    assert_eq!(M::decode(&mut input).as_ref(), Ok(&message));
    assert_eq!(input.finish(), Ok(()));
    let known = HostMessage::decode(&packet).is_ok() || DeviceMessage::decode(&packet).is_ok();
    assert!(known, "{}", M::NAME);
}
