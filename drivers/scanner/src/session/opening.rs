//! The greeting: from the first byte to the device's identity.

use std::time::Duration;

use scanner_protocol::commands::{
    GetCalibration, GetLimits, Hello, HelloReply, Identify, Nameplate,
};
use scanner_protocol::{Calibration, Head, Identity, Limits, MAX_VERSION, MIN_VERSION};

use super::request::Purpose;
use super::{Event, Phase, Session};
use crate::error::ScannerError;
use crate::limits::HEARD_EXCERPT;

impl Session {
    /// Greets the device.
    pub(super) fn open(&mut self, now: Duration) {
        self.phase = Phase::Opening;
        self.identity = None;
        self.nameplate = None;
        self.calibration = None;
        let dead_man_ms = u16::try_from(self.settings.dead_man.as_millis()).unwrap_or(u16::MAX);
        self.requests.push(
            &Hello {
                min_version: MIN_VERSION,
                max_version: MAX_VERSION,
                dead_man_ms,
            },
            Purpose::Hello,
        );
        self.poll_requests(now);
    }

    pub(super) fn on_hello(&mut self, reply: &HelloReply) {
        if !(MIN_VERSION..=MAX_VERSION).contains(&reply.version) {
            let error = self.version_error(reply.version, reply.version);
            return self.lose(error);
        }
        // Nothing could be fed in that time, so that the laser would never stay on; and a
        // device that means "never" would leave it on with nobody there.
        if reply.dead_man_ms == 0 {
            return self.lose(ScannerError::Protocol(
                "it announces a dead-man time of 0 ms; it must turn the laser off by itself \
                 after some milliseconds of silence, so see to its firmware"
                    .to_owned(),
            ));
        }
        // A device that insists on a shorter time must be fed in that time.
        let dead_man = Duration::from_millis(u64::from(reply.dead_man_ms));
        let interval = (dead_man / 4).max(Duration::from_millis(1));
        self.settings.heartbeat_interval = self.settings.heartbeat_interval.min(interval);
        self.settings.request_timeout = self.settings.request_timeout.min(interval);
        self.boot_id = reply.boot_id;
        self.version = reply.version;
        self.requests.push(&Identify {}, Purpose::Nameplate);
    }

    pub(super) fn on_nameplate(&mut self, nameplate: Nameplate) {
        self.nameplate = Some(nameplate);
        self.requests.push(&GetCalibration {}, Purpose::Calibration);
    }

    pub(super) fn on_calibration(&mut self, calibration: Calibration) {
        // Columns in such counts would all lie in one place, and nobody could undo it later.
        if has_zero_count(&calibration) {
            return self.lose(ScannerError::Protocol(
                "its calibration gives a count the size of zero".to_owned(),
            ));
        }
        self.calibration = Some(calibration);
        self.requests.push(&GetLimits {}, Purpose::Limits);
    }

    pub(super) fn on_limits(&mut self, limits: Limits, now: Duration) {
        let (Some(nameplate), Some(calibration)) = (self.nameplate.take(), self.calibration.take())
        else {
            return;
        };
        if limits.max_credits == 0 || limits.max_samples == 0 {
            return self.lose(ScannerError::Protocol(
                "its limits allow no column or no sample".to_owned(),
            ));
        }
        let identity = Identity::new(nameplate, calibration, limits);
        self.identity = Some(identity.clone());
        self.phase = Phase::Ready;
        self.heard.clear();
        self.last_heard = now;
        self.status_asked = now;
        self.events.push_back(Event::Ready(Box::new(identity)));
        while let Some((ticket, command)) = self.waiting.pop_front() {
            self.command(ticket, command, now);
        }
    }

    pub(super) fn version_error(&self, device_min: u8, device_max: u8) -> ScannerError {
        ScannerError::Version {
            device_min,
            device_max,
            host_min: MIN_VERSION,
            host_max: MAX_VERSION,
        }
    }

    /// Keeps the first of what comes before the device is known, to show to the user.
    pub(super) fn note_heard(&mut self, bytes: &[u8]) {
        if self.phase == Phase::Opening {
            let room = HEARD_EXCERPT.saturating_sub(self.heard.len());
            self.heard.extend(bytes.iter().take(room));
        }
    }

    /// Why the greeting failed.
    pub(super) fn opening_failed(&self, purpose: &Purpose) -> ScannerError {
        if self.heard.is_empty() || !matches!(purpose, Purpose::Hello) {
            return ScannerError::Timeout {
                port: self.port.clone(),
                awaited: purpose.awaited(),
                after: self.settings.request_timeout * self.settings.request_attempts,
            };
        }
        let heard = if self.echoes > 0 {
            "it sends back what is sent to it (an echoing terminal or a loop-back plug)".to_owned()
        } else if self.unreadable > 0 {
            "its frames hold messages of another kind".to_owned()
        } else {
            let printable = self
                .heard
                .iter()
                .filter(|b| matches!(b, b' '..=b'~' | b'\r' | b'\n'))
                .count();
            let excerpt = self.heard.escape_ascii();
            if printable * 4 < self.heard.len() * 3 {
                format!("\"{excerpt}\" makes no sense (is the baud rate right?)")
            } else {
                format!("it says \"{excerpt}\"")
            }
        };
        ScannerError::WrongDevice {
            port: self.port.clone(),
            heard,
        }
    }
}

/// Whether some count stands for no distance or no angle.
fn has_zero_count(calibration: &Calibration) -> bool {
    calibration.table_count_pm == 0
        || match calibration.head {
            Head::Polar {
                angle_count_prad,
                range_count_pm,
                ..
            } => angle_count_prad == 0 || range_count_pm == 0,
            Head::Cartesian { count_pm } => count_pm == 0,
        }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_count_of_zero_is_noticed() {
        let polar = |angle_count_prad, range_count_pm| Head::Polar {
            camera_y_nm: 0,
            camera_z_nm: 0,
            angle_count_prad,
            range_count_pm,
        };
        let zero = |table_count_pm, head| {
            has_zero_count(&Calibration {
                table_count_pm,
                table_origin_nm: 0,
                head,
            })
        };
        assert!(!zero(1, polar(1, 1)));
        assert!(!zero(1, Head::Cartesian { count_pm: 1 }));
        assert!(zero(0, polar(1, 1)));
        assert!(zero(1, polar(0, 1)));
        assert!(zero(1, polar(1, 0)));
        assert!(zero(1, Head::Cartesian { count_pm: 0 }));
    }
}
