//! What turns the laser off and stops the table.

use super::*;

#[test]
fn a_silent_host_finds_laser_and_table_stopped() {
    let mut host = Host::ready();
    host.link.device().step_columns(Some(2));
    assert_eq!(columns(&host.scan(64)), [0, 1]);
    host.link.device().step_columns(Some(1));
    host.send(&Heartbeat {});
    host.told();
    host.link.pass(Duration::from_millis(1999));
    assert!(!host.link.device().events().contains(&Event::DeadMan));
    host.link.pass(Duration::from_millis(1));
    let events = host.link.device().events();
    assert!(events.contains(&Event::DeadMan));
    assert_eq!(
        events.iter().rev().find(|e| matches!(e, Event::Laser(_))),
        Some(&Event::Laser(false))
    );
    let told: Vec<_> = host.told().into_iter().map(|(_, m)| m).collect();
    let end = end(&told).expect("the scan has ended");
    assert_eq!(end.reason, ScanEndReason::DeadMan);
    assert!(end.faults.contains(Faults::DEAD_MAN));
    assert!(host.status().faults.contains(Faults::DEAD_MAN));
    host.ask(&ClearFaults {});
    assert!(host.status().faults.is_empty());
}

#[test]
fn an_echo_of_the_device_is_no_sign_of_a_host() {
    let mut host = Host::ready();
    host.link.device().step_columns(Some(2));
    host.scan(64);
    let status = DeviceMessage::Status(host.status());
    for _ in 0..4 {
        host.link.pass(SECOND / 2);
        host.link.send(status.frame(1).as_bytes());
    }
    assert!(host.link.device().events().contains(&Event::DeadMan));
}

#[test]
fn a_moving_table_stops_when_the_host_falls_silent() {
    let mut host = Host::ready();
    host.greet(500);
    host.ask(&Move {
        table_counts: 40_000,
    });
    host.link.pass(3 * SECOND);
    let status = host.status();
    assert_eq!(status.activity, Activity::Idle);
    // 200 mm/s for the half second of the dead-man time.
    assert_eq!(status.table_counts, 10_000);
}

#[test]
fn a_pulled_cable_stops_laser_and_table_at_once() {
    let mut host = Host::ready();
    host.link.device().step_columns(Some(2));
    host.scan(64);
    host.link.device().step_columns(Some(1));
    host.send(&Heartbeat {});
    host.told();
    let now = host.link.now();
    host.link.device().lose_line(now);
    let snapshot = host.link.device().snapshot(now);
    assert!(!snapshot.laser_on && snapshot.homed);
    host.link.pass(Duration::ZERO);
    let told: Vec<_> = host.told().into_iter().map(|(_, m)| m).collect();
    let end = end(&told).expect("the scan has ended");
    assert_eq!(end.reason, ScanEndReason::DeadMan);
    // At rest there is nothing to stop.
    let mut idle = Host::ready();
    let now = idle.link.now();
    idle.link.device().lose_line(now);
    assert!(!idle.link.device().events().contains(&Event::DeadMan));
}

#[test]
fn an_idle_device_does_not_mind_silence() {
    let mut host = Host::ready();
    host.link.pass(3600 * SECOND);
    assert!(host.status().faults.is_empty());
}

#[test]
fn abort_stops_everything_at_once() {
    let mut host = Host::ready();
    host.scan(4);
    assert!(matches!(host.ask(&Abort {}), DeviceMessage::Aborted(_)));
    let status = host.status();
    assert_eq!((status.activity, status.laser_on), (Activity::Idle, false));
    assert!(
        columns(&host.grant(4, 60)).is_empty(),
        "the scan is forgotten"
    );
    assert_eq!(columns(&host.scan(64)).len(), 12, "the next one is whole");
}

#[test]
fn a_late_copy_of_the_scan_request_starts_nothing_after_an_abort() {
    let mut host = Host::ready();
    let plan = host.plan();
    let scan = ScanRequest {
        scan_id: 9,
        credits: 2,
        plan,
    };
    let request = Frame::new(777, &scan);
    host.link.send(request.as_bytes());
    host.ask(&Abort {});
    host.link.send(request.as_bytes());
    assert_eq!(host.status().activity, Activity::Idle);
}

#[test]
fn faults_end_a_scan_and_must_be_mended_before_the_next() {
    let mut host = Host::ready();
    host.scan(4);
    let now = host.link.now();
    host.link.device().raise_faults(Faults::INTERLOCK, now);
    host.link.pass(Duration::from_millis(1));
    let told: Vec<_> = host.told().into_iter().map(|(_, m)| m).collect();
    let reason = end(&told).map(|end| (end.reason, end.faults));
    assert_eq!(reason, Some((ScanEndReason::Fault, Faults::INTERLOCK)));
    host.ask(&CloseScan { scan_id: 9 });
    assert_eq!(host.refusal(&SetLaser { on: true }), RejectReason::Faulted);
    let DeviceMessage::FaultsCleared(cleared) = host.ask(&ClearFaults {}) else {
        panic!("faults are cleared")
    };
    assert_eq!(
        cleared.remaining,
        Faults::INTERLOCK,
        "the cause is there still"
    );
    host.link.device().mend(Faults::INTERLOCK);
    host.ask(&ClearFaults {});
    assert_eq!(host.status().activity, Activity::Idle);
}

