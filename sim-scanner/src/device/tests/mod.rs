//! The device in memory, with a clock that the test moves.

mod mishaps;
mod requests;
mod safety;
mod scans;

use core::time::Duration;

use scanner_protocol::commands::{
    Abort, ClearFaults, ClearNamed, CloseScan, GetLimits, Grant, Heartbeat, Hello, Home, Identify,
    Missing, Move, Resend, Scan as ScanRequest, SetLaser,
};
use scanner_protocol::{ColumnFragment, Decoder, DeviceMessage, MAX_VERSION, ScanEnd, ScanPlan};

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
