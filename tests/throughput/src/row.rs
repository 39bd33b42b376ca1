//! What was measured.

use std::fmt;
use std::time::Duration;

use crate::{Case, Encoding};

/// The head of the table whose rows [`Row`] writes.
pub const TABLE_HEAD: &str = "\
| way | samples per column | encoding | line rate, Hz | columns/s | samples/s | on the wire, kB/s | device waits for host | of this without credit | host waits for device | frames sent again |
| --- | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |";

/// One scan over one way.
#[derive(Debug, Clone)]
pub struct Row {
    /// The way's name.
    pub way: String,
    /// What was sent.
    pub case: Case,
    /// From the first column to the last.
    pub took: Duration,
    /// Columns after the first.
    pub columns: usize,
    /// Samples after the first column.
    pub samples: usize,
    /// Bytes that reached the driver meanwhile.
    pub bytes: u64,
    /// How long the device waited for the host.
    pub device_waited: Duration,
    /// The part of it without credit.
    pub without_credit: Duration,
    /// How long the host waited for the device.
    pub host_waited: Duration,
    /// Frames that the host asked for again.
    pub frames_resent: u64,
}

impl Row {
    fn rate(&self, count: f64) -> f64 {
        count / self.took.as_secs_f64()
    }

    /// Share of the time, percent.
    fn share(&self, part: Duration) -> f64 {
        100.0 * part.as_secs_f64() / self.took.as_secs_f64()
    }

    /// Columns in a second.
    #[must_use]
    pub fn columns_per_s(&self) -> f64 {
        self.rate(self.columns as f64)
    }

    /// Bytes on the wire in a second.
    #[must_use]
    pub fn bytes_per_s(&self) -> f64 {
        self.rate(self.bytes as f64)
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let encoding = match self.case.encoding {
            Encoding::Uniform => "uniform",
            Encoding::Listed => "listed",
        };
        let rate = self
            .case
            .line_rate_hz
            .map_or("unlimited".to_owned(), |rate| rate.to_string());
        write!(
            f,
            "| {} | {} | {encoding} | {rate} | {:.0} | {:.0} | {:.0} | {:.0} % | {:.0} % | {:.0} % | {} |",
            self.way,
            self.case.samples,
            self.columns_per_s(),
            self.rate(self.samples as f64),
            self.bytes_per_s() / 1e3,
            self.share(self.device_waited),
            self.share(self.without_credit),
            self.share(self.host_waited),
            self.frames_resent,
        )
    }
}
