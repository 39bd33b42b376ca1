//! How fast each way to the device is, USB among them. The figures are of an emulated machine:
//! only their relation says something about another.

use anyhow::Result;
use scanner_driver::transport::serial::{SerialConnector, SerialSettings};
use scanner_driver::transport::usb::UsbConnector;
use scanner_driver::{LinkSettings, UsbSettings};
use sim_scanner::config::SimConfig;
use sim_scanner::device::DeviceSettings;
use sim_scanner::endpoint::usb::{Attachment, Personality, UsbServer};
use sim_scanner::source::Source;
use throughput::{Attached, Case, Encoding, TABLE_HEAD, fastest_of, memory, pseudo_terminal};

use crate::boot;
use crate::checks::{serial, wait_for_path};
use crate::scan::link;

/// Columns by samples of each: as many as take an emulated machine a second or two.
const SIZES: [(u32, u32); 2] = [(256, 240), (2000, 40)];

/// Scans of which the fastest counts.
const SCANS: u32 = 3;

/// As fast as it goes, and as slow as a table with a spinning mirror.
const LINE_RATES_HZ: [Option<f64>; 2] = [None, Some(50.0)];

type Way = (&'static str, fn(Source, DeviceSettings) -> Result<Attached>);

const WAYS: [Way; 4] = [
    ("memory", memory),
    ("pseudo-terminal", pseudo_terminal),
    ("USB, bulk", bulk),
    ("USB, CDC-ACM", cdc_acm),
];

/// A word of the kernel's command line: the whole table, and nothing else.
pub(crate) const ASKED_FOR: &str = "relief.throughput";

/// The whole table, or only its first rows beside the other checks.
pub(crate) fn table() -> Result<()> {
    let (rates, sizes, scans_at_most) = if boot::is_asked_for(ASKED_FOR) {
        (&LINE_RATES_HZ[..], &SIZES[..], SCANS)
    } else {
        (&LINE_RATES_HZ[..1], &SIZES[..1], 1)
    };
    println!("{TABLE_HEAD}");
    for &line_rate_hz in rates {
        for &(samples, columns) in sizes {
            for encoding in [Encoding::Uniform, Encoding::Listed] {
                let case = Case {
                    columns,
                    samples,
                    encoding,
                    line_rate_hz,
                };
                let source = case.source()?;
                for (way, attach) in WAYS {
                    // As many columns in flight as the simulator keeps.
                    let link = LinkSettings {
                        credits: 64,
                        ..link()
                    };
                    let scans = line_rate_hz.map_or(scans_at_most, |_| 1);
                    println!(
                        "{}",
                        fastest_of(scans, way, (&case, &source), &link, attach)?
                    );
                }
            }
        }
    }
    Ok(())
}

fn serve(source: Source, device: DeviceSettings, as_what: Personality) -> Result<UsbServer> {
    let config = SimConfig {
        device,
        ..SimConfig::default()
    };
    Ok(config.serve_usb(source, as_what, Attachment::ThisMachine)?)
}

fn bulk(source: Source, device: DeviceSettings) -> Result<Attached> {
    let settings = UsbSettings {
        serial: Some(device.serial.clone()),
        ..UsbSettings::default()
    };
    let server = serve(source, device, Personality::Vendor)?;
    let control = server.control();
    Ok(Attached::new(UsbConnector::new(&settings), control, server))
}

fn cdc_acm(source: Source, device: DeviceSettings) -> Result<Attached> {
    // Whatever was there before must be gone, or this becomes another port.
    wait_for_path(serial::PORT, false)?;
    let server = serve(source, device, Personality::CdcAcm)?;
    let connector = SerialConnector::new(&SerialSettings::new(serial::PORT));
    Ok(Attached::new(connector, server.control(), server))
}
