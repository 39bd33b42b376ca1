//! Scanners on USB: the one that the service is to use, and all that are there.

use std::path::PathBuf;

use rustix::fs::{Access, access};
use scanner_driver::UsbSettings;
use scanner_driver::transport::usb::{UsbDevice, list};

use super::finding::Finding;
use super::free;

const CHECK: &str = "scanner on USB";

/// What matters of a USB device.
#[derive(Debug, Clone)]
struct Seen {
    /// Numbers, product and serial number.
    text: String,
    serial: Option<String>,
    /// It is the one that is looked for.
    wanted: bool,
    /// It has an interface that speaks the scanner's protocol.
    is_scanner: bool,
    /// The kernel's driver that has this interface.
    driver: Option<String>,
    node: PathBuf,
    permitted: bool,
    group: String,
    holder: Option<String>,
    may_sleep: bool,
}

impl Seen {
    fn new(device: &UsbDevice, settings: &UsbSettings) -> Self {
        let interface = device.scanner_interface();
        Self {
            text: device.to_string(),
            serial: device.serial.clone(),
            wanted: settings.fits(device),
            is_scanner: interface.is_some(),
            driver: interface
                .and_then(|interface| interface.driver.clone())
                .filter(|driver| driver != "usbfs"),
            permitted: access(&device.node, Access::READ_OK | Access::WRITE_OK).is_ok(),
            group: device.group(),
            holder: device.holder(),
            may_sleep: device.may_sleep(),
            node: device.node.clone(),
        }
    }
}

/// Whether the scanner is there, permitted, and free for the service.
pub(super) fn check(settings: &UsbSettings) -> Vec<Finding> {
    match list() {
        Ok(devices) => {
            let seen: Vec<Seen> = devices.iter().map(|d| Seen::new(d, settings)).collect();
            judge(&settings.place(), &seen)
        }
        Err(error) => vec![Finding::bad(
            CHECK,
            error.to_string(),
            "USB does not work on this machine: look at the kernel's messages with dmesg",
        )],
    }
}

/// All scanners on USB, for those who look for the right numbers.
pub(super) fn present() -> Finding {
    const CHECK: &str = "USB scanners";
    let devices = list().unwrap_or_default();
    let scanners: Vec<String> = devices
        .iter()
        .filter(|device| device.scanner_interface().is_some())
        .map(|device| match device.holder() {
            Some(holder) => format!("{device}, used by {holder}"),
            None => device.to_string(),
        })
        .collect();
    Finding::good(
        CHECK,
        if scanners.is_empty() {
            "none with an interface of its own".to_owned()
        } else {
            scanners.join("; ")
        },
    )
}

fn judge(place: &str, seen: &[Seen]) -> Vec<Finding> {
    let wanted: Vec<&Seen> = seen.iter().filter(|device| device.wanted).collect();
    match wanted[..] {
        [] => vec![Finding::bad(
            CHECK,
            format!("there is no {place}"),
            there_instead(seen),
        )],
        [device] => judge_one(device),
        _ => {
            let serials: Vec<&str> = wanted
                .iter()
                .map(|device| device.serial.as_deref().unwrap_or("(none)"))
                .collect();
            vec![Finding::bad(
                CHECK,
                format!("{} devices are {place}", wanted.len()),
                format!("set scanner.serial_number to one of {}", serials.join(", ")),
            )]
        }
    }
}

fn judge_one(device: &Seen) -> Vec<Finding> {
    let Seen { text, node, .. } = device;
    if !device.is_scanner {
        return vec![Finding::bad(
            CHECK,
            format!("{text} has no scanner's interface"),
            "if it is a serial port, set scanner.transport to \"serial\"; else set \
             scanner.vendor_id and product_id to those of the scanner",
        )];
    }
    if !device.permitted {
        return vec![Finding::bad(
            CHECK,
            format!(
                "{text} may not be used by this user ({} belongs to the group {})",
                node.display(),
                device.group
            ),
            "install the udev rules (60-relief-scanner.rules), plug the scanner in anew, and add \
             the service's user to the group relief: usermod --append --groups relief USER",
        )];
    }
    if let Some(driver) = &device.driver {
        return vec![Finding::bad(
            CHECK,
            format!("the kernel's driver {driver} has taken {text}"),
            format!(
                "keep it away: echo 'blacklist {driver}' > /etc/modprobe.d/relief.conf, and plug \
                 the scanner in anew"
            ),
        )];
    }
    let mut findings = vec![match &device.holder {
        Some(holder) if !holder.contains("reliefd") => Finding::bad(
            CHECK,
            format!("{text} is in use by {holder}"),
            "end that program; two programs cannot share a scanner",
        ),
        Some(holder) => Finding::good(CHECK, format!("{text} is in the hands of {holder}")),
        None => Finding::good(CHECK, format!("{text} is there, permitted and {}", free())),
    }];
    if device.may_sleep {
        findings.push(Finding::doubtful(
            CHECK,
            format!("the kernel may put {text} to sleep"),
            "install the udev rules (60-relief-scanner.rules), which keep it awake, and plug it in \
             anew",
        ));
    }
    findings
}

