//! Sessions, requests and refusals.

use super::*;

#[test]
fn a_banner_comes_first_and_nothing_is_done_without_a_session() {
    let mut host = Host::switched_on(DeviceSettings::default());
    let told = host.told();
    assert!(
        matches!(told[..], [(_, DeviceMessage::Banner(_))]),
        "{told:?}"
    );
    assert_eq!(host.refusal(&Identify {}), RejectReason::NoSession);
    host.send(&Grant {
        scan_id: 9,
        acknowledged_below: 0,
        send_below: 5,
    });
    assert!(host.told().is_empty(), "a grant is never answered");
    assert!(matches!(host.ask(&Abort {}), DeviceMessage::Aborted(_)));
    let DeviceMessage::HelloReply(reply) = host.greet(1) else {
        panic!("a session opens")
    };
    assert_eq!(reply.dead_man_ms, 100, "brought within the limits");
    assert!(matches!(
        host.ask(&Identify {}),
        DeviceMessage::Nameplate(_)
    ));
    let stranger = Hello {
        min_version: 200,
        max_version: 201,
        dead_man_ms: 1000,
    };
    assert_eq!(host.refusal(&stranger), RejectReason::Version);
}

#[test]
fn homing_takes_its_time_and_comes_before_all_else() {
    let mut host = Host::switched_on(DeviceSettings::default());
    host.greet(2000);
    assert_eq!(
        host.refusal(&Move { table_counts: 5 }),
        RejectReason::NotHomed
    );
    assert!(matches!(host.ask(&Home {}), DeviceMessage::HomeStarted(_)));
    assert_eq!(host.status().activity, Activity::Homing);
    assert_eq!(host.refusal(&Home {}), RejectReason::Busy);
    // 4000 counts of 0.01 mm at 200 mm/s.
    host.link.pass(Duration::from_millis(199));
    assert!(!host.status().homed);
    host.link.pass(Duration::from_millis(1));
    let status = host.status();
    assert!(status.homed && status.activity == Activity::Idle && status.table_counts == 0);
    host.ask(&Move {
        table_counts: 20_000,
    });
    host.link.pass(Duration::from_millis(500));
    assert_eq!(host.status().table_counts, 10_000);
    assert_eq!(
        host.refusal(&Move { table_counts: -1 }),
        RejectReason::Busy,
        "busy is told before the limits"
    );
    host.link.pass(SECOND);
    assert_eq!(
        host.refusal(&Move { table_counts: -1 }),
        RejectReason::TableLimit
    );
}

#[test]
fn a_repeated_request_is_carried_out_once() {
    let mut host = Host::ready();
    let plan = host.plan();
    let request = Frame::new(
        777,
        &ScanRequest {
            scan_id: 9,
            credits: 2,
            plan,
        },
    );
    host.link.send(request.as_bytes());
    host.link.send(request.as_bytes());
    let replies: Vec<_> = host
        .told()
        .into_iter()
        .filter(|(tag, _)| *tag == 777)
        .collect();
    assert_eq!(replies.len(), 2);
    assert_eq!(replies[0], replies[1]);
    let starts = |e: &Event| matches!(e, Event::ScanStarted { .. });
    assert_eq!(
        host.link
            .device()
            .events()
            .into_iter()
            .filter(starts)
            .count(),
        1
    );
}

#[test]
fn plans_beyond_the_limits_are_refused_with_their_reason() {
    let mut host = Host::ready();
    let plan = host.plan();
    let cases = [
        (ScanPlan { columns: 0, ..plan }, RejectReason::Zero),
        (
            ScanPlan {
                angle_step_counts: 0,
                ..plan
            },
            RejectReason::Zero,
        ),
        (
            ScanPlan {
                columns: u32::MAX,
                ..plan
            },
            RejectReason::TooManyColumns,
        ),
        (
            ScanPlan {
                samples: u16::MAX,
                ..plan
            },
            RejectReason::TooManySamples,
        ),
        (
            ScanPlan {
                first_table_counts: -1,
                ..plan
            },
            RejectReason::TableLimit,
        ),
        (
            ScanPlan {
                pitch_counts: i32::MAX,
                ..plan
            },
            RejectReason::TableLimit,
        ),
        (
            ScanPlan {
                first_angle_counts: i32::MIN,
                ..plan
            },
            RejectReason::AngleLimit,
        ),
        (
            ScanPlan {
                exposure_us: 1,
                ..plan
            },
            RejectReason::Exposure,
        ),
    ];
    for (plan, reason) in cases {
        let request = ScanRequest {
            scan_id: 9,
            credits: 1,
            plan,
        };
        assert_eq!(host.refusal(&request), reason, "{plan:?}");
    }
    assert_eq!(host.status().activity, Activity::Idle);
}

#[test]
fn lost_and_spoilt_frames_are_lost_to_the_host_alone() {
    let mut host = Host::ready();
    host.link.device().drop_frames(1);
    host.send(&Heartbeat {});
    assert!(host.told().is_empty());
    host.link.device().corrupt_frames(1);
    host.send(&Heartbeat {});
    assert!(host.told().is_empty());
    assert!(host.decoder.counts().bad() > 0);
    host.status();
}

#[test]
fn any_bytes_are_taken_in_peace() {
    let mut host = Host::ready();
    let mut draws = Draws::keyed(1, Purpose::Line, &[]);
    for _ in 0..200 {
        let kind = draws.bits() as u8;
        let length = draws.bits() as usize % 80;
        let payload: Vec<u8> = (0..length).map(|_| draws.bits() as u8).collect();
        host.link
            .send(Frame::from_payload(kind, 1, &payload).as_bytes());
        host.link.send(&payload);
        host.link.pass(Duration::from_millis(7));
    }
    host.told();
    host.greet(1000);
    assert!(matches!(
        host.ask(&Identify {}),
        DeviceMessage::Nameplate(_)
    ));
}
