//! The simulated scanner: columns of counts, each the same whenever it is asked for.

use crate::mechanics::Mechanics;
use crate::mount::{Mount, Stand};
use crate::noise::{NoiseModel, SampleKey};
use crate::optics::Optics;
use crate::random::{Draws, Purpose};
use crate::scene::Scene;
use crate::truth::SampleTruth;

/// What the two numbers of a sample mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HeadKind {
    /// The beam's angle from -z towards +y, and the distance along it.
    Polar {
        /// Angle per count, nanoradians.
        angle_count_nrad: u32,
        /// Distance per count, nanometres.
        range_count_nm: u32,
    },
    /// y and z in the part frame, as profile sensors deliver them.
    Cartesian {
        /// y and z per count, nanometres.
        count_nm: u32,
        /// Depth at which the plan's steps in y are taken, millimetres.
        reference_z_mm: f64,
    },
}

/// The measuring head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Head {
    /// What its numbers mean.
    pub kind: HeadKind,
    /// Nearest and farthest range, millimetres.
    pub window_mm: (f64, f64),
    /// Scatter of the beams about their places in the fan, in steps (1 sigma). The head
    /// knows where its beams are, so it shows in the reported places.
    pub fan_jitter: f64,
}

/// Where a scan takes its columns and samples, in counts.
///
/// Laterals are angles for a polar head, and y at the reference depth for a Cartesian one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sweep {
    /// Table position of the first column.
    pub first_table_counts: i32,
    /// Table counts from column to column; negative for a scan towards -x.
    pub pitch_counts: i32,
    /// Number of columns.
    pub columns: u32,
    /// Lateral of the first sample.
    pub first_lateral_counts: i32,
    /// Lateral counts from sample to sample.
    pub lateral_step_counts: i32,
    /// Samples in a column.
    pub samples: u32,
}

impl Sweep {
    /// Nominal table position of a column; ends at the limits of a count.
    #[must_use]
    pub fn table_counts(&self, column: u32) -> i32 {
        along(self.first_table_counts, self.pitch_counts, column)
    }

    /// Nominal lateral of a sample.
    #[must_use]
    pub fn lateral_counts(&self, sample: u32) -> i32 {
        along(self.first_lateral_counts, self.lateral_step_counts, sample)
    }
}

fn along(first: i32, step: i32, index: u32) -> i32 {
    let at = i64::from(first) + i64::from(step) * i64::from(index);
    at.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
}

/// One sample as the head reports it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sample {
    /// Angle of the beam, or y.
    pub lateral_counts: i32,
    /// Distance along the beam, or z; 0 without a return.
    pub range_counts: i32,
    /// Strength of the returned light.
    pub intensity: u8,
    /// No light came back.
    pub no_return: bool,
    /// The light was too strong to measure.
    pub saturated: bool,
}

/// One column as the device reports it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Place in the scan.
    pub index: u32,
    /// Position of the table as the encoder reports it.
    pub table_counts: i32,
    /// One sample per beam, in the order of the beams.
    pub samples: Vec<Sample>,
}

/// Optics, mechanics and noise around one scene.
#[derive(Debug, Clone)]
pub struct Scanner {
    /// What stands on the table.
    pub scene: Scene,
    /// Laser and sensor.
    pub optics: Optics,
    /// What the head delivers.
    pub head: Head,
    /// The slide table.
    pub mechanics: Mechanics,
    /// x of the part frame at table position 0, nanometres.
    pub table_origin_nm: i64,
    /// How far the object stands from where the part frame has it, millimetres: it has been
    /// moved, and nobody has told the device.
    pub part_offset_mm: crate::Vec3,
    /// How the head is mounted; the device knows nothing of it.
    pub mount: Mount,
    /// How readings stray.
    pub noise: NoiseModel,
    /// Seed of everything random.
    pub seed: u64,
}

impl Scanner {
    /// x of the part frame that the report puts at a table position, millimetres.
    #[must_use]
    pub fn x_mm(&self, table_counts: i32) -> f64 {
        // The same order of operations as on the host's side, so that both get the same bits.
        self.table_origin_nm as f64 * 1e-6 + f64::from(table_counts) * self.mechanics.count_mm()
    }

    /// A column of a scan, as reported. `repeat` tells scans of one seed apart.
    #[must_use]
    pub fn column(&self, sweep: &Sweep, repeat: u64, index: u32) -> Column {
        self.trace(sweep, repeat, index, |_, _| ())
    }

    /// A column together with what lies behind each sample; for judging only.
    #[must_use]
    pub fn column_with_truth(
        &self,
        sweep: &Sweep,
        repeat: u64,
        index: u32,
    ) -> (Column, Vec<SampleTruth>) {
        let mut truths = Vec::new();
        let column = self.trace(sweep, repeat, index, |_, truth| truths.push(truth));
        (column, truths)
    }

