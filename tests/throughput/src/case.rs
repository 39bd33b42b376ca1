//! What is sent.

use anyhow::{Context, Result};
use scan_files::ReadOptions;
use sim_scanner::device::DeviceSettings;
use sim_scanner::replay::Replay;
use sim_scanner::source::Source;

/// How the samples of a column are put into fragments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// First lateral and step, then 15 readings.
    Uniform,
    /// 10 times a lateral and a reading.
    Listed,
}

/// A scan to be sent.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Columns in it.
    pub columns: u32,
    /// Samples in each.
    pub samples: u32,
    /// How they are sent.
    pub encoding: Encoding,
    /// Columns that the device measures in a second; `None` for as many as go over the way.
    pub line_rate_hz: Option<f64>,
}

impl Case {
    /// A bent sheet as a recording, which takes no time to measure.
    ///
    /// # Errors
    /// When it cannot be sent in this encoding.
    pub fn source(&self) -> Result<Source> {
        let points = (0..self.columns).flat_map(|column| {
            (0..self.samples).map(move |sample| {
                let (x, y) = (f64::from(column) * 0.5, f64::from(sample) * 0.05);
                [x, y, x * y * 0.001]
            })
        });
        let scan = scan_files::from_points_mm(points, "a sheet", &ReadOptions::default())?;
        let replay = Replay::new(&scan)?;
        Ok(Source::Replay(match self.encoding {
            Encoding::Listed => replay,
            Encoding::Uniform => replay.into_uniform().context("it is not evenly spaced")?,
        }))
    }

    pub(crate) fn device(&self) -> DeviceSettings {
        DeviceSettings {
            line_rate_hz: self.line_rate_hz,
            // At the first column at once.
            table_speed_mm_s: f64::INFINITY,
            ..DeviceSettings::default()
        }
    }
}
