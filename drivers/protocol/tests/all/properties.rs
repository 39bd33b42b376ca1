//! Laws of the codec, on any input.

use proptest::collection::vec;
use proptest::prelude::*;
use scanner_protocol::commands::{Grant, Missing, Resend};
use scanner_protocol::events::{LISTED_SAMPLES, Laterals, UNIFORM_SAMPLES};
use scanner_protocol::{
    ColumnFragment, Decoder, DeviceMessage, Frame, HostMessage, MAX_PAYLOAD, MAX_WIRE, Packet,
    Reading, Sample,
};

/// All packets in these bytes, fed in pieces of this length.
fn packets(bytes: &[u8], piece: usize) -> (Vec<Packet>, Decoder) {
    let mut decoder = Decoder::new();
    let mut found = Vec::new();
    for mut chunk in bytes.chunks(piece) {
        while let Some(packet) = decoder.next(&mut chunk) {
            found.push(packet);
        }
        assert!(chunk.is_empty());
    }
    (found, decoder)
}

fn reading() -> impl Strategy<Value = Reading> {
    (any::<i32>(), any::<u8>(), any::<bool>(), any::<bool>()).prop_map(
        |(range_counts, intensity, no_return, saturated)| Reading {
            range_counts,
            intensity,
            no_return,
            saturated,
        },
    )
}

fn laterals() -> impl Strategy<Value = Laterals> {
    let uniform = (
        any::<i32>(),
        any::<i32>(),
        vec(reading(), 1..=UNIFORM_SAMPLES),
    )
        .prop_map(|(first_counts, step_counts, readings)| Laterals::Uniform {
            first_counts,
            step_counts,
            readings: readings.into_iter().collect(),
        });
    let listed = vec((any::<i32>(), reading()), 1..=LISTED_SAMPLES).prop_map(|samples| {
        Laterals::Listed(
            samples
                .into_iter()
                .map(|(lateral_counts, reading)| Sample {
                    lateral_counts,
                    reading,
                })
                .collect(),
        )
    });
    prop_oneof![uniform, listed]
}

fn fragment() -> impl Strategy<Value = ColumnFragment> {
    (
        (any::<u16>(), any::<u32>(), 0_u16..6_554, any::<i32>()),
        0_u16..65_000,
        laterals(),
    )
        .prop_map(
            |((scan_id, column, fragment, table_counts), first_sample, laterals)| ColumnFragment {
                scan_id,
                column,
                fragment,
                fragments: 6_554,
                first_sample,
                table_counts,
                laterals,
            },
        )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_are_survived(bytes in vec(any::<u8>(), 0..2_000), piece in 1_usize..300) {
        let (found, decoder) = packets(&bytes, piece);
        prop_assert_eq!(decoder.counts().bytes, bytes.len() as u64);
        prop_assert_eq!(decoder.counts().frames, found.len() as u64);
    }

    #[test]
    fn any_payload_of_any_kind_is_survived(kind: u8, tag: u16, payload in vec(any::<u8>(), 0..=MAX_PAYLOAD)) {
        let frame = Frame::from_payload(kind, tag, &payload);
        prop_assert!(frame.as_bytes().len() <= MAX_WIRE);
        let (found, _) = packets(frame.as_bytes(), 7);
        prop_assert_eq!(found.len(), 1);
        prop_assert_eq!((found[0].kind, found[0].tag), (kind, tag));
        prop_assert_eq!(&found[0].payload[..], &payload[..]);
        // What can be read is written the same again: each message has one encoding.
        if let Ok(message) = HostMessage::decode(&found[0]) {
            prop_assert_eq!(message.frame(tag), frame.clone());
        }
        if let Ok(message) = DeviceMessage::decode(&found[0]) {
            prop_assert_eq!(message.frame(tag), frame);
        }
    }

    #[test]
    fn frames_after_garbage_are_found(
        garbage in vec(any::<u8>(), 0..1_000),
        tags in vec(any::<u16>(), 1..5),
        piece in 1_usize..300,
    ) {
        let mut bytes = garbage;
        for tag in &tags {
            bytes.extend_from_slice(Frame::new(*tag, &Grant {
                scan_id: 1,
                acknowledged_below: 2,
                send_below: 0,
            }).as_bytes());
        }
        let (found, _) = packets(&bytes, piece);
        let last: Vec<u16> = found[found.len() - tags.len()..].iter().map(|p| p.tag).collect();
        prop_assert_eq!(last, tags);
    }

    #[test]
    fn the_way_bytes_are_cut_makes_no_difference(bytes in vec(0_u8..4, 0..500), piece in 1_usize..50) {
        prop_assert_eq!(packets(&bytes, piece).0, packets(&bytes, 1_000).0);
    }

    #[test]
    fn one_wrong_bit_is_always_noticed(payload in vec(any::<u8>(), 0..=MAX_PAYLOAD), at: prop::sample::Index, bit in 0..8) {
        let frame = Frame::from_payload(0xc2, 9, &payload);
        let mut bytes = frame.as_bytes().to_vec();
        // The delimiters stand between frames; damage to one of them is the next test.
        let inner = 1 + at.index(bytes.len() - 2);
        bytes[inner] ^= 1_u8 << bit;
        let (found, decoder) = packets(&bytes, 64);
        prop_assert!(found.is_empty());
        prop_assert!(decoder.counts().bad() > 0);
    }

    #[test]
    fn a_lost_delimiter_costs_nothing(tag: u16) {
        let grant = Grant { scan_id: 1, acknowledged_below: 2, send_below: 3 };
        let frame = Frame::new(tag, &grant);
        // The delimiter at the end of one frame or at the start of the next is missing.
        let bytes = [frame.as_bytes(), &frame.as_bytes()[1..]].concat();
        prop_assert_eq!(packets(&bytes, 64).0.len(), 2);
    }

    #[test]
    fn fragments_come_back_as_they_went(fragment in fragment(), tag: u16) {
        let (found, _) = packets(Frame::new(tag, &fragment).as_bytes(), 1);
        prop_assert_eq!(DeviceMessage::decode(&found[0]), Ok(DeviceMessage::ColumnFragment(fragment)));
    }

    #[test]
    fn bitmaps_come_back_as_they_went(first in 0_u16..6_000, mut offsets in vec(0_u16..512, 1..40)) {
        offsets.sort_unstable();
        offsets.dedup();
        let wanted: Vec<u16> = offsets.iter().map(|offset| first + offset - offsets[0]).collect();
        let resend = Resend { scan_id: 3, column: 4, missing: Missing::of(wanted.iter().copied()) };
        let (found, _) = packets(Frame::new(5, &resend).as_bytes(), 1);
        let Ok(HostMessage::Resend(back)) = HostMessage::decode(&found[0]) else {
            return Err(TestCaseError::fail("not a resend request"));
        };
        let asked: Vec<u16> = (0..7_000).filter(|f| back.missing.contains(*f)).collect();
        prop_assert_eq!(asked, wanted);
    }
}

