//! Whether samples and grid go together: a surface to find, and a grid of a sensible size.
//! Asked before the work, or after it has come to nothing.

use range_image::{Column, RangeImage, Sample};
use regrid::Roi;

/// Nodes that every scan may have, however few its samples: some minutes of work.
const NODES_ALWAYS: f64 = (1_u32 << 24) as f64;
/// Nodes for each sample beyond which a finer grid shows nothing more.
const NODES_PER_SAMPLE: f64 = 4.0;
/// Points this near to a line are on it: coordinates in files are rounded.
const LINE_MM: f64 = 1e-4;
/// Fewer samples than this show no surface, whatever the grid.
const LEAST_SAMPLES: usize = 16;
/// Parts larger or smaller than this are rather a matter of wrong units or calibration.
const UNUSUAL_MM: (f64, f64) = (1.0, 10_000.0);
/// Samples this share of the column pitch from a line may have been moved there; less than
/// what parts the corners of the smallest square of samples from its diagonal.
const MOVED_SHARE: f64 = 0.6;

/// What the samples cover, as the camera sees them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    samples: usize,
    first: [f64; 2],
    low: [f64; 2],
    high: [f64; 2],
}

impl Extent {
    /// `None` where there is no sample.
    #[must_use]
    pub fn of(columns: &[Column]) -> Option<Self> {
        Self::within(columns, &Roi::default())
    }

    /// Of the samples in a region of interest.
    #[must_use]
    pub fn within(columns: &[Column], roi: &Roi) -> Option<Self> {
        let inside = |[low, high]: [f64; 2], value: f64| low <= value && value <= high;
        let mut points = points(columns)
            .filter(|&[x, y]| inside(roi.x_mm.into(), x) && inside(roi.y_mm.into(), y));
        let first = points.next()?;
        let start = Self {
            samples: 1,
            first,
            low: first,
            high: first,
        };
        Some(points.fold(start, |extent, [x, y]| Self {
            samples: extent.samples + 1,
            first,
            low: [extent.low[0].min(x), extent.low[1].min(y)],
            high: [extent.high[0].max(x), extent.high[1].max(y)],
        }))
    }

    /// Of these samples and those together, for scans that are read piece by piece.
    #[must_use]
    pub fn joined(self, other: Self) -> Self {
        Self {
            samples: self.samples + other.samples,
            first: self.first,
            low: [0, 1].map(|k| self.low[k].min(other.low[k])),
            high: [0, 1].map(|k| self.high[k].max(other.high[k])),
        }
    }

    /// Number of samples.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Width and height, millimetres.
    #[must_use]
    pub fn sides_mm(&self) -> [f64; 2] {
        [self.high[0] - self.low[0], self.high[1] - self.low[1]]
    }

    /// Why there is no surface between the samples, if so. A cloud's samples have been
    /// moved into columns of this pitch.
    fn line(&self, columns: &[Column], pitch_mm: f64) -> Option<&'static str> {
        let [width, height] = self.sides_mm();
        if width <= LINE_MM && height <= LINE_MM {
            return Some("at one point in x and y");
        }
        if width <= LINE_MM {
            return Some("at one x, a single column");
        }
        if height <= LINE_MM {
            return Some("at one y");
        }
        // The line, if there is one, is a diagonal of the extent, and begins at the first
        // sample or ends there.
        let [x0, y0] = self.first;
        let ux = if x0 == self.low[0] { width } else { -width };
        let uy = if y0 == self.low[1] { height } else { -height };
        let near = libm::hypot(ux, uy) * LINE_MM.max(pitch_mm * MOVED_SHARE);
        points(columns)
            .all(|[x, y]| ((x - x0) * uy - (y - y0) * ux).abs() <= near)
            .then_some("on one slanted line in x and y")
    }

    /// The finest grid for these samples, millimetres between its nodes.
    #[must_use]
    pub fn finest_pitch_mm(&self) -> f64 {
        self.finest_pitch_among_mm(self.samples)
    }

    /// The finest grid for this extent if there are so many samples, some of them perhaps
    /// still to come; millimetres between its nodes.
    #[must_use]
    pub fn finest_pitch_among_mm(&self, samples: usize) -> f64 {
        finest_pitch_mm(self.sides_mm(), samples)
    }
}

/// The finest grid for so many samples that spread over a rectangle of these sides;
/// millimetres between its nodes.
#[must_use]
pub fn finest_pitch_mm([width_mm, height_mm]: [f64; 2], samples: usize) -> f64 {
    let nodes = NODES_ALWAYS.max(samples as f64 * NODES_PER_SAMPLE);
    let pitch_mm = (width_mm * height_mm / nodes).sqrt();
    // Two digits, not finer than what is allowed.
    let digit = libm::pow(10.0, libm::log10(pitch_mm).floor() - 1.0);
    format!("{:.1e}", (pitch_mm / digit).ceil() * digit)
        .parse()
        .unwrap_or(pitch_mm)
}

