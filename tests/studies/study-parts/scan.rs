//! A part before the simulated scanner.

use std::collections::BTreeMap;

use anyhow::{Context, Result};
use nalgebra::Vector3;
use pipeline::{InMemory, Outcome, Settings, process_scan};
use range_image::{Column, Lattice, RangeImage, Unmonitored};
use relief_tests::columns::received;
use relief_tests::scenes::Truth;
use relief_tests::scenes::scan::lattice;
use sim_scanner::noise::Kind;
use sim_scanner::optics::Optics;
use sim_scanner::preset::{Overrides, Preset};
use sim_scanner::scanner::{HeadKind, Scanner, Sweep};

use crate::bound::{Known, Reading};
use crate::edges::KnownFaces;
use crate::part::Part;
use crate::surface::{TrueSurface, vector};

/// What differs from the preset `paper`: 240 columns of 256 samples, noise of 0.05 mm and one in
/// ten samples at a step mixed are its own.
pub(crate) const OUTLIERS: f64 = 0.02;
pub(crate) const DROPOUTS: f64 = 0.01;
pub(crate) const SPOT_RADIUS_MM: f64 = 0.05;

/// Nodes between a reading deep within a face and what is not of the face.
pub(crate) const DEEP: i64 = 2;

/// A scan, and what only the simulator knows of it.
pub(crate) struct Scan {
    pub(crate) scanner: Scanner,
    pub(crate) columns: Vec<Column>,
    pub(crate) lattice: Lattice,
    pub(crate) truth: Truth,
    /// Readings with noise alone, each with its face.
    pub(crate) readings: Vec<(usize, Reading)>,
}

/// Scans a part; the part's seed is that of the noise, too.
pub(crate) fn scan(part: &Part) -> Result<Scan> {
    let overrides = Overrides {
        outliers: Some(OUTLIERS),
        dropouts: Some(DROPOUTS),
        ..Overrides::default()
    };
    let (mut scanner, sweep) = Preset::Paper.set_up(part.scene.clone(), &overrides, part.seed)?;
    scanner.optics.spot_radius_mm = SPOT_RADIUS_MM;
    let (mut columns, mut readings) = (Vec::new(), Vec::new());
    for index in 0..sweep.columns {
        let (column, of_column) = column(&scanner, &sweep, index);
        columns.push(column);
        readings.extend(of_column);
    }
    let lattice = lattice(&scanner, &sweep);
    let truth = Truth::of_scan(&scanner, &sweep, lattice);
    Ok(Scan {
        scanner,
        columns,
        lattice,
        truth,
        readings,
    })
}

fn column(scanner: &Scanner, sweep: &Sweep, index: u32) -> (Column, Vec<(usize, Reading)>) {
    let (column, truths) = scanner.column_with_truth(sweep, 0, index);
    let count_mm = match scanner.head.kind {
        HeadKind::Polar { range_count_nm, .. } => f64::from(range_count_nm) * 1e-6,
        HeadKind::Cartesian { count_nm, .. } => f64::from(count_nm) * 1e-6,
    };
    let pairs = column.samples.iter().zip(&truths);
    let readings = pairs.filter_map(|(sample, truth)| {
        let is_clean = truth.kind == Some(Kind::Clean) && !sample.no_return;
        let (face, point, cos) = (truth.face?, truth.point_mm?, truth.incidence_cos?);
        let reading = Reading {
            point_mm: vector(point),
            told_mm: vector(scanner.reported_point_mm(&column, sample)),
            ray: vector(Optics::direction(scanner.angle_rad(sample.lateral_counts))),
            deviation_mm: deviation_mm(scanner.noise.noise_mm, cos, count_mm),
        };
        is_clean.then_some((face.face, reading))
    });
    let readings = readings.collect();
    (received(scanner, &column), readings)
}

/// Of a reading along its beam: noise that grows with the incidence, and the rounding to counts.
fn deviation_mm(noise_mm: f64, incidence_cos: f64, count_mm: f64) -> f64 {
    let noise_mm = noise_mm / incidence_cos;
    (noise_mm * noise_mm + count_mm * count_mm / 12.0).sqrt()
}

impl Scan {
    /// What the service would make of the columns.
    pub(crate) fn process(&self, change: impl Fn(&mut Settings)) -> Result<(RangeImage, Outcome)> {
        let optics = &self.scanner.optics;
        let scan = InMemory {
            columns: &self.columns,
            camera_mm: Some([optics.camera_y_mm, optics.camera_z_mm]),
        };
        let mut settings = Settings::new(self.lattice.pitch_mm);
        // Parts are worked on at once.
        settings.regrid.threads = 1;
        change(&mut settings);
        process_scan(&scan, &settings, &Unmonitored).context("the pipeline")
    }

    /// The readings of a true region: those of its face with a node of it around them, and which
    /// of them lie deep within it, all nodes beyond the four around them of it, too, as far as
    /// [`DEEP`].
    pub(crate) fn readings_of(&self, label: u16, face: usize) -> (Vec<Reading>, Vec<Reading>) {
        let (mut own, mut inner) = (Vec::new(), Vec::new());
        for (_, reading) in self.readings.iter().filter(|(of, _)| *of == face) {
            let is_own = |other: u16| other == label;
            if self.labels_around(&reading.point_mm, 0).any(is_own) {
                own.push(*reading);
                if self.labels_around(&reading.point_mm, DEEP).all(is_own) {
                    inner.push(*reading);
                }
            }
        }
        (own, inner)
    }

    /// The faces that are told by numbers, each as well as all its readings let it be known.
    pub(crate) fn known_faces(&self, faces: &[Option<TrueSurface>]) -> KnownFaces {
        let mut own: BTreeMap<usize, Vec<Reading>> = BTreeMap::new();
        for (face, reading) in &self.readings {
            own.entry(*face).or_default().push(*reading);
        }
        let known = own.iter().filter_map(|(face, readings)| {
            let surface = faces.get(*face)?.as_ref()?;
            Some((*face, Known::of(surface, readings)?))
        });
        known.collect()
    }

    /// Labels of the four nodes around a point, and of those beyond; 0 for none.
    fn labels_around(&self, point_mm: &Vector3<f64>, beyond: i64) -> impl Iterator<Item = u16> {
        let truth = &self.truth;
        let index = |at_mm: f64, first: i64| {
            let first = libm::floor(at_mm / self.lattice.pitch_mm) as i64 - first;
            first - beyond..=first + 1 + beyond
        };
        let rows = index(point_mm.y, truth.j_first);
        let columns = index(point_mm.x, truth.i_first);
        let at = |k: i64, end: usize| usize::try_from(k).ok().filter(|k| *k < end);
        let each = columns.flat_map(move |c| rows.clone().map(move |r| (c, r)));
        each.map(move |(c, r)| {
            let node = at(c, truth.columns).zip(at(r, truth.rows));
            let label = node.and_then(|(c, r)| truth.labels.get(c * truth.rows + r));
            label.copied().unwrap_or(0)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_and_rounding_add_as_variances_do() {
        assert_eq!(deviation_mm(0.05, 0.5, 0.0), 0.1);
        assert!((deviation_mm(0.0, 1.0, 0.12) - 0.034_641).abs() < 1e-6);
        assert!((deviation_mm(0.3, 1.0, 0.4 * 12.0_f64.sqrt()) - 0.5).abs() < 1e-12);
    }
}
