//! The serial transport on a real pseudo-terminal.

use std::io;
use std::os::fd::OwnedFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{ControlModes, OptionalActions};
use scanner_driver::transport::serial::{SerialConnector, SerialSettings, list_ports, port_holder};
use scanner_driver::transport::{Connector, Transport};
use scanner_driver::{Scanner, ScannerError, SerialScanner};

use crate::bench::{expected, plan};
use crate::device::Device;
use crate::link::{Running, unhurried};

/// The device's end of a pseudo-terminal.
struct Master(OwnedFd);

/// Numbers of pseudo-terminals are used again at once: a driver that looks for its lost one
/// must not find another test's.
fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

fn pty() -> (Master, String) {
    let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
    let master = openpt(flags).unwrap();
    grantpt(&master).unwrap();
    unlockpt(&master).unwrap();
    let path = ptsname(&master, Vec::new()).unwrap().into_string().unwrap();
    (Master(master), path)
}

impl Master {
    fn wait(&self, flags: PollFlags, timeout: Duration) -> io::Result<bool> {
        let timeout = Timespec::try_from(timeout).map_err(io::Error::other)?;
        let mut fds = [PollFd::new(&self.0, flags)];
        poll(&mut fds, Some(&timeout))?;
        Ok(fds[0].revents().contains(flags))
    }
}

impl Transport for Master {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        if !self.wait(PollFlags::IN, timeout)? {
            // Without this the thread would spin while nobody has the other end open.
            if self.wait(PollFlags::HUP, Duration::ZERO)? {
                std::thread::sleep(Duration::from_millis(1));
            }
            return Ok(0);
        }
        match rustix::io::read(&self.0, buffer) {
            Ok(count) => Ok(count),
            // Nobody has the other end open; the device waits on.
            Err(rustix::io::Errno::IO) => Ok(0),
            Err(error) => Err(error.into()),
        }
    }

    fn write(&mut self, bytes: &[u8], timeout: Duration) -> io::Result<usize> {
        if !self.wait(PollFlags::OUT, timeout)? {
            return Ok(0);
        }
        Ok(rustix::io::write(&self.0, bytes)?)
    }
}

fn serve(device: Device) -> (Running, String) {
    let (master, path) = pty();
    let device = Device {
        dead_man_limit_ms: 60_000,
        ..device
    };
    (Running::serve(Arc::new(Mutex::new(device)), master), path)
}

fn open(path: &str) -> SerialScanner {
    let settings = SerialSettings {
        link: unhurried(),
        ..SerialSettings::new(path)
    };
    SerialScanner::open(settings).unwrap()
}

#[test]
fn a_scan_comes_whole_over_a_pseudo_terminal() {
    let _turn = turn();
    let (running, path) = serve(Device {
        columns_per_poll: 8,
        ..Device::homed()
    });
    let scanner = open(&path);
    let begun = Instant::now();
    let mut stream = scanner.start_scan(&plan(400)).unwrap();
    let acknowledger = stream.acknowledger();
    for index in 0..400 {
        assert_eq!(stream.next().unwrap(), Some(expected(index)));
        acknowledger.acknowledge(index);
    }
    assert_eq!(stream.next(), Ok(None));
    println!("{:.0} columns/s", 400.0 / begun.elapsed().as_secs_f64());
    assert_eq!(scanner.status().unwrap().line.bad_frames, 0);
    drop(stream);
    drop(scanner);
    assert!(!running.device.lock().unwrap().laser_on);
    // The port is free again.
    assert!(open(&path).identify().is_ok());
}

#[test]
fn no_such_port() {
    let port = "/dev/relief-no-such-port".to_owned();
    assert_eq!(
        open(&port).identify(),
        Err(ScannerError::NoSuchPort { port })
    );
}

#[test]
fn a_file_is_no_port() {
    let path = std::env::temp_dir().join(format!("relief-no-port-{}", std::process::id()));
    std::fs::write(&path, b"").unwrap();
    let port = path.to_str().unwrap().to_owned();
    let seen = open(&port).identify();
    std::fs::remove_file(&path).unwrap();
    assert_eq!(seen, Err(ScannerError::NotAPort { port }));
}