/// Why no surface can lie between these samples, whatever the settings, in words that
/// follow the name of the scan; `None` where there may be one. A cloud's samples have been
/// moved into columns of this pitch.
#[must_use]
pub fn no_surface(columns: &[Column], column_pitch_mm: f64) -> Option<String> {
    let Some(extent) = Extent::of(columns) else {
        return Some(match columns.len() {
            0 => "holds no columns: nothing was measured".into(),
            columns => format!("holds no samples: none of its {columns} columns has any"),
        });
    };
    if let Some(line) = extent.line(columns, column_pitch_mm) {
        return Some(format!(
            "all its samples lie {line}, so that there is no surface between them; x runs along \
             the table, y up and z towards the camera"
        ));
    }
    (extent.samples < LEAST_SAMPLES).then(|| {
        format!(
            "holds {} samples only, too few for a surface; a scan has thousands",
            extent.samples
        )
    })
}

/// What is suspicious about the size of a part, if anything.
#[must_use]
pub fn unusual_size(image: &RangeImage) -> Option<String> {
    let side_mm = |nodes: usize| nodes as f64 * image.pitch_mm();
    let size_mm = side_mm(image.columns()).max(side_mm(image.rows()));
    let (least_mm, greatest_mm) = UNUSUAL_MM;
    if image.valid_nodes() == 0 || (least_mm..=greatest_mm).contains(&size_mm) {
        return None;
    }
    Some(format!(
        "what was measured is {size_mm:.3} mm across, which is unusual: check the scanner's \
         calibration, or the units of the file"
    ))
}

fn points(columns: &[Column]) -> impl Iterator<Item = [f64; 2]> {
    columns.iter().flat_map(|column| {
        let point = |sample: &Sample| [column.x_mm(), sample.y_mm];
        column.samples().iter().map(point)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(points: &[[f64; 2]]) -> Vec<Column> {
        let column = |&[x, y_mm]: &[f64; 2]| {
            let sample = Sample {
                y_mm,
                z_mm: 1.0,
                intensity: 255,
            };
            Column::new(x, vec![sample])
        };
        points.iter().map(column).collect()
    }

    #[test]
    fn pieces_come_to_the_same_as_the_whole() {
        let column = |x_mm: f64, y_mm: &[f64]| {
            let sample = |&y_mm: &f64| Sample {
                y_mm,
                z_mm: 0.0,
                intensity: 0,
            };
            Column::new(x_mm, y_mm.iter().map(sample).collect())
        };
        let columns = [
            column(1.0, &[2.0, -7.0]),
            column(5.0, &[]),
            column(-3.0, &[4.0]),
            column(2.0, &[9.0, 1.0]),
        ];
        let pieces = columns.chunks(1).filter_map(Extent::of);
        assert_eq!(pieces.reduce(Extent::joined), Extent::of(&columns));
    }

    #[test]
    fn samples_on_a_line_enclose_nothing() {
        let line = |points: &[[f64; 2]]| {
            let columns = columns(points);
            Extent::of(&columns).unwrap().line(&columns, 0.0)
        };
        assert_eq!(line(&[[1.0, 2.0]]), Some("at one point in x and y"));
        assert_eq!(
            line(&[[1.0, 2.0], [1.0, 3.0]]),
            Some("at one x, a single column")
        );
        assert_eq!(line(&[[1.0, 2.0], [4.0, 2.0]]), Some("at one y"));
        let slanted = Some("on one slanted line in x and y");
        assert_eq!(line(&[[0.0, 0.0], [0.1, 0.3], [0.2, 0.6]]), slanted);
        assert_eq!(line(&[[0.0, 0.6], [0.1, 0.3], [0.2, 0.0]]), slanted);
        assert_eq!(line(&[[0.0, 0.0], [0.1, 0.3], [0.2, 0.7]]), None);
        assert_eq!(
            line(&[[0.1, 0.3], [0.0, 0.0], [0.2, 0.6], [0.3, 0.1]]),
            None
        );
        assert_eq!(Extent::of(&[]), None);
        let square = columns(&[[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]);
        assert_eq!(Extent::of(&square).unwrap().line(&square, 1.0), None);
        let moved = columns(&[[0.0, 0.0], [2.0, 3.0], [2.0, 5.0], [4.0, 8.0]]);
        assert_eq!(Extent::of(&moved).unwrap().line(&moved, 2.0), slanted);
    }

    #[test]
    fn the_finest_grid_follows_from_area_and_samples() {
        let extent = |samples| Extent {
            samples,
            first: [0.0; 2],
            low: [0.0; 2],
            high: [100.0, 100.0],
        };
        // 10^4 mm^2 over 2^24 nodes: 0.0244 mm.
        assert_eq!(extent(60_000).finest_pitch_mm(), 0.025);
        // Over 4 x 10^7: 0.0158 mm.
        assert_eq!(extent(10_000_000).finest_pitch_mm(), 0.016);
    }
}
