//! What goes wrong, and how a scan is taken up again.

use super::*;
use scanner_protocol::commands::Continue;

fn with(mishaps: Mishaps) -> Host {
    let mut host = Host::switched_on(DeviceSettings {
        mishaps,
        ..DeviceSettings::default()
    });
    host.greet(2000);
    host.ask(&Home {});
    host.link.pass(SECOND);
    host.told();
    host
}

fn go_on(host: &mut Host, first_column: u32) -> Vec<DeviceMessage> {
    let plan = host.plan();
    host.send(&Continue {
        scan_id: 10,
        credits: 64,
        first_column,
        plan,
    });
    host.link.pass(SECOND);
    host.told().into_iter().map(|(_, m)| m).collect()
}

#[test]
fn a_scan_taken_up_brings_the_same_columns() {
    let mut host = Host::ready();
    let whole = host.scan(64);
    host.ask(&CloseScan { scan_id: 9 });
    let rest = go_on(&mut host, 5);
    assert!(rest.iter().any(|message| matches!(
        message,
        DeviceMessage::ScanContinued(c) if c.columns == 12 && c.scan_id == 10
    )));
    assert_eq!(columns(&rest), (5..12).collect::<Vec<_>>());
    let readings = |messages: &[DeviceMessage]| {
        fragments(messages)
            .into_iter()
            .filter(|fragment| fragment.column >= 5)
            .map(|fragment| (fragment.column, fragment.laterals.clone()))
            .collect::<Vec<_>>()
    };
    assert_eq!(readings(&whole), readings(&rest));
    assert_eq!(end(&rest).map(|end| end.columns), Some(12));
}

#[test]
fn a_scan_is_not_taken_up_beyond_its_end() {
    let mut host = Host::ready();
    let plan = host.plan();
    let beyond = Continue {
        scan_id: 10,
        credits: 1,
        first_column: 12,
        plan,
    };
    assert_eq!(host.refusal(&beyond), RejectReason::Zero);
}

#[test]
fn the_interlock_stops_all_and_is_not_forgotten() {
    let mut host = Host::ready();
    host.link.device().step_columns(Some(2));
    host.scan(64);
    let now = host.link.now();
    host.link.device().set_interlock(true, now);
    assert!(!host.link.device().snapshot(now).laser_on);
    assert_eq!(host.refusal(&SetLaser { on: true }), RejectReason::Faulted);
    host.link.device().set_interlock(false, now);
    // A door that was opened and closed while nobody listened.
    host.greet(2000);
    assert_eq!(host.status().faults, Faults::INTERLOCK);
    assert_eq!(host.refusal(&Home {}), RejectReason::Faulted);
    host.ask(&ClearFaults {});
    assert!(matches!(host.ask(&Home {}), DeviceMessage::HomeStarted(_)));
}

#[test]
fn every_mishap_ends_the_scan_with_the_laser_off() {
    let sure = 0.5;
    let cases = [
        Mishaps {
            reset: sure,
            ..Mishaps::default()
        },
        Mishaps {
            table_stall: sure,
            ..Mishaps::default()
        },
        Mishaps {
            limit_switch: sure,
            ..Mishaps::default()
        },
        Mishaps {
            over_temperature: sure,
            ..Mishaps::default()
        },
        Mishaps {
            laser: sure,
            ..Mishaps::default()
        },
        Mishaps {
            interlock: sure,
            ..Mishaps::default()
        },
        Mishaps {
            move_part: sure,
            ..Mishaps::default()
        },
    ];
    for mishaps in cases {
        let mut host = with(mishaps);
        let got = columns(&host.scan(64));
        assert!(!got.is_empty() && got.len() < 12, "{mishaps:?}");
        let now = host.link.now();
        assert!(!host.link.device().snapshot(now).laser_on, "{mishaps:?}");
    }
}

#[test]
fn a_cause_goes_by_itself_and_its_bit_stays() {
    let mut host = with(Mishaps {
        over_temperature: 0.5,
        ..Mishaps::default()
    });
    host.scan(64);
    let status = host.status();
    assert_eq!(status.faults, Faults::OVER_TEMPERATURE);
    assert!(status.temperature_cdegc > 6_000);
    host.link.pass(2 * SECOND);
    assert_eq!(host.status().faults, Faults::OVER_TEMPERATURE);
    host.ask(&ClearFaults {});
    assert_eq!(host.status().faults, Faults::NONE);
}

#[test]
fn a_pulled_cable_comes_back_with_another_device_first() {
    let mut host = with(Mishaps {
        wrong_serial: 0.5,
        ..Mishaps::default()
    });
    host.scan(64);
    assert!(host.link.device().is_unplugged());
    host.link.pass(2 * SECOND);
    assert!(!host.link.device().is_unplugged());
    host.greet(2000);
    let serial = |host: &mut Host| match host.ask(&Identify {}) {
        DeviceMessage::Nameplate(nameplate) => nameplate.serial.to_string(),
        other => panic!("{other:?}"),
    };
    assert_ne!(serial(&mut host), "SIM-0001");
    host.link.pass(8 * SECOND);
    assert!(!host.link.device().is_unplugged());
    host.greet(2000);
    assert_eq!(serial(&mut host), "SIM-0001");
}

#[test]
fn a_moved_part_is_measured_elsewhere() {
    let mut host = Host::ready();
    let before = host.scan(64);
    host.ask(&CloseScan { scan_id: 9 });
    host.link
        .device()
        .move_part(crate::Vec3::new(0.0, 0.0, 2.0));
    let after = go_on(&mut host, 0);
    let middle = |messages: &[DeviceMessage]| {
        let found = fragments(messages)
            .into_iter()
            .find(|fragment| fragment.column == 6 && fragment.fragment == 1)
            .and_then(|fragment| fragment.samples().nth(5))
            .expect("the middle of the object");
        found.reading.range_counts
    };
    // 2 mm nearer, in counts of 0.1 mm, give or take the noise.
    let nearer = middle(&before) - middle(&after);
    assert!((15..=25).contains(&nearer), "{nearer}");
}
