//! What comes over the line.

use std::sync::LazyLock;
use std::time::Duration;

use scanner_driver::LinkSettings;
use scanner_driver::session::{Answer, Command, Event, Session, Ticket};
use scanner_protocol::{Decoder, DeviceMessage, Faults, Frame, HostMessage, Packet};
use sim_scanner::config::SimConfig;
use sim_scanner::device::DeviceSettings;
use sim_scanner::endpoint::memory::MemoryLink;
use sim_scanner::preset::Overrides;
use sim_scanner::source::Source;

const COLUMNS: u32 = 6;
const SAMPLES: u32 = 40;
/// More than this in one direction and nobody would have bounded it.
const MOST_BYTES: usize = 1 << 20;

/// Bytes to frames to messages of both directions; what is understood is written as it was
/// read.
pub fn protocol(data: &[u8]) {
    let mut decoder = Decoder::new();
    let mut rest = data;
    while let Some(packet) = decoder.next(&mut rest) {
        let framed = Frame::from_payload(packet.kind, packet.tag, &packet.payload);
        let mut bytes = framed.as_bytes();
        let again = Decoder::new().next(&mut bytes);
        assert_eq!(again.as_ref(), Some(&packet));
        if let Ok(message) = DeviceMessage::decode(&packet) {
            let again = decoded(&message.frame(packet.tag));
            assert_eq!(DeviceMessage::decode(&again), Ok(message));
        }
        if let Ok(message) = HostMessage::decode(&packet) {
            let again = decoded(&message.frame(packet.tag));
            assert_eq!(HostMessage::decode(&again), Ok(message));
        }
    }
    assert!(rest.is_empty());
    assert_eq!(decoder.counts().bytes, data.len() as u64);
    // Framed, the same bytes are a message of some kind.
    if let [kind, tag, payload @ ..] = data {
        let frame = Frame::from_payload(*kind, u16::from(*tag), payload);
        let packet = decoded(&frame);
        let _ = (DeviceMessage::decode(&packet), HostMessage::decode(&packet));
    }
}

fn decoded(frame: &Frame) -> Packet {
    let mut bytes = frame.as_bytes();
    match Decoder::new().next(&mut bytes) {
        Some(packet) => packet,
        None => panic!("a frame of ours cannot be read: {:?}", frame.as_bytes()),
    }
}

static SOURCE: LazyLock<(Source, DeviceSettings)> = LazyLock::new(|| {
    let config = SimConfig {
        overrides: Overrides {
            columns: Some(COLUMNS),
            samples: Some(SAMPLES),
            ..Overrides::default()
        },
        ..SimConfig::default()
    };
    match config.source() {
        Ok(source) => (source, config.device),
        Err(error) => panic!("{error}"),
    }
});

/// A host, a device, and between them a line that does what the bytes say.
struct Line {
    session: Session,
    device: MemoryLink,
    now: Duration,
    tickets: u64,
    columns: u32,
}

impl Line {
    fn open() -> Self {
        let (source, settings) = SOURCE.clone();
        Self {
            session: Session::new("fuzz", LinkSettings::default(), 0, Duration::ZERO),
            device: MemoryLink::new(source, settings, 1),
            now: Duration::ZERO,
            tickets: 0,
            columns: 0,
        }
    }

    /// Both ends hear each other, as often as they have something to say at this time.
    fn talk(&mut self) {
        for _ in 0..64 {
            let (there, back) = (self.session.take_output(), self.device.take());
            assert!(there.len() < MOST_BYTES && back.len() < MOST_BYTES);
            if there.is_empty() && back.is_empty() {
                break;
            }
            self.device.send(&there);
            self.hear(&back);
        }
    }

    fn hear(&mut self, bytes: &[u8]) {
        self.session.receive(bytes, self.now);
        self.heed();
    }

    fn heed(&mut self) {
        while let Some(event) = self.session.next_event() {
            match event {
                Event::Column(column) => {
                    assert_eq!(
                        column.index, self.columns,
                        "columns come in order, each once"
                    );
                    self.columns += 1;
                    self.session.acknowledge(column.index, self.now);
                }
                Event::Finished(ticket, answer) => {
                    assert!(ticket.0 < self.tickets);
                    // Only now: while a scan runs, another is refused, and the first goes on.
                    if let Ok(Answer::Scan(_)) = answer {
                        self.columns = 0;
                    }
                }
                Event::Lost(_) => {
                    let first_tag = self.session.next_tag();
                    self.session =
                        Session::new("fuzz", LinkSettings::default(), first_tag, self.now);
                }
                Event::Ready(_) | Event::ScanOver(_) => {}
            }
        }
    }

    fn pass(&mut self, time: Duration) {
        self.now += time;
        self.device.pass(time);
        self.session.poll(self.now);
        self.heed();
    }

    fn command(&mut self, command: Command) {
        self.session
            .command(Ticket(self.tickets), command, self.now);
        self.tickets += 1;
        self.heed();
    }
}

/// A session with a device, over a line on which anything may happen: bits flip, bytes go
/// missing or come from nowhere, sound frames with any content appear, time passes.
pub fn session(data: &[u8]) {
    let mut line = Line::open();
    line.talk();
    let mut scans = 0;
    let mut bytes = data.iter().copied();
    while let Some(step) = bytes.next() {
        let mut next = || bytes.next().unwrap_or_default();
        match step % 12 {
            0 => line.pass(Duration::from_millis(u64::from(next()))),
            1 => line.pass(Duration::from_millis(u64::from(next()) * 50)),
            2 => {
                let (place, bit) = (usize::from(next()), next() % 8);
                let mut back = line.device.take();
                if let Some(byte) = back.get_mut(place) {
                    *byte ^= 1 << bit;
                }
                line.hear(&back);
            }
            3 => {
                let (from, count) = (usize::from(next()), usize::from(next()));
                let mut back = line.device.take();
                let from = from.min(back.len());
                back.drain(from..(from + count).min(back.len()));
                line.hear(&back);
            }
            4 => {
                let noise: Vec<u8> = (0..next() % 64).map(|_| next()).collect();
                line.hear(&noise);
            }
            5 => {
                let (kind, _) =
                    DeviceMessage::KINDS[usize::from(next()) % DeviceMessage::KINDS.len()];
                let tag = u16::from(next());
                let payload: Vec<u8> = (0..next() % 118).map(|_| next()).collect();
                line.hear(Frame::from_payload(kind, tag, &payload).as_bytes());
            }
            6 => {
                let place = usize::from(next());
                let mut there = line.session.take_output();
                if let Some(byte) = there.get_mut(place) {
                    *byte ^= 0x10;
                }
                line.device.send(&there);
            }
            7 => line.command(Command::Status),
            8 => line.command(Command::Home),
            // Each takes some milliseconds to measure.
            9 if scans < 4 => {
                scans += 1;
                let plan = line.device.device().source().proposed();
                line.command(Command::Scan(plan));
            }
            10 => line.command(match next() % 4 {
                0 => Command::Abort,
                1 => Command::ClearFaults(Faults(u32::MAX)),
                2 => Command::Laser(true),
                _ => Command::Laser(false),
            }),
            _ => line.talk(),
        }
    }
    // Whatever was, a device that hears nothing turns its laser off.
    line.device.pass(Duration::from_secs(60));
    let end = line.device.now();
    assert!(!line.device.device().snapshot(end).laser_on);
}
