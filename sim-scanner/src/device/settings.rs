//! What a device is called, and how fast it is.

use core::time::Duration;

use scanner_protocol::MAX_VERSION;

use super::mishap::Mishaps;

/// Names and pace of a device.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceSettings {
    /// Name of the model.
    pub model: String,
    /// Serial number.
    pub serial: String,
    /// Version of the firmware.
    pub firmware: String,
    /// The newest version of the protocol it speaks.
    pub max_version: u8,
    /// Columns per second; `None` for as fast as credits allow.
    pub line_rate_hz: Option<f64>,
    /// Speed of the table on its way, millimetres per second; infinite for at once.
    pub table_speed_mm_s: f64,
    /// Where the table stands before it is homed, counts above its lower end.
    pub parked_counts: i32,
    /// Shortest dead-man time granted.
    pub dead_man_min: Duration,
    /// Longest dead-man time granted.
    pub dead_man_max: Duration,
    /// Columns kept for resending.
    pub credits_max: u16,
    /// How often the end of a scan is repeated until the host closes it.
    pub scan_end_repeat: Duration,
    /// Whether each scan has noise of its own (speckle stays the surface's). Otherwise equal
    /// scans are equal to the bit.
    pub fresh_noise: bool,
    /// Whether it notices that the cable is out, as on USB.
    pub feels_the_plug: bool,
    /// What goes wrong by itself.
    pub mishaps: Mishaps,
}

impl Default for DeviceSettings {
    fn default() -> Self {
        Self {
            model: "SimScanner".into(),
            serial: "SIM-0001".into(),
            firmware: env!("CARGO_PKG_VERSION").into(),
            max_version: MAX_VERSION,
            line_rate_hz: None,
            table_speed_mm_s: 200.0,
            parked_counts: 4_000,
            dead_man_min: Duration::from_millis(100),
            dead_man_max: Duration::from_secs(30),
            credits_max: 64,
            scan_end_repeat: Duration::from_millis(250),
            fresh_noise: false,
            feels_the_plug: false,
            mishaps: Mishaps::default(),
        }
    }
}
