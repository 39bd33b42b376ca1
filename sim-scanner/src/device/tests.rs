use core::time::Duration;

use scanner_protocol::commands::{
    Abort, ClearFaults, CloseScan, GetLimits, Grant, Heartbeat, Hello, Home, Identify, Missing,
    Move, Resend, Scan as ScanRequest, SetLaser,
};
use scanner_protocol::{ColumnFragment, Decoder, DeviceMessage, ScanEnd, ScanPlan};

use super::*;
use crate::endpoint::memory::MemoryLink;
use crate::preset::{self, Overrides, Preset};
use crate::scanner::Scanner;

const SECOND: Duration = Duration::from_secs(1);

fn source() -> Source {
    let scene = preset::object("cylinder", Preset::Paper.material()).expect("built in");
    let overrides = Overrides {
        columns: Some(12),
        samples: Some(40),
        ..Overrides::default()
    };
    let (scanner, proposed) = Preset::Paper.set_up(scene, &overrides, 5).expect("fits");
    Source::Simulated {
        scanner: Box::new(scanner),
        proposed,
    }
}

fn scanner(source: &Source) -> &Scanner {
    match source {
        Source::Simulated { scanner, .. } => scanner,
        Source::Replay(_) => panic!("the source is simulated"),
    }
}

/// A host that asks one thing at a time.
struct Host {
    link: MemoryLink,
    decoder: Decoder,
    tag: u16,
}

impl Host {
    fn switched_on(settings: DeviceSettings) -> Self {
        Self {
            link: MemoryLink::new(source(), settings, 3),
            decoder: Decoder::new(),
            tag: 100,
        }
    }

    /// A host with a session on a homed device.
    fn ready() -> Self {
        let mut host = Self::switched_on(DeviceSettings::default());
        host.greet(2000);
        host.ask(&Home {});
        host.link.pass(SECOND);
        host.told();
        host
    }

    fn greet(&mut self, dead_man_ms: u16) -> DeviceMessage {
        self.ask(&Hello {
            min_version: MIN_VERSION,
            max_version: MAX_VERSION,
            dead_man_ms,
        })
    }

    fn send<M: Message>(&mut self, message: &M) {
        self.tag += 1;
        self.link.send(Frame::new(self.tag, message).as_bytes());
    }

    /// Everything the device has said, with tags.
    fn told(&mut self) -> Vec<(u16, DeviceMessage)> {
        let bytes = self.link.take();
        let mut bytes = bytes.as_slice();
        let mut messages = Vec::new();
        while let Some(packet) = self.decoder.next(&mut bytes) {
            let message = DeviceMessage::decode(&packet).expect("devices speak well");
            messages.push((packet.tag, message));
        }
        messages
    }

    /// The reply to a request; all else that has been said is forgotten.
    fn ask<M: Message>(&mut self, request: &M) -> DeviceMessage {
        self.send(request);
        let tag = self.tag;
        self.told()
            .into_iter()
            .find(|(other, message)| *other == tag && !is_unasked(message))
            .map(|(_, message)| message)
            .expect("every request is answered")
    }

    fn status(&mut self) -> Status {
        match self.ask(&Heartbeat {}) {
            DeviceMessage::Status(status) => status,
            other => panic!("{other:?}"),
        }
    }

    fn refusal<M: Message>(&mut self, request: &M) -> RejectReason {
        match self.ask(request) {
            DeviceMessage::Rejected(rejected) => {
                assert_eq!(rejected.request, M::KIND);
                rejected.reason
            }
            other => panic!("{other:?}"),
        }
    }

    fn plan(&mut self) -> ScanPlan {
        match self.ask(&GetLimits {}) {
            DeviceMessage::Limits(limits) => limits.proposed,
            other => panic!("{other:?}"),
        }
    }

    /// Starts the proposed scan, and lets the table arrive at its start.
    fn scan(&mut self, credits: u16) -> Vec<DeviceMessage> {
        let plan = self.plan();
        self.send(&ScanRequest {
            scan_id: 9,
            credits,
            plan,
        });
        self.link.pass(SECOND);
        self.told()
            .into_iter()
            .map(|(_, message)| message)
            .collect()
    }

    fn grant(&mut self, acknowledged_below: u32, send_below: u32) -> Vec<DeviceMessage> {
        self.send(&Grant {
            scan_id: 9,
            acknowledged_below,
            send_below,
        });
        self.told()
            .into_iter()
            .map(|(_, message)| message)
            .collect()
    }
}

fn is_unasked(message: &DeviceMessage) -> bool {
    matches!(
        message,
        DeviceMessage::Banner(_)
            | DeviceMessage::StatusChanged(_)
            | DeviceMessage::ColumnFragment(_)
            | DeviceMessage::ColumnEnd(_)
            | DeviceMessage::ScanEnd(_)
    )
}

fn fragments(messages: &[DeviceMessage]) -> Vec<&ColumnFragment> {
    messages
        .iter()
        .filter_map(|message| match message {
            DeviceMessage::ColumnFragment(fragment) => Some(fragment),
            _ => None,
        })
        .collect()
}

fn columns(messages: &[DeviceMessage]) -> Vec<u32> {
    messages
        .iter()
        .filter_map(|message| match message {
            DeviceMessage::ColumnEnd(end) => Some(end.column),
            _ => None,
        })
        .collect()
}

fn end(messages: &[DeviceMessage]) -> Option<&ScanEnd> {
    messages.iter().find_map(|message| match message {
        DeviceMessage::ScanEnd(end) => Some(end),
        _ => None,
    })
}

#[test]
fn a_banner_comes_first_and_nothing_is_done_without_a_session() {
    let mut host = Host::switched_on(DeviceSettings::default());
    let told = host.told();
    assert!(
        matches!(told[..], [(_, DeviceMessage::Banner(_))]),
        "{told:?}"
    );
    assert_eq!(host.refusal(&Identify {}), RejectReason::NoSession);
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
