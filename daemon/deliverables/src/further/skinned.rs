//! What is told of a skinned surface.

use std::io;

use serde::{Deserialize, Serialize};
use skin::{Method, Settings, Skin};

use crate::picture;

/// A skinned surface in numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SkinFigures {
    /// `relief` or `jo`.
    pub method: String,
    /// No data point is farther from the surface.
    pub tolerance_mm: f64,
    /// Whether sections are closed.
    pub closed: bool,
    /// In the order of their stack.
    pub sections: Vec<SectionFigures>,
    /// Knots and control points.
    pub counts: SkinCounts,
    /// Distances of the data points from the surface.
    pub deviation: SkinDeviation,
}

/// A section in numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SectionFigures {
    /// Its name.
    pub name: String,
    /// Parameter across, 0 to 1.
    pub height: f64,
    /// Its data points.
    pub points: usize,
    /// Knots of its own curve, by the published method.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub knots: Option<usize>,
    /// Root mean square of their distances from the surface.
    pub rms_mm: f64,
    /// The greatest of these.
    pub max_mm: f64,
}

/// Knots and control points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SkinCounts {
    /// Knots around once those of all sections are merged, by the published method.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub knots_merged: Option<usize>,
    /// Knots around in the end.
    pub knots_around: usize,
    /// Control points around a section.
    pub points_around: usize,
    /// Rows of them.
    pub points_across: usize,
    /// Control points in all.
    pub points: usize,
}

/// Distances of the data points from the surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SkinDeviation {
    /// Root mean square.
    pub rms_mm: f64,
    /// The greatest.
    pub max_mm: f64,
    /// Part of the data points within the tolerance, 0 to 1.
    pub within_tolerance_share: f64,
}

impl SkinFigures {
    /// The figures of a surface.
    #[must_use]
    pub fn of(found: &Skin, settings: &Settings) -> Self {
        let section = |(k, name): (usize, &String)| {
            let from = found.deviations.partition_point(|own| own.section < k);
            let own = found.deviations.iter().skip(from);
            let own = own.take_while(|own| own.section == k);
            let (mut points, mut squares, mut max_mm) = (0_usize, 0.0, 0.0_f64);
            for own in own {
                points += 1;
                squares += own.off_mm * own.off_mm;
                max_mm = max_mm.max(own.off_mm);
            }
            SectionFigures {
                name: name.clone(),
                height: found.heights.get(k).copied().unwrap_or_default(),
                points,
                knots: found.counts.of_sections.get(k).copied(),
                rms_mm: (squares / points.max(1) as f64).sqrt(),
                max_mm,
            }
        };
        let within = found
            .deviations
            .iter()
            .filter(|own| own.off_mm <= settings.tolerance_mm);
        let share = within.count() as f64 / found.deviations.len().max(1) as f64;
        Self {
            method: match settings.method {
                Method::Relief => "relief",
                Method::Jo => "jo",
            }
            .to_owned(),
            tolerance_mm: settings.tolerance_mm,
            closed: found.is_closed,
            sections: found.sections.iter().enumerate().map(section).collect(),
            counts: SkinCounts {
                knots_merged: found.counts.merged,
                knots_around: found.counts.around,
                points_around: found.counts.points_around,
                points_across: found.counts.rows,
                points: found.counts.points(),
            },
            deviation: SkinDeviation {
                rms_mm: found.rms_mm(),
                max_mm: found.most_mm(),
                within_tolerance_share: share,
            },
        }
    }
}

/// What is to be said of a scan that was cut into sections; `None` if it is in them as a whole.
#[must_use]
pub fn cut_remark(cut: &skin::Cut) -> Option<String> {
    (cut.left_out > 0).then(|| {
        format!(
            "{} of {} nodes in the rows that were cut are beyond a gap or a step, and in no section",
            cut.left_out,
            cut.left_out + cut.nodes
        )
    })
}

/// Every so many rows of a grid is a section, for one about every so many millimetres.
#[must_use]
pub fn rows_of(every_mm: f64, pitch_mm: f64) -> usize {
    (every_mm / pitch_mm).round().max(1.0) as usize
}

/// Sections as they lie, and how far their data points are off, as PNG with the names of their files.
///
/// # Errors
/// A picture that is too large for its format.
pub fn skin_pictures(
    name: &str,
    skin: &Skin,
    tolerance_mm: f64,
) -> io::Result<Vec<(String, Vec<u8>)>> {
    let (mut sections, mut deviations) = (Vec::new(), Vec::new());
    picture::write_sections(skin, name, &mut sections)?;
    picture::write_section_deviations(skin, tolerance_mm, name, &mut deviations)?;
    Ok(vec![
        ("sections.png".to_owned(), sections),
        ("deviations.png".to_owned(), deviations),
    ])
}
