//! Pace, credit and what is sent again.

use super::*;

#[test]
fn a_scan_brings_every_column_of_the_source_and_its_end() {
    let mut host = Host::ready();
    let messages = host.scan(64);
    assert!(messages.iter().any(|message| matches!(
        message,
        DeviceMessage::ScanAccepted(a) if a.columns == 12 && a.uniform && a.scan_id == 9
    )));
    assert_eq!(columns(&messages), (0..12).collect::<Vec<_>>());
    let end = end(&messages).expect("the scan is over");
    assert_eq!((end.columns, end.reason), (12, ScanEndReason::Complete));
    assert!(!host.status().laser_on);

    // What came is what the optics give, column by column and in any order.
    let source = source();
    let proposed = match &source {
        Source::Simulated { proposed, .. } => *proposed,
        Source::Replay(_) => panic!("simulated"),
    };
    for index in [11, 0, 5] {
        let expected = scanner(&source).column(&proposed, 0, index);
        let got: Vec<_> = fragments(&messages)
            .into_iter()
            .filter(|fragment| fragment.column == index)
            .flat_map(|fragment| fragment.samples())
            .collect();
        assert_eq!(got.len(), expected.samples.len());
        for (got, expected) in got.iter().zip(&expected.samples) {
            assert_eq!(got.lateral_counts, expected.lateral_counts);
            assert_eq!(got.reading.range_counts, expected.range_counts);
            assert_eq!(got.reading.no_return, expected.no_return);
            assert_eq!(got.reading.intensity, expected.intensity);
        }
    }
}

#[test]
fn the_end_is_repeated_until_the_scan_is_closed() {
    let mut host = Host::ready();
    host.scan(64);
    host.send(&Heartbeat {});
    host.told();
    host.link.pass(SECOND);
    let again: Vec<_> = host.told().into_iter().map(|(_, m)| m).collect();
    assert!(end(&again).is_some());
    let close = CloseScan { scan_id: 9 };
    assert!(matches!(host.ask(&close), DeviceMessage::ScanClosed(_)));
    host.link.pass(SECOND);
    assert!(host.told().is_empty());
    assert!(matches!(host.ask(&close), DeviceMessage::ScanClosed(_)));
}

#[test]
fn no_column_is_sent_beyond_the_credit_and_the_laser_waits_too() {
    let mut host = Host::ready();
    let messages = host.scan(3);
    assert_eq!(columns(&messages), [0, 1, 2]);
    let status = host.status();
    assert_eq!(status.activity, Activity::Waiting);
    assert!(!status.laser_on && status.columns == 3);
    assert_eq!(columns(&host.grant(2, 5)), [3, 4]);
    // Late and doubled grants do no harm, and none goes beyond what the device can keep.
    assert!(columns(&host.grant(0, 4)).is_empty());
    assert_eq!(columns(&host.grant(5, u32::MAX)).len(), 7);
}

#[test]
fn what_was_lost_comes_again_the_same() {
    let mut host = Host::ready();
    let messages = host.scan(64);
    let resend = |column, missing| Resend {
        scan_id: 9,
        column,
        missing,
    };
    host.send(&resend(4, Missing::whole()));
    let again: Vec<_> = host.told().into_iter().map(|(_, m)| m).collect();
    let of_4 = |messages: &[DeviceMessage]| -> Vec<ColumnFragment> {
        fragments(messages)
            .into_iter()
            .filter(|f| f.column == 4)
            .cloned()
            .collect()
    };
    assert_eq!(of_4(&again), of_4(&messages));
    assert_eq!(columns(&again), [4]);
    host.send(&resend(4, Missing::of([1])));
    let one: Vec<_> = host.told().into_iter().map(|(_, m)| m).collect();
    assert_eq!(of_4(&one), of_4(&messages)[1..2]);
    // An acknowledged column is forgotten, and one not measured is passed over.
    host.grant(5, 12);
    host.send(&resend(4, Missing::whole()));
    host.send(&resend(12, Missing::whole()));
    let none: Vec<_> = host.told().into_iter().map(|(_, m)| m).collect();
    assert!(fragments(&none).is_empty());
}

#[test]
fn the_line_rate_paces_the_columns() {
    let mut host = Host::switched_on(DeviceSettings {
        line_rate_hz: Some(4.0),
        table_speed_mm_s: f64::INFINITY,
        ..DeviceSettings::default()
    });
    host.greet(30_000);
    host.ask(&Home {});
    // At 0, 250, 500, 750 and 1000 ms.
    assert_eq!(columns(&host.scan(64)).len(), 5);
    host.link.pass(Duration::from_millis(249));
    assert!(host.told().is_empty());
    host.link.pass(Duration::from_millis(1));
    assert_eq!(host.status().columns, 6);
}
