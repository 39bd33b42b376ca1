//! The device's thread over pipes in memory. What is awaited is awaited by events; no
//! outcome here depends on how fast the machine is.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use scanner_driver::transport::memory::{self, MemoryTransport};
use scanner_driver::transport::{Connector, Transport};
use scanner_driver::{LinkScanner, LinkSettings, Scanner, ScannerError};

use crate::bench::{expected, plan};
use crate::device::Device;

/// A device on a thread of its own, at the other end of a transport.
pub(crate) struct Running {
    pub(crate) device: Arc<Mutex<Device>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Running {
    pub(crate) fn serve(
        device: Arc<Mutex<Device>>,
        mut transport: impl Transport + 'static,
    ) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let (shared, stopped) = (Arc::clone(&device), Arc::clone(&stop));
        let thread = std::thread::spawn(move || {
            let start = Instant::now();
            let mut buffer = [0; 1024];
            while !stopped.load(Ordering::Relaxed) {
                let Ok(count) = transport.read(&mut buffer, Duration::from_millis(1)) else {
                    return;
                };
                let frames = {
                    let mut device = shared.lock().unwrap();
                    device.receive(&buffer[..count], start.elapsed());
                    device.poll(start.elapsed())
                };
                for frame in frames {
                    let mut rest = frame.as_bytes();
                    while !rest.is_empty() && !stopped.load(Ordering::Relaxed) {
                        match transport.write(rest, Duration::from_millis(10)) {
                            Ok(count) => rest = &rest[count..],
                            Err(_) => return,
                        }
                    }
                }
            }
        });
        Self {
            device,
            stop,
            thread: Some(thread),
        }
    }

    /// Pulls the cable: waits until the transport is gone.
    pub(crate) fn pull(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.pull();
    }
}

/// A connector over the transports that are put into the channel, one for each connection.
pub(crate) fn plug() -> (mpsc::Sender<MemoryTransport>, impl Connector) {
    let (sockets, plugged) = mpsc::channel::<MemoryTransport>();
    let connector = ("memory".to_owned(), move || {
        plugged
            .try_recv()
            .map(|end| Box::new(end) as Box<dyn Transport>)
            .map_err(|_| ScannerError::NoSuchPort {
                port: "memory".to_owned(),
            })
    });
    (sockets, connector)
}

/// Nothing is lost between these two, so that a thread that has to wait long for a busy
/// processor must not pass for a device that is gone.
pub(crate) fn unhurried() -> LinkSettings {
    LinkSettings {
        request_timeout: Duration::from_secs(20),
        dead_man: Duration::from_secs(60),
        silence: Duration::from_secs(120),
        resend_timeout: Duration::from_secs(20),
        column_timeout: Duration::from_secs(120),
        ..LinkSettings::default()
    }
}

pub(crate) fn connect(device: Device) -> (LinkScanner, Running, mpsc::Sender<MemoryTransport>) {
    connect_with(device, unhurried())
}

pub(crate) fn connect_with(
    device: Device,
    settings: LinkSettings,
) -> (LinkScanner, Running, mpsc::Sender<MemoryTransport>) {
    let (sockets, connector) = plug();
    let (ours, theirs) = memory::pair();
    sockets.send(ours).unwrap();
    let device = Device {
        dead_man_limit_ms: 60_000,
        ..device
    };
    let running = Running::serve(Arc::new(Mutex::new(device)), theirs);
    let scanner = LinkScanner::start(connector, settings).unwrap();
    (scanner, running, sockets)
}

