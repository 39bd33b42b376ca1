//! From the first byte to the device's identity, and all that may answer in its place.

use std::time::Duration;

use scanner_driver::protocol::{Faults, Frame, RejectReason, commands::Heartbeat};
use scanner_driver::session::{Answer, Command};
use scanner_driver::{LinkSettings, ScannerError};

use crate::bench::{Bench, Mishaps};
use crate::device::Device;

#[test]
fn a_device_is_greeted_and_known() {
    let mut bench = Bench::ready(Device::new());
    assert!(bench.session.is_ready());
    let Ok(Answer::Status(status)) = bench.run(Command::Status) else {
        unreachable!("a healthy device tells its status");
    };
    assert!(!status.homed && !status.laser_on && status.faults.is_empty());
    assert_eq!(status.table_counts, None);
    assert_eq!(status.temperature_c, Some(31.5));
}

#[test]
fn commands_given_early_wait_for_the_greeting() {
    let mut bench = Bench::new(Device::new());
    assert_eq!(bench.run(Command::Home), Ok(Answer::Done));
    assert!(bench.device.homed);
}

#[test]
fn silence_is_a_timeout() {
    let mut bench = Bench::new(Device::new());
    bench.cut = true;
    bench.run_until("loss", |bench| bench.lost.is_some());
    let error = bench.lost.unwrap();
    assert!(matches!(error, ScannerError::Timeout { .. }), "{error:?}");
    assert_eq!(
        error.to_string(),
        "bench: no answer to the greeting from the scanner within 1.8 s"
    );
    assert!(bench.now < Duration::from_secs(2));
}

#[test]
fn a_modem_is_no_scanner() {
    let mut bench = Bench::new(Device::new());
    bench.cut = true;
    bench.run_for(Duration::from_millis(50));
    bench.babble(b"AT\r\n\r\nOK\r\n");
    bench.run_until("loss", |bench| bench.lost.is_some());
    let text = bench.lost.unwrap().to_string();
    assert_eq!(
        text,
        r#"bench answers, but not as a scanner: it says "AT\r\n\r\nOK\r\n""#
    );
}

#[test]
fn noise_raises_the_question_of_the_baud_rate() {
    let mut bench = Bench::new(Device::new());
    bench.cut = true;
    bench.babble(&[0xfe, 0x00, 0x80, 0xff, 0x1c, 0x41]);
    bench.run_until("loss", |bench| bench.lost.is_some());
    let text = bench.lost.unwrap().to_string();
    assert!(text.contains("baud rate"), "{text}");
}

#[test]
fn an_echo_is_known_as_one() {
    let mut bench = Bench::new(Device::new());
    bench.cut = true;
    bench.babble(Frame::new(1, &Heartbeat {}).as_bytes());
    bench.run_until("loss", |bench| bench.lost.is_some());
    let text = bench.lost.unwrap().to_string();
    assert!(text.contains("sends back what is sent"), "{text}");
}

#[test]
fn another_version_is_named() {
    let mut bench = Bench::new(Device {
        version: 9,
        ..Device::new()
    });
    bench.run_until("loss", |bench| bench.lost.is_some());
    assert_eq!(
        bench.lost,
        Some(ScannerError::Version {
            device_min: 9,
            device_max: 9,
            host_min: 1,
            host_max: 2
        })
    );
}

#[test]
fn junk_from_other_programs_does_not_keep_a_device_from_being_known() {
    let mut bench = Bench::new(Device::new());
    // What brltty and ModemManager send to any new serial port reaches the device.
    let now = bench.now;
    bench
        .device
        .receive(b"\x1b\x02\x00\xfeAT\r\nAT+GCAP\r\n", now);
    bench.babble(b"\xff\xff\xff garbage before the first frame");
    bench.run_until("ready", |bench| bench.ready > 0);
}

#[test]
fn a_request_repeated_is_carried_out_once() {
    for seed in 0..20 {
        // Half of all exchanges fail: six attempts would not do.
        let settings = LinkSettings {
            request_attempts: 30,
            silence: Duration::from_secs(10),
            ..LinkSettings::default()
        };
        let mut bench = Bench::with(Device::new(), settings, seed);
        bench.mishaps = Mishaps {
            lose: 0.3,
            ..Mishaps::default()
        };
        assert_eq!(bench.run(Command::Home), Ok(Answer::Done), "seed {seed}");
        assert_eq!(bench.device.homings, 1, "seed {seed}");
    }
}

#[test]
fn a_refusal_tells_why() {
    let mut bench = Bench::ready(Device::new());
    let error = bench.scan(3).unwrap_err();
    assert_eq!(
        error,
        ScannerError::Refused {
            command: "scan",
            reason: RejectReason::NotHomed,
            detail: 0
        }
    );
    assert_eq!(
        error.to_string(),
        "the scanner refused to scan: the table has not been homed"
    );
}

#[test]
fn heartbeats_keep_an_idle_device_alive() {
    let mut bench = Bench::ready(Device::new());
    bench.run_for(Duration::from_secs(20));
    assert_eq!(bench.device.faults, Faults::NONE);
    assert_eq!(bench.lost, None);
}

#[test]
fn a_device_with_a_short_dead_man_time_is_fed_in_time() {
    let mut bench = Bench::ready(Device {
        dead_man_limit_ms: 200,
        ..Device::new()
    });
    bench.run_for(Duration::from_secs(5));
    assert_eq!(bench.device.faults, Faults::NONE);
}

#[test]
fn a_device_without_a_dead_man_time_is_refused() {
    let mut bench = Bench::new(Device {
        dead_man_limit_ms: 0,
        ..Device::new()
    });
    bench.run_until("loss", |bench| bench.lost.is_some());
    assert_eq!(bench.ready, 0);
    let text = bench.lost.unwrap().to_string();
    assert!(text.contains("a dead-man time of 0 ms"), "{text}");
    assert!(text.contains("firmware"), "{text}");
}

#[test]
fn a_device_that_falls_silent_is_given_up() {
    let mut bench = Bench::ready(Device::new());
    bench.cut = true;
    let waiting = bench.command(Command::Status);
    bench.run_until("loss", |bench| bench.lost.is_some());
    assert!(matches!(
        bench.lost,
        Some(ScannerError::LostConnection { .. })
    ));
    assert!(bench.outcome(waiting).unwrap().is_err());
    assert_eq!(bench.session.deadline(), None);
}

#[test]
fn moves_and_the_laser_work() {
    let mut bench = Bench::ready(Device::homed());
    assert_eq!(bench.run(Command::Move(1234)), Ok(Answer::Done));
    assert_eq!(bench.device.table_counts, 1234);
    assert_eq!(bench.run(Command::Laser(true)), Ok(Answer::Done));
    assert!(bench.device.laser_on);
    assert_eq!(bench.run(Command::Abort), Ok(Answer::Done));
    assert!(!bench.device.laser_on);
}

#[test]
fn a_fault_ends_a_homing_and_can_be_cleared() {
    let mut bench = Bench::ready(Device::new());
    let homing = bench.command(Command::Home);
    bench.run_for(Duration::from_millis(100));
    let now = bench.now;
    bench.device.strike(Faults::TABLE_STALL, now);
    bench.run_until("failure", |bench| bench.outcome(homing).is_some());
    assert_eq!(
        bench.outcome(homing),
        Some(Err(ScannerError::Fault(Faults::TABLE_STALL)))
    );
    assert_eq!(
        bench.run(Command::ClearFaults(Faults::TABLE_STALL)),
        Ok(Answer::Done)
    );
}
