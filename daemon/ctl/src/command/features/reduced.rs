//! The scan with fewer points.

use std::path::{Path, PathBuf};

use deliverables::write_atomically;
use features::edges::EdgeSettings;
use features::recognise::Recognition;
use features::reduce::{Reduction, of_columns};
use range_image::Column;
use serde::Serialize;

use crate::failure::Failure;

/// How points are made fewer.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(super) struct ReductionArgs {
    /// Vector sampling: a point stays that lies farther than this from the last that stayed
    #[arg(long, value_name = "MM", default_value_t = 0.9, requires = "reduced")]
    reduce_distance_mm: f64,
    /// Vector sampling: a point goes where the way turns by less than this, 0 to 180
    #[arg(long, value_name = "DEG", default_value_t = 30.0, requires = "reduced")]
    reduce_angle_deg: f64,
    /// Sampling by rate: of those left, every n-th goes; 0 for none
    #[arg(long, value_name = "N", default_value_t = 2, requires = "reduced")]
    reduce_rate: usize,
}

impl ReductionArgs {
    /// The same as the library has it.
    pub(super) fn reduction(self) -> Result<Reduction, Failure> {
        let is_distance = self.reduce_distance_mm >= 0.0 && self.reduce_distance_mm.is_finite();
        if !is_distance || !(0.0..=180.0).contains(&self.reduce_angle_deg) {
            return Err(Failure::Usage(
                "--reduce-distance-mm is a distance from 0 on, --reduce-angle-deg 0 to 180"
                    .to_owned(),
            ));
        }
        Ok(Reduction {
            vector: Some((self.reduce_distance_mm, self.reduce_angle_deg.to_radians())),
            rate: (self.reduce_rate > 0).then_some(self.reduce_rate),
        })
    }
}

/// What was left of the points.
#[derive(Debug, Serialize)]
pub(super) struct ReducedFile {
    pub(super) output: PathBuf,
    pub(super) points: usize,
    pub(super) sharp_edge_points: usize,
    pub(super) smooth_edge_points: usize,
    pub(super) after_vector_sampling: usize,
    pub(super) left: usize,
}

/// Writes the points that stay.
pub(super) fn write(
    path: &Path,
    reduction: &Reduction,
    columns: &[Column],
    found: &Recognition,
) -> Result<ReducedFile, Failure> {
    let settings = EdgeSettings::new(found.noise_mm);
    let reduced = of_columns(columns, found.pitch_mm, &settings, reduction);
    write_atomically::<std::io::Error>(path, |sink| {
        for [x, y, z] in reduced.lines.iter().flatten() {
            writeln!(sink, "{x} {y} {z}")?;
        }
        Ok(())
    })
    .map_err(|error| Failure::at(format!("cannot write {}", path.display()), &error))?;
    let [sharp_edge_points, smooth_edge_points] = reduced.edge_points;
    Ok(ReducedFile {
        output: path.to_owned(),
        points: reduced.points,
        sharp_edge_points,
        smooth_edge_points,
        after_vector_sampling: reduced.after_vectors,
        left: reduced.left(),
    })
}