    fn trace(
        &self,
        sweep: &Sweep,
        repeat: u64,
        index: u32,
        mut note: impl FnMut(u32, SampleTruth),
    ) -> Column {
        let nominal = sweep.table_counts(index);
        let stop = self.mechanics.stop(
            self.seed,
            &[repeat, u64::from(index)],
            nominal,
            sweep.pitch_counts < 0,
        );
        let x_mm = self.x_mm(stop.reported_counts) + stop.error_mm;
        // Moving the camera the other way shows the object the same.
        let stand = self.mount.stand(&self.optics, x_mm, self.part_offset_mm);
        let samples = (0..sweep.samples)
            .map(|sample| {
                let key = SampleKey {
                    seed: self.seed,
                    repeat,
                    column: index,
                    sample,
                };
                let (sample_out, truth) = self.sample(sweep, key, &stand);
                note(sample, truth);
                sample_out
            })
            .collect();
        Column {
            index,
            table_counts: stop.reported_counts,
            samples,
        }
    }

    fn sample(&self, sweep: &Sweep, key: SampleKey, stand: &Stand) -> (Sample, SampleTruth) {
        let lateral_counts = self.lateral_counts(sweep, key);
        let angle_rad = self.angle_rad(lateral_counts);
        let true_rad = self.mount.angle_rad(angle_rad);
        let spot = self
            .optics
            .look_from(&self.scene, stand.laser_mm, &stand.turn, true_rad);
        let reading = spot.and_then(|spot| {
            let material = self.scene.material(spot.hit.face);
            self.noise.read(key, &spot, material, self.head.window_mm)
        });
        let truth = SampleTruth {
            face: spot.map(|spot| spot.hit.face),
            point_mm: spot.map(|spot| spot.hit.point_mm),
            range_mm: spot.map(|spot| spot.range_mm),
            incidence_cos: spot.map(|spot| spot.incidence_cos),
            kind: reading.map(|reading| reading.kind),
        };
        let Some(reading) = reading else {
            let lost = Sample {
                lateral_counts,
                range_counts: 0,
                intensity: 0,
                no_return: true,
                saturated: false,
            };
            return (lost, truth);
        };
        let told_mm = self.mount.told_range_mm(reading.range_mm);
        let (lateral_counts, range_counts) = match self.head.kind {
            HeadKind::Polar { range_count_nm, .. } => {
                let count_mm = f64::from(range_count_nm) * 1e-6;
                (lateral_counts, counts(told_mm, count_mm))
            }
            HeadKind::Cartesian { count_nm, .. } => {
                let count_mm = f64::from(count_nm) * 1e-6;
                let (sin, cos) = libm::sincos(angle_rad);
                (
                    counts(self.optics.camera_y_mm + told_mm * sin, count_mm),
                    counts(self.optics.camera_z_mm - told_mm * cos, count_mm),
                )
            }
        };
        let sample = Sample {
            lateral_counts,
            range_counts,
            intensity: reading.intensity,
            no_return: false,
            saturated: reading.saturated,
        };
        (sample, truth)
    }

    /// Where in the fan a beam is, scatter included.
    fn lateral_counts(&self, sweep: &Sweep, key: SampleKey) -> i32 {
        let nominal = sweep.lateral_counts(key.sample);
        if self.head.fan_jitter <= 0.0 {
            return nominal;
        }
        // The fan belongs to the head: the same in every column.
        let mut draws = Draws::keyed(key.seed, Purpose::Fan, &[u64::from(key.sample)]);
        let off = draws.normal() * self.head.fan_jitter * f64::from(sweep.lateral_step_counts);
        nominal.saturating_add(libm::round(off) as i32)
    }

    /// Angle of the beam with this lateral, radians.
    #[must_use]
    pub fn angle_rad(&self, lateral_counts: i32) -> f64 {
        match self.head.kind {
            HeadKind::Polar {
                angle_count_nrad, ..
            } => f64::from(lateral_counts) * (f64::from(angle_count_nrad) * 1e-9),
            HeadKind::Cartesian {
                count_nm,
                reference_z_mm,
            } => {
                let y_mm = f64::from(lateral_counts) * (f64::from(count_nm) * 1e-6);
                libm::atan2(
                    y_mm - self.optics.camera_y_mm,
                    self.optics.camera_z_mm - reference_z_mm,
                )
            }
        }
    }

    /// Where a host puts a sample: x, y, z in the part frame, millimetres.
    #[must_use]
    pub fn reported_point_mm(&self, column: &Column, sample: &Sample) -> crate::Vec3 {
        let x_mm = self.x_mm(column.table_counts);
        match self.head.kind {
            HeadKind::Polar { range_count_nm, .. } => {
                let range_mm = f64::from(sample.range_counts) * (f64::from(range_count_nm) * 1e-6);
                self.optics.laser_mm(x_mm)
                    + Optics::direction(self.angle_rad(sample.lateral_counts)) * range_mm
            }
            HeadKind::Cartesian { count_nm, .. } => {
                let count_mm = f64::from(count_nm) * 1e-6;
                crate::Vec3::new(
                    x_mm,
                    f64::from(sample.lateral_counts) * count_mm,
                    f64::from(sample.range_counts) * count_mm,
                )
            }
        }
    }
}

/// A length in counts; beyond the counter it stays at the counter's end.
fn counts(length_mm: f64, count_mm: f64) -> i32 {
    libm::round(length_mm / count_mm) as i32
}
