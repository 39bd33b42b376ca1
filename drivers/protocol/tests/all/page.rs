//! The page for firmware authors says what this crate does: every example in it is decoded
//! and encoded again, and every message has one.

// A helper that panics fails its test, as it should.
#![allow(clippy::panic)]

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use scanner_protocol::{Decoder, DeviceMessage, Frame, HostMessage, Packet, crc32};

fn page() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/protocol.md");
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn hex(text: &str) -> Vec<u8> {
    text.split_whitespace()
        .map(|byte| u8::from_str_radix(byte, 16).unwrap_or_else(|_| panic!("not hex: {byte}")))
        .collect()
}

/// The `says`, `body`, `crc` and `frame` of each example.
fn examples(page: &str) -> Vec<[String; 4]> {
    let mut found = Vec::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        let Some(says) = line.strip_prefix("says ") else {
            continue;
        };
        let mut next = |label: &str| {
            let line = lines.next().unwrap_or_default();
            line.strip_prefix(label)
                .unwrap_or_else(|| panic!("no `{label}` after `{says}`, but `{line}`"))
                .trim()
                .to_owned()
        };
        found.push([
            says.trim().to_owned(),
            next("body "),
            next("crc "),
            next("frame "),
        ]);
    }
    found
}

fn only_packet(bytes: &[u8]) -> Packet {
    let mut decoder = Decoder::new();
    let packet = decoder.next(&mut &bytes[..]).expect("a frame");
    assert_eq!(decoder.counts().bad(), 0);
    packet
}

/// A message as the page writes it, with its kind.
fn read(packet: &Packet) -> String {
    let text = match HostMessage::decode(packet) {
        Ok(message) => format!("{message:?}"),
        Err(_) => format!("{:?}", DeviceMessage::decode(packet).expect("a message")),
    };
    // The enum's own name adds nothing: `Hello(Hello { .. })`.
    let inner = text.split_once('(').map_or(text.as_str(), |(_, rest)| rest);
    inner.strip_suffix(')').unwrap_or(inner).to_owned()
}

#[test]
fn every_example_is_what_the_encoder_makes() {
    let page = page();
    let examples = examples(&page);
    for [says, body, crc, frame] in &examples {
        let (body, frame) = (hex(body), hex(frame));
        let packet = only_packet(&frame);
        assert_eq!(read(&packet), *says);
        assert_eq!(hex(crc), crc32(&body).to_le_bytes(), "{says}");
        assert_eq!(hex(crc), packet.checksum().to_le_bytes(), "{says}");
        assert_eq!(body[0], packet.kind, "{says}");
        let again = Frame::from_payload(packet.kind, packet.tag, &body[3..]);
        assert_eq!(again.as_bytes(), frame, "{says}");
    }
}

#[test]
fn every_message_has_an_example_and_a_line_in_the_table() {
    let page = page();
    let shown: BTreeSet<u8> = examples(&page)
        .iter()
        .map(|[_, body, ..]| hex(body)[0])
        .collect();
    for (kind, name) in HostMessage::KINDS.iter().chain(DeviceMessage::KINDS) {
        assert!(shown.contains(kind), "no example of {name}");
        let row = format!("| 0x{kind:02x} | {name} |");
        assert!(page.contains(&row), "no line `{row}`");
    }
}

#[test]
fn the_numbers_of_usb_are_those_of_the_code() {
    use scanner_protocol::usb::{INTERFACE, PRODUCT_ID_CDC_ACM, PRODUCT_ID_VENDOR, VENDOR_ID};
    let page = page();
    for row in [
        format!(
            "| vendor and product number | 0x{VENDOR_ID:04x}:0x{PRODUCT_ID_VENDOR:04x} | \
             0x{VENDOR_ID:04x}:0x{PRODUCT_ID_CDC_ACM:04x} |"
        ),
        format!(
            "| interface class, subclass, protocol | 0x{:02x}, 0x{:02x}, 0x{:02x} |",
            INTERFACE.class, INTERFACE.subclass, INTERFACE.protocol
        ),
    ] {
        assert!(page.contains(&row), "no line `{row}`");
    }
}
