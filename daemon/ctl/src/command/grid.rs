//! How a scan is regridded: options that `compare`, `skin` and `surface` share.

use std::path::Path;

use pipeline::Extent;
use range_image::RangeImage;
use regrid::{RegridError, RegridSettings};
use scan_files::Units;

use super::part::{Limits, limits};
use super::shown::Shown;
use crate::failure::Failure;
use crate::input::{self, Input};

/// How a scan is regridded.
#[derive(Debug, Clone, Default, clap::Args)]
pub(crate) struct GridArgs {
    /// Distance of the grid's nodes, millimetres; default: after the scan's density
    #[arg(long, value_name = "MM")]
    pitch_mm: Option<f64>,
    /// Ignore samples with x outside of these limits, millimetres; one may be left out, as
    /// in `-50,`
    #[arg(long, value_name = "MIN,MAX", value_parser = limits, allow_hyphen_values = true)]
    roi_x_mm: Option<Limits>,
    /// The same for y (up)
    #[arg(long, value_name = "MIN,MAX", value_parser = limits, allow_hyphen_values = true)]
    roi_y_mm: Option<Limits>,
    /// The same for z (towards the camera)
    #[arg(long, value_name = "MIN,MAX", value_parser = limits, allow_hyphen_values = true)]
    roi_z_mm: Option<Limits>,
    /// Seed of every random draw
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Threads to use; 0 for all processors. The result does not depend on it
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) threads: usize,
}

impl GridArgs {
    /// As it would be for `convert`, but for what the user says.
    pub(crate) fn apply(&self, mut settings: RegridSettings) -> Result<RegridSettings, Failure> {
        if let Some(pitch_mm) = self.pitch_mm {
            settings.pitch_mm = pitch_mm;
        }
        if let Some(seed) = self.seed {
            settings.seed = seed;
        }
        for (place, given) in [
            (&mut settings.roi.x_mm, self.roi_x_mm),
            (&mut settings.roi.y_mm, self.roi_y_mm),
            (&mut settings.roi.z_mm, self.roi_z_mm),
        ] {
            if let Some(limits) = given {
                *place = limits.mm();
            }
        }
        settings.threads = self.threads;
        settings
            .validate()
            .map_err(|error| Failure::Usage(error.to_string()))?;
        Ok(settings)
    }

    /// Whether samples are to be brought onto another grid even if they lie on one already.
    pub(crate) fn asks_for_a_grid(&self) -> bool {
        let limits = [self.roi_x_mm, self.roi_y_mm, self.roi_z_mm];
        self.pitch_mm.is_some() || limits.iter().any(Option::is_some)
    }
}

/// The scan on a grid, as `convert` would have it; `path` stands for it in errors.
pub(crate) fn image(
    input: &Input,
    settings: &RegridSettings,
    path: &Path,
    shown: &Shown,
) -> Result<RangeImage, Failure> {
    let file = path.display();
    if let Some(extent) = Extent::within(&input.columns, &settings.roi)
        && settings.pitch_mm < extent.finest_pitch_mm()
    {
        return Err(Failure::Failed(format!(
            "{file}: a grid of {} mm is too fine for its size and number of samples; leave out \
             single points far away with --roi-x-mm and --roi-y-mm, else choose --pitch-mm {}",
            settings.pitch_mm,
            extent.finest_pitch_mm()
        )));
    }
    shown.begin("regrid");
    regrid::regrid(input.columns.iter().cloned(), settings, shown).map_err(|error| match error {
        RegridError::Cancelled(_) => Failure::Interrupted,
        other => Failure::at(&file, &other),
    })
}

/// A scan with a surface in it.
pub(crate) fn scan(path: &Path, units: Option<Units>) -> Result<Input, Failure> {
    let input = input::read(path, units)?;
    match pipeline::no_surface(&input.columns, input.column_pitch_mm) {
        Some(why) => Err(Failure::Failed(format!("{}: {why}", path.display()))),
        None => Ok(input),
    }
}