#[test]
fn lengths_and_counts_are_not_taken_on_trust() {
    let check = |kind: u8, payload: &[u8]| {
        let frame = Frame::from_payload(kind, 0, payload);
        let (found, _) = packets(frame.as_bytes(), 200);
        assert!(DeviceMessage::decode(&found[0]).is_err());
        assert!(HostMessage::decode(&found[0]).is_err());
    };
    // A text of 33 bytes; one of 255 bytes that are not there; one with a control character.
    check(0x82, &[&[33][..], &[b'a'; 33], &[0, 0]].concat());
    check(0x82, &[255, b'a', 0, 0]);
    check(0x82, &[1, 7, 0, 0]);
    // A bitmap of 65 bytes.
    check(
        0x41,
        &[&[1, 0, 0, 0, 0, 0, 0, 0, 65][..], &[1; 65]].concat(),
    );
    // A fragment without samples; with more than fit; beyond the last; of an unknown layout.
    let fragment = |fragment: u8, layout: u8, count: u8| {
        let head = [1, 0, 0, 0, 0, 0, fragment, 0, 2, 0, 0, 0, 0, 0, 0, 0];
        [&head[..], &[layout, count], &[0; 8], &[0; 90]].concat()
    };
    check(0xc2, &fragment(0, 0, 0));
    check(0xc2, &fragment(0, 0, 16));
    check(0xc2, &fragment(2, 0, 15));
    check(0xc2, &fragment(0, 2, 15));
    // The same, but right.
    let right = Frame::from_payload(0xc2, 0, &fragment(1, 0, 15));
    let (found, _) = packets(right.as_bytes(), 200);
    assert!(DeviceMessage::decode(&found[0]).is_ok());
    // A flag that is neither 0 nor 1, and a byte too many.
    check(0x88, &[2]);
    check(0x88, &[1, 0]);
}

#[test]
fn what_is_wrong_with_a_line_is_counted() {
    let good = Frame::from_payload(1, 2, &[3]);
    let mut bad = good.as_bytes().to_vec();
    bad[3] ^= 0x10;
    let too_long = [1; 200];
    let bytes = [
        good.as_bytes(),
        &bad,
        &too_long,
        good.as_bytes(),
        &[5, 1, 0],
        good.as_bytes(),
    ]
    .concat();
    let (found, decoder) = packets(&bytes, 11);
    let counts = decoder.counts();
    assert_eq!(found.len(), 3);
    assert_eq!(
        (
            counts.frames,
            counts.bad_checksum,
            counts.malformed,
            counts.too_long
        ),
        (3, 1, 1, 1)
    );
}