fn there_instead(seen: &[Seen]) -> String {
    let scanners: Vec<&str> = seen
        .iter()
        .filter(|device| device.is_scanner)
        .map(|device| device.text.as_str())
        .collect();
    if scanners.is_empty() {
        "plug in and switch on the scanner; lsusb lists what is there, dmesg tells of trouble with \
         the cable"
            .to_owned()
    } else {
        format!(
            "set scanner.vendor_id, product_id and serial_number to those of one that is there: {}",
            scanners.join("; ")
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::finding::Grade;
    use super::*;

    fn scanner(serial: &str) -> Seen {
        Seen {
            text: format!("1209:0001 Scanner, serial {serial}"),
            serial: Some(serial.into()),
            wanted: true,
            is_scanner: true,
            driver: None,
            node: "/dev/bus/usb/001/002".into(),
            permitted: true,
            group: "relief".into(),
            holder: None,
            may_sleep: false,
        }
    }

    /// Grade, finding and remedy of the only or last finding.
    fn last(seen: &[Seen]) -> (Grade, String, String) {
        let finding = judge("1209:0001", seen).pop().unwrap();
        (
            finding.grade,
            finding.found,
            finding.remedy.unwrap_or_default(),
        )
    }

    #[test]
    fn a_scanner_that_is_free_or_the_services_own_is_good() {
        assert_eq!(last(&[scanner("1")]).0, Grade::Good);
        let (grade, found, _) = last(&[Seen {
            holder: Some("reliefd (process 7)".into()),
            ..scanner("1")
        }]);
        assert_eq!(grade, Grade::Good);
        assert!(found.contains("reliefd (process 7)"), "{found}");
    }

    #[test]
    fn each_trouble_is_named_with_its_remedy() {
        let other = Seen {
            wanted: false,
            text: "cafe:0001 Other scanner".into(),
            ..scanner("9")
        };
        for (seen, finds, mends) in [
            (vec![], "there is no 1209:0001", "plug in"),
            (vec![other], "there is no", "cafe:0001 Other scanner"),
            (
                vec![scanner("1"), scanner("2")],
                "2 devices",
                "scanner.serial_number to one of 1, 2",
            ),
            (
                vec![Seen {
                    is_scanner: false,
                    ..scanner("1")
                }],
                "no scanner's interface",
                "scanner.transport",
            ),
            (
                vec![Seen {
                    permitted: false,
                    group: "root".into(),
                    ..scanner("1")
                }],
                "/dev/bus/usb/001/002 belongs to the group root",
                "60-relief-scanner.rules",
            ),
            (
                vec![Seen {
                    driver: Some("usbtest".into()),
                    ..scanner("1")
                }],
                "driver usbtest has taken",
                "blacklist usbtest",
            ),
            (
                vec![Seen {
                    holder: Some("python3 (process 8)".into()),
                    ..scanner("1")
                }],
                "in use by python3 (process 8)",
                "end that program",
            ),
        ] {
            let (grade, found, remedy) = last(&seen);
            assert_eq!(grade, Grade::Bad, "{found}");
            assert!(found.contains(finds), "{found}");
            assert!(remedy.contains(mends), "{remedy}");
        }
        let (grade, found, _) = last(&[Seen {
            may_sleep: true,
            ..scanner("1")
        }]);
        assert_eq!(grade, Grade::Doubtful);
        assert!(found.contains("to sleep"), "{found}");
    }
}