#[test]
fn a_reset_forgets_session_place_and_scan() {
    let mut host = Host::ready();
    let before = host.status().boot_id;
    host.scan(4);
    let now = host.link.now();
    host.link.device().send_garbage(&[7, 0, 0, 9, 9, 9]);
    host.link.device().reset(ResetCause::BrownOut, now);
    host.link.pass(Duration::from_millis(1));
    let told = host.told();
    assert!(
        told.iter().any(|(_, message)| matches!(
            message,
            DeviceMessage::Banner(banner) if banner.cause == ResetCause::BrownOut
        )),
        "found behind the garbage: {told:?}"
    );
    assert_eq!(host.refusal(&Heartbeat {}), RejectReason::NoSession);
    host.greet(1000);
    let status = host.status();
    assert!(!status.homed && !status.laser_on);
    assert_ne!(status.boot_id, before);
}

#[test]
fn a_fault_that_is_not_named_is_not_cleared() {
    let mut host = Host::ready();
    let now = host.link.now();
    for faults in [Faults::TABLE_STALL, Faults::INTERLOCK] {
        host.link.device().raise_faults(faults, now);
        host.link.device().mend(faults);
    }
    let named = ClearNamed {
        faults: Faults::TABLE_STALL | Faults::LASER,
    };
    let DeviceMessage::NamedCleared(cleared) = host.ask(&named) else {
        panic!("faults are cleared")
    };
    assert_eq!(cleared.remaining, Faults::INTERLOCK);
    assert_eq!(host.refusal(&Home {}), RejectReason::Faulted);
    // One whose cause is there still stays, named or not.
    host.link.device().raise_faults(Faults::INTERLOCK, now);
    let faults = Faults::INTERLOCK;
    let DeviceMessage::NamedCleared(cleared) = host.ask(&ClearNamed { faults }) else {
        panic!("faults are cleared")
    };
    assert_eq!(cleared.remaining, Faults::INTERLOCK);
    host.link.device().mend(Faults::INTERLOCK);
    host.ask(&ClearNamed { faults });
    assert_eq!(host.status().faults, Faults::NONE);
}

#[test]
fn a_device_of_version_1_clears_all_and_knows_no_names() {
    let mut host = Host::switched_on(DeviceSettings {
        max_version: 1,
        ..DeviceSettings::default()
    });
    let DeviceMessage::HelloReply(reply) = host.greet(2000) else {
        panic!("a session")
    };
    assert_eq!(reply.version, 1);
    let now = host.link.now();
    host.link.device().raise_faults(Faults::TABLE_STALL, now);
    host.link.device().mend(Faults::TABLE_STALL);
    let named = ClearNamed {
        faults: Faults::TABLE_STALL,
    };
    assert_eq!(host.refusal(&named), RejectReason::UnknownCommand);
    host.ask(&ClearFaults {});
    assert_eq!(host.status().faults, Faults::NONE);
}

#[test]
fn a_request_that_the_line_brings_late_lights_no_laser() {
    let mut host = Host::ready();
    host.scan(64);
    let scan_tag = host.tag;
    host.ask(&CloseScan { scan_id: 9 });
    let plan = host.plan();
    let again = Frame::new(
        scan_tag,
        &ScanRequest {
            scan_id: 9,
            credits: 64,
            plan,
        },
    );
    host.told();
    let log = host.link.device().events().len();
    host.link.send(again.as_bytes());
    host.link.pass(SECOND);
    assert_eq!(host.told(), [], "nobody waits for an answer");
    assert_eq!(host.link.device().events().len(), log);
    // What comes next is heard.
    assert!(matches!(host.ask(&Home {}), DeviceMessage::HomeStarted(_)));
    host.link.pass(SECOND);

    // The same after the line has been opened anew, by a host that counts on.
    host.greet(2000);
    host.told();
    let log = host.link.device().events().len();
    host.link.send(again.as_bytes());
    assert_eq!(host.told(), [], "nobody waits for an answer");
    assert_eq!(host.link.device().events().len(), log);

    // A host that begins to count there anew is heard.
    host.tag = scan_tag - 2;
    host.greet(2000);
    host.told();
    host.link.send(again.as_bytes());
    let tags: Vec<u16> = host.told().iter().map(|(tag, _)| *tag).collect();
    assert_eq!(tags, [scan_tag], "answered");
}

/// It could not be carried out then, and could be now, when nobody waits for it any more.
#[test]
fn a_refused_request_that_the_line_brings_late_lights_no_laser() {
    let mut host = Host::ready();
    let now = host.link.now();
    host.link.device().raise_faults(Faults::TABLE_STALL, now);
    host.scan(64);
    let scan_tag = host.tag;
    let plan = host.plan();
    let refused = Frame::new(
        scan_tag,
        &ScanRequest {
            scan_id: 9,
            credits: 64,
            plan,
        },
    );
    host.link.device().mend(Faults::TABLE_STALL);
    host.ask(&ClearFaults {});
    host.told();
    let log = host.link.device().events().len();
    host.link.send(refused.as_bytes());
    host.link.pass(SECOND);
    assert_eq!(host.told(), [], "nobody waits for an answer");
    assert_eq!(host.link.device().events().len(), log);
    assert!(matches!(host.ask(&Home {}), DeviceMessage::HomeStarted(_)));
}
