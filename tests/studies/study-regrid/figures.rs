//! What is measured of a range image.

use range_image::RangeImage;

use crate::scene::{PITCH_MM, STEP_MM, Truth};

/// Nodes off by more than this are gross errors, millimetres.
const GROSS_MM: f64 = 0.5;
/// Nodes within this of the step are next to it, millimetres.
pub(crate) const NEAR_MM: f64 = 1.5;

/// Sums over the nodes of any number of images.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Figures {
    away: u64,
    away_gross: u64,
    squares: f64,
    squares_fine: f64,
    near: u64,
    near_gross: u64,
    /// Nodes next to the step that are more than 0.5 mm from both planes: between them, above
    /// or below.
    pub(crate) in_between: u64,
    /// Nodes a pitch or more from the step, however far, that are within 0.5 mm of the plane
    /// on the other side of it.
    pub(crate) wrong_plane: u64,
    /// Nodes without a value, two pitches or more within the outermost samples.
    pub(crate) holes: u64,
}

impl Figures {
    /// Counts the nodes of the image that lie among the samples, and names those that should
    /// not be: on neither plane near the step, on the wrong one, far off away from it, without a
    /// value.
    pub(crate) fn add(
        &mut self,
        image: &RangeImage,
        truth: &Truth,
        (width, height): (f64, f64),
    ) -> Vec<String> {
        let mut told = Vec::new();
        let lattice = image.lattice();
        let (i_first, j_first) = image.origin();
        let rim_mm = 2.0 * PITCH_MM;
        let inside = |x_mm: f64, y_mm: f64| {
            (rim_mm..=width - rim_mm).contains(&x_mm) && (rim_mm..=height - rim_mm).contains(&y_mm)
        };
        for i in lattice.first_at_or_above(0.0)..=lattice.last_at_or_below(width) {
            for j in lattice.first_at_or_above(0.0)..=lattice.last_at_or_below(height) {
                let column = usize::try_from(i - i_first).unwrap_or(usize::MAX);
                let row = usize::try_from(j - j_first).unwrap_or(usize::MAX);
                let (x_mm, y_mm) = (lattice.line_mm(i), lattice.line_mm(j));
                let z_mm = image.z_mm(column, row);
                let counts = |figures: &Self| {
                    let Self {
                        in_between,
                        wrong_plane,
                        holes,
                        away_gross,
                        ..
                    } = *figures;
                    (in_between, wrong_plane, holes, away_gross)
                };
                let before = counts(self);
                self.holes += u64::from(z_mm.is_none() && inside(x_mm, y_mm));
                if let Some(z_mm) = z_mm {
                    self.node(z_mm, truth, (x_mm, y_mm));
                }
                if before != counts(self) {
                    let (from_mm, true_mm) = (
                        truth.distance_to_step_mm(x_mm, y_mm),
                        truth.z_mm(x_mm, y_mm),
                    );
                    let off = z_mm.map_or_else(
                        || "no value".to_owned(),
                        |z_mm| format!("{:.3} mm off", z_mm - true_mm),
                    );
                    told.push(format!(
                        "node {i} {j}, {from_mm:.2} mm from the step, {off}"
                    ));
                }
            }
        }
        told
    }

    /// Counts one node.
    pub(crate) fn node(&mut self, z_mm: f64, truth: &Truth, (x_mm, y_mm): (f64, f64)) {
        let from_step_mm = truth.distance_to_step_mm(x_mm, y_mm).abs();
        let error_mm = z_mm - truth.z_mm(x_mm, y_mm);
        let gross = error_mm.abs() > GROSS_MM;
        let above_mm = z_mm - truth.lower_mm(x_mm, y_mm);
        let other_mm = (above_mm - STEP_MM).abs();
        let on_neither = above_mm.abs() > GROSS_MM && other_mm > GROSS_MM;
        self.wrong_plane += u64::from(from_step_mm >= PITCH_MM && gross && !on_neither);
        if from_step_mm < NEAR_MM {
            self.near += 1;
            self.near_gross += u64::from(gross);
            self.in_between += u64::from(on_neither);
        } else {
            self.away += 1;
            self.away_gross += u64::from(gross);
            self.squares += error_mm * error_mm;
            if !gross {
                self.squares_fine += error_mm * error_mm;
            }
        }
    }

    /// Root mean square error away from the step, gross errors and all, millimetres.
    pub(crate) fn rms_mm(&self) -> f64 {
        (self.squares / self.away as f64).sqrt()
    }

    /// The same without gross errors.
    pub(crate) fn rms_fine_mm(&self) -> f64 {
        (self.squares_fine / (self.away - self.away_gross) as f64).sqrt()
    }

    /// Share of gross errors away from the step.
    pub(crate) fn gross(&self) -> f64 {
        self.away_gross as f64 / self.away as f64
    }

    /// Share of gross errors next to the step.
    pub(crate) fn near_gross(&self) -> f64 {
        self.near_gross as f64 / self.near as f64
    }
}