#[test]
fn a_busy_port_names_its_holder() {
    let _turn = turn();
    let (_running, path) = serve(Device::new());
    let first = open(&path);
    first.identify().unwrap();
    let error = open(&path).identify().unwrap_err();
    let ScannerError::PortBusy { port, holder } = &error else {
        unreachable!("the port is in use, and yet: {error}");
    };
    assert_eq!(*port, path);
    let holder = holder.as_deref().unwrap();
    assert!(
        holder.ends_with(&format!("(process {})", std::process::id())),
        "{holder}"
    );
    assert_eq!(port_holder(&path).as_deref(), Some(holder));
    // The first is none the worse.
    assert!(first.status().is_ok());
}

/// As by a child of some program that has not begun its own yet.
#[test]
fn a_port_that_is_let_go_in_a_moment_is_not_busy() {
    let _turn = turn();
    let (_running, path) = serve(Device::new());
    let holder = std::fs::File::open(&path).unwrap();
    holder.lock().unwrap();
    let lets_go = std::thread::spawn(move || {
        std::thread::sleep(std::time::Duration::from_millis(10));
        drop(holder);
    });
    open(&path).identify().unwrap();
    lets_go.join().unwrap();
}

#[test]
fn a_hang_up_in_a_scan_is_a_lost_connection() {
    let _turn = turn();
    let (mut running, path) = serve(Device::homed());
    let scanner = open(&path);
    let mut stream = scanner.start_scan(&plan(100_000)).unwrap();
    assert!(stream.next().is_ok());
    running.pull();
    let end = std::iter::repeat_with(|| stream.next()).find_map(Result::err);
    assert!(
        matches!(end, Some(ScannerError::LostConnection { .. })),
        "{end:?}"
    );
    // Another program may have got the number of the port by now: it is no scanner either.
    assert!(scanner.status().is_err());
}

#[test]
fn a_shell_is_no_scanner() {
    let _turn = turn();
    let (mut master, path) = pty();
    let over = Arc::new(AtomicBool::new(false));
    let heard = Arc::clone(&over);
    let chatter = std::thread::spawn(move || {
        while !heard.load(Ordering::Relaxed) {
            let _ = master.read(&mut [0; 64], Duration::from_millis(20));
            let _ = master.write(b"login: ", Duration::from_millis(20));
        }
    });
    let mut settings = SerialSettings::new(&path);
    // Only after all attempts is the device given up, for what was heard meanwhile.
    settings.link.request_timeout = Duration::from_millis(500);
    let error = SerialScanner::open(settings)
        .unwrap()
        .identify()
        .unwrap_err();
    over.store(true, Ordering::Relaxed);
    chatter.join().unwrap();
    assert!(
        matches!(&error, ScannerError::WrongDevice { heard, .. } if heard.contains("login: ")),
        "{error:?}"
    );
}

#[test]
fn a_device_that_does_not_read_blocks_nobody() {
    let _turn = turn();
    let (master, path) = pty();
    let mut connector = SerialConnector::new(&SerialSettings::new(&path));
    let mut transport = connector.connect().unwrap();
    let mut taken = 0;
    loop {
        match transport.write(&[b'x'; 1_000], Duration::ZERO).unwrap() {
            0 => break,
            count => taken += count,
        }
        assert!(taken < 1 << 24, "the line takes everything");
    }
    assert!(taken > 0);
    drop(master);
    let gone = std::iter::repeat_with(|| transport.read(&mut [0; 64], Duration::ZERO));
    assert!(gone.take(1_000).any(|read| read.is_err()));
}

#[test]
fn ports_can_be_listed() {
    // What is there depends on the machine; each is named and listed once.
    let ports = list_ports().unwrap();
    assert!(ports.iter().all(|port| port.path.starts_with('/')));
    assert!(ports.windows(2).all(|pair| pair[0].path < pair[1].path));
}

/// Boards that restart when their DTR drops would forget where their table is.
#[test]
fn closing_the_port_does_not_drop_the_modem_lines() {
    let _turn = turn();
    let (master, path) = pty();
    let hangs_up = |master: &Master| {
        let modes = rustix::termios::tcgetattr(&master.0).unwrap();
        modes.control_modes.contains(ControlModes::HUPCL)
    };
    // As the kernel has it for a port of hardware.
    let mut modes = rustix::termios::tcgetattr(&master.0).unwrap();
    modes.control_modes.insert(ControlModes::HUPCL);
    rustix::termios::tcsetattr(&master.0, OptionalActions::Now, &modes).unwrap();
    assert!(hangs_up(&master));
    let settings = SerialSettings::new(&path);
    let open = SerialConnector::new(&settings).connect().unwrap();
    assert!(!hangs_up(&master));
    drop(open);
    assert!(!hangs_up(&master));
}