/// Waits for something that the device's own thread will bring about.
pub(crate) fn eventually(what: &str, done: impl Fn() -> bool) {
    let until = Instant::now() + Duration::from_secs(30);
    while !done() {
        assert!(Instant::now() < until, "never: {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_scan_runs_from_start_to_end() {
    let (scanner, running, _sockets) = connect(Device::new());
    let identity = scanner.identify().unwrap();
    assert_eq!(identity.model.as_str(), "Bench");
    scanner.home().unwrap();
    let mut stream = scanner.start_scan(&plan(80)).unwrap();
    assert_eq!(stream.info().columns, 80);
    let acknowledger = stream.acknowledger();
    for index in 0..80 {
        assert_eq!(stream.next().unwrap(), Some(expected(index)));
        acknowledger.acknowledge(index);
    }
    assert_eq!(stream.next(), Ok(None));
    assert_eq!(stream.next(), Ok(None));
    eventually("the scan is closed", || {
        !running.device.lock().unwrap().has_scan()
    });
    assert!(scanner.status().unwrap().homed);
}

#[test]
fn a_slow_reader_holds_the_device_up_and_loses_nothing() {
    let (scanner, running, _sockets) = connect(Device {
        max_credits: 4,
        columns_per_poll: 100,
        ..Device::homed()
    });
    let mut stream = scanner.start_scan(&plan(50)).unwrap();
    eventually("the credit is used up", || {
        running.device.lock().unwrap().sent_columns() == 4
    });
    for index in 0..50 {
        assert_eq!(stream.next().unwrap(), Some(expected(index)));
        stream.acknowledger().acknowledge(index);
    }
    assert_eq!(stream.next(), Ok(None));
    assert_eq!(running.device.lock().unwrap().most_unacknowledged, 4);
}

#[test]
fn an_abort_from_another_thread_wakes_the_reader() {
    let (scanner, running, _sockets) = connect(Device {
        columns_per_poll: 0,
        ..Device::homed()
    });
    let mut stream = scanner.start_scan(&plan(50)).unwrap();
    let reader = std::thread::spawn(move || stream.next());
    scanner.abort().unwrap();
    assert_eq!(reader.join().unwrap(), Err(ScannerError::Aborted));
    assert!(!running.device.lock().unwrap().laser_on);
}

#[test]
fn dropping_the_stream_or_the_scanner_turns_the_laser_off() {
    let (scanner, running, _sockets) = connect(Device::homed());
    let stream = scanner.start_scan(&plan(100_000)).unwrap();
    assert!(running.device.lock().unwrap().laser_on);
    drop(stream);
    eventually("laser off", || !running.device.lock().unwrap().laser_on);

    let mut stream = scanner.start_scan(&plan(100_000)).unwrap();
    assert!(running.device.lock().unwrap().laser_on);
    drop(scanner);
    assert!(!running.device.lock().unwrap().laser_on);
    // The columns that had come are still there; then the stream ends.
    let end = std::iter::repeat_with(|| stream.next()).find(|next| !matches!(next, Ok(Some(_))));
    assert_eq!(end, Some(Err(ScannerError::Closed)));
}

#[test]
fn a_late_acknowledgement_does_not_count_for_the_next_scan() {
    let (scanner, running, _sockets) = connect(Device {
        max_credits: 4,
        ..Device::homed()
    });
    let first = scanner.start_scan(&plan(50)).unwrap();
    let late = first.acknowledger();
    drop(first);
    let mut second = scanner.start_scan(&plan(50)).unwrap();
    for index in 0..4 {
        assert_eq!(second.next().unwrap(), Some(expected(index)));
        late.acknowledge(index);
    }
    // A status goes the same way as the acknowledgements, after them.
    scanner.status().unwrap();
    scanner.status().unwrap();
    assert_eq!(running.device.lock().unwrap().sent_columns(), 4);
}

#[test]
fn a_pulled_cable_is_told_and_the_next_connection_is_found() {
    let (scanner, mut running, sockets) = connect(Device::homed());
    let mut stream = scanner.start_scan(&plan(100_000)).unwrap();
    assert!(stream.next().is_ok());
    running.pull();
    let end = std::iter::repeat_with(|| stream.next()).find_map(Result::err);
    assert!(
        matches!(&end, Some(ScannerError::LostConnection { why, .. }) if why.contains("unplugged")),
        "{end:?}"
    );
    assert!(matches!(
        scanner.identify(),
        Err(ScannerError::NoSuchPort { .. })
    ));

    let (ours, theirs) = memory::pair();
    sockets.send(ours).unwrap();
    let device = Arc::clone(&running.device);
    let _again = Running::serve(device, theirs);
    assert_eq!(scanner.identify().unwrap().serial.as_str(), "0001");
    let mut stream = scanner.start_scan(&plan(4)).unwrap();
    for index in 0..4 {
        assert_eq!(stream.next().unwrap(), Some(expected(index)));
    }
    assert_eq!(stream.next(), Ok(None));

    // Requests are counted through both connections, so that the device knows old ones again.
    let asked = running.device.lock().unwrap().asked.clone();
    assert!(asked.len() > 8, "{asked:?}");
    for pair in asked.windows(2) {
        let ahead = pair[1].wrapping_sub(pair[0]);
        assert!((1..=3).contains(&ahead), "{asked:?}");
    }
}

#[test]
fn contradictory_settings_are_refused_at_once() {
    let (_sockets, connector) = plug();
    let settings = LinkSettings {
        credits: 0,
        ..LinkSettings::default()
    };
    assert!(matches!(
        LinkScanner::start(connector, settings),
        Err(ScannerError::Settings(_))
    ));
}

/// Knows that a device has come when the test says so, and tells of attempts.
struct Watching<C> {
    connector: C,
    tried: Arc<AtomicBool>,
    came: Arc<AtomicBool>,
}

impl<C: Connector> Connector for Watching<C> {
    fn name(&self) -> String {
        self.connector.name()
    }

    fn connect(&mut self) -> Result<Box<dyn Transport>, ScannerError> {
        let outcome = self.connector.connect();
        self.tried.store(true, Ordering::Relaxed);
        outcome
    }

    fn appeared(&mut self) -> bool {
        self.came.swap(false, Ordering::Relaxed)
    }
}

#[test]
fn a_device_that_comes_is_not_kept_waiting_for_the_next_attempt() {
    const FOREVER: Duration = Duration::from_secs(1_000_000);
    let (sockets, connector) = plug();
    let came = Arc::new(AtomicBool::new(false));
    let tried = Arc::new(AtomicBool::new(false));
    let connector = Watching {
        connector,
        tried: Arc::clone(&tried),
        came: Arc::clone(&came),
    };
    let settings = LinkSettings {
        reconnect_first: FOREVER,
        reconnect_longest: FOREVER,
        ..unhurried()
    };
    let scanner = LinkScanner::start(connector, settings).unwrap();
    // It fails: there is nothing yet.
    eventually("first attempt", || tried.load(Ordering::Relaxed));
    let device = Device {
        dead_man_limit_ms: 60_000,
        ..Device::new()
    };
    let (ours, theirs) = memory::pair();
    let _running = Running::serve(Arc::new(Mutex::new(device)), theirs);
    sockets.send(ours).unwrap();
    came.store(true, Ordering::Relaxed);
    assert!(scanner.identify().is_ok());
}

#[test]
fn a_defect_costs_what_is_under_way_and_no_more() {
    let (ours, theirs) = memory::pair();
    let mut ends = vec![Some(ours), None];
    let connector = ("memory".to_owned(), move || match ends.pop() {
        Some(Some(end)) => Ok(Box::new(end) as Box<dyn Transport>),
        Some(None) => panic!("a defect made for this test"),
        None => Err(ScannerError::NoSuchPort {
            port: "memory".to_owned(),
        }),
    });
    let device = Arc::new(Mutex::new(Device::new()));
    let _running = Running::serve(device, theirs);
    let scanner = LinkScanner::start(connector, unhurried()).unwrap();
    // The thread connects by itself: whoever calls in time is told, and others find it mended.
    let identity = loop {
        match scanner.identify() {
            Ok(identity) => break identity,
            Err(error) => assert!(matches!(error, ScannerError::Defect { .. }), "{error}"),
        }
    };
    assert_eq!(identity.model.as_str(), "Bench");
}
