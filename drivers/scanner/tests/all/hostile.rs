//! Devices that say anything at all: the session neither panics nor takes more than it
//! granted.

use proptest::collection::vec;
use proptest::prelude::*;
use scanner_driver::protocol::{DeviceMessage, Frame};
use scanner_driver::session::Command;

use crate::bench::{Bench, plan};
use crate::device::Device;

/// A bench whose device measures, up to the credit of 16 columns.
fn scanning() -> Bench {
    let mut bench = Bench::ready(Device::homed());
    bench.acknowledge = false;
    assert!(bench.run(Command::Scan(plan(1_000))).is_ok());
    bench
}

fn assert_bounded(bench: &Bench) {
    assert!(bench.columns.len() <= 16, "more columns than credit");
    for (index, column) in (0..).zip(&bench.columns) {
        assert_eq!(column.index, index);
        assert!(column.samples.len() <= 2_000, "more samples than the limit");
    }
}

/// Good frames of every kind with any payload, most of them about the running scan.
fn frames() -> impl Strategy<Value = Vec<u8>> {
    let kinds = DeviceMessage::KINDS.len();
    let frame = (0..kinds, 0_u16..40, vec(any::<u8>(), 0..118), 0_u8..20);
    vec(frame, 1..60).prop_map(|frames| {
        frames
            .into_iter()
            .flat_map(|(kind, tag, mut payload, column)| {
                // The scan's number is 1; small columns are those in flight.
                for (at, value) in [1, 0, column, 0, 0, 0].into_iter().enumerate() {
                    if let Some(byte) = payload.get_mut(at) {
                        *byte = value;
                    }
                }
                let frame = Frame::from_payload(DeviceMessage::KINDS[kind].0, tag, &payload);
                frame.as_bytes().to_vec()
            })
            .collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_while_opening(chunks in vec(vec(any::<u8>(), 0..200), 0..20)) {
        let mut bench = Bench::new(Device::new());
        for chunk in chunks {
            bench.babble(&chunk);
            bench.step();
        }
        bench.run_until("ready", |bench| bench.ready > 0);
    }

    #[test]
    fn any_bytes_in_a_scan(chunks in vec(vec(any::<u8>(), 0..200), 0..20)) {
        let mut bench = scanning();
        for chunk in chunks {
            bench.babble(&chunk);
            bench.step();
        }
        assert_bounded(&bench);
    }

    #[test]
    fn any_messages_in_a_scan(bytes in frames()) {
        let mut bench = scanning();
        bench.babble(&bytes);
        for _ in 0..20 {
            bench.step();
        }
        assert_bounded(&bench);
    }
}
