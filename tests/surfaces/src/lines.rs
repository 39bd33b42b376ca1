//! Character lines across the grid: surfaces parted on them beside surfaces that are not.

use anyhow::Result;
use libm::{cos, sin};
use range_image::Unmonitored;
use reconstruct::{Face, Surface};
use surfacing::{HeightGrid, Made, Settings, make};

use crate::common::{draws_from, waves};
use crate::told::Told;

/// Nodes of a side, 1 mm apart; a fifth of the tolerance is noise.
const SIDE: usize = 81;
const TOLERANCE_MM: f64 = 0.1;
const NOISE_MM: f64 = 0.02;
/// As the introduction says; none is a seed of a test or of the judge.
const SEEDS: [u64; 3] = [61, 62, 63];
/// Places per pitch at which surfaces are held against the truth, how far from the line, and how far
/// from a place the truth's heights count: so far off may the line be drawn.
const PER_PITCH: usize = 4;
const BESIDE_MM: f64 = 6.0;
const AROUND_MM: f64 = 1.0;
/// Most of a step that a surface may pass it by, where that is not less than the tolerance.
const MOST_OVERSHOOT: f64 = 0.02;

const INTRODUCTION: &str = "
Character lines across the grid, on 81 x 81 points 1 mm apart with noise of 0.02 mm, at a tolerance of
0.1 mm: *whole* is one surface (`--untrimmed`), *parted* what `relief surface` makes by itself, trimmed
where it has more than one face. Overshoot is how far a surface passes beyond the heights that the truth
has within 1 mm of the same place, at four places a millimetre within 6 mm of the line; in percent of
the step, or of what the ridge stands above its lowest foot. The greatest of the seeds 61, 62 and 63, the
most control points, and the fewest and most faces.
";

/// Something at a place in millimetres.
type Place = fn(f64, f64) -> f64;

/// A shape with a line on it.
struct Shape {
    name: String,
    z: Box<dyn Fn(f64, f64) -> f64>,
    /// Distance from the line, millimetres.
    off_mm: Place,
    height_mm: f64,
    /// Whether it is to be parted for sure.
    is_asked: bool,
}

/// Distance from an oblique line.
fn oblique(x_mm: f64, y_mm: f64) -> f64 {
    0.8 * (x_mm - 36.0) + 0.6 * (y_mm - 41.6)
}

/// About the distance from a circle, without a tip in its middle.
fn round(x_mm: f64, y_mm: f64) -> f64 {
    let radius_mm = 24.0;
    let (x, y) = (x_mm - 36.0, y_mm - 41.6);
    (x * x + y * y - radius_mm * radius_mm) / (2.0 * radius_mm)
}

fn ground(x_mm: f64, y_mm: f64) -> f64 {
    let side_mm = (SIDE - 1) as f64;
    waves(x_mm / side_mm, y_mm / side_mm)
}

fn shapes() -> Vec<Shape> {
    let lines: [(&str, Place); 2] = [("oblique", oblique), ("round", round)];
    let mut shapes = Vec::new();
    for (kind, off_mm) in lines {
        for degrees in [10.0_f64, 17.0, 22.0, 37.0, 60.0, 90.0] {
            // Both flanks fall by as much.
            let half = degrees.to_radians() / 2.0;
            let slope = sin(half) / cos(half);
            shapes.push(Shape {
                name: format!("{kind} ridge of {degrees} degrees"),
                z: Box::new(move |x, y| ground(x, y) - slope * off_mm(x, y).abs()),
                off_mm,
                height_mm: slope * farthest_mm(off_mm),
                is_asked: false,
            });
        }
        for step_mm in [0.5, 2.0, 8.0] {
            shapes.push(Shape {
                name: format!("{kind} step of {step_mm} mm"),
                z: Box::new(move |x, y| {
                    ground(x, y) + if off_mm(x, y) > 0.0 { step_mm } else { 0.0 }
                }),
                off_mm,
                height_mm: step_mm,
                is_asked: true,
            });
        }
    }
    shapes
}

/// From the line to the farthest node.
fn farthest_mm(off_mm: Place) -> f64 {
    let nodes = (0..SIDE * SIDE).map(|n| off_mm((n / SIDE) as f64, (n % SIDE) as f64));
    nodes.fold(0.0, |farthest: f64, off| farthest.max(off.abs()))
}

/// What one surface comes to.
#[derive(Default, Clone, Copy)]
struct Figures {
    control_points: usize,
    max_mm: f64,
    overshoot_mm: f64,
    faces: [usize; 2],
}

impl Figures {
    fn worst(self, other: Self) -> Self {
        Self {
            control_points: self.control_points.max(other.control_points),
            max_mm: self.max_mm.max(other.max_mm),
            overshoot_mm: self.overshoot_mm.max(other.overshoot_mm),
            faces: [
                self.faces[0].min(other.faces[0]),
                self.faces[1].max(other.faces[1]),
            ],
        }
    }
}

/// Measures them, and tells where a parted surface is off.
pub(crate) fn measure(short: bool, told: &mut Told) -> Result<()> {
    told.line(INTRODUCTION);
    told.head(&[
        "shape",
        "whole: control points",
        "max mm",
        "overshoot mm",
        "%",
        "parted: faces",
        "control points",
        "max mm",
        "overshoot mm",
        "%",
    ]);
    let seeds = if short { &SEEDS[..1] } else { &SEEDS };
    for shape in shapes() {
        let mut of_both: [Option<Figures>; 2] = [None; 2];
        for &seed in seeds {
            let grid = noisy(&shape, seed)?;
            for (worst, may_trim) in of_both.iter_mut().zip([false, true]) {
                let settings = Settings {
                    may_trim,
                    ..Settings::new(TOLERANCE_MM)
                };
                let figures = figures(&shape, &make(&grid, &settings, &Unmonitored)?);
                *worst = Some(worst.map_or(figures, |worst| worst.worst(figures)));
            }
        }
        let percent = |own: Figures| 100.0 * own.overshoot_mm / shape.height_mm;
        let [whole, parted] = of_both.map(Option::unwrap_or_default);
        told.line(&format!(
            "| {} | {} | {:.4} | {:.3} | {:.1} | {} | {} | {:.4} | {:.3} | {:.1} |",
            shape.name,
            whole.control_points,
            whole.max_mm,
            whole.overshoot_mm,
            percent(whole),
            match parted.faces {
                [least, most] if least == most => least.to_string(),
                [least, most] => format!("{least} to {most}"),
            },
            parted.control_points,
            parted.max_mm,
            parted.overshoot_mm,
            percent(parted)
        ));
        if parted.max_mm > TOLERANCE_MM {
            told.missed
                .push(format!("{}: {} mm off", shape.name, parted.max_mm));
        }
        if parted.control_points > whole.control_points {
            told.missed
                .push(format!("{}: parting takes more control points", shape.name));
        }
        let bar_mm = TOLERANCE_MM.max(MOST_OVERSHOOT * shape.height_mm);
        if shape.is_asked && (parted.faces[0] < 2 || parted.overshoot_mm > bar_mm) {
            told.missed
                .push(format!("{}: rings, or is not parted", shape.name));
        }
    }
    Ok(())
}

fn noisy(shape: &Shape, seed: u64) -> Result<HeightGrid> {
    // Seeds that are near to each other begin far apart.
    let mut draw = draws_from(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    let z = (0..SIDE * SIDE)
        .map(|n| (shape.z)((n / SIDE) as f64, (n % SIDE) as f64) + NOISE_MM * draw())
        .collect();
    Ok(HeightGrid::new(1.0, [0.0; 2], SIDE, SIDE, z)?)
}

fn figures(shape: &Shape, made: &Made) -> Figures {
    let faces = made.trimmed.as_ref().map_or(1, |model| model.faces.len());
    Figures {
        control_points: made.report.control_points,
        max_mm: made.report.max_mm,
        overshoot_mm: overshoot_mm(shape, made),
        faces: [faces; 2],
    }
}

/// Farthest that the surface passes beyond the truth around.
fn overshoot_mm(shape: &Shape, made: &Made) -> f64 {
    let at = Evaluated::of(made);
    let count = (SIDE - 1) * PER_PITCH + 1;
    let place = |k: usize| k as f64 / PER_PITCH as f64;
    // The truth at each place once.
    let truth: Vec<f64> = (0..count * count)
        .map(|n| (shape.z)(place(n / count), place(n % count)))
        .collect();
    let reach = (AROUND_MM * PER_PITCH as f64) as usize;
    let mut worst = 0.0_f64;
    for i in 0..count {
        for j in 0..count {
            let [x_mm, y_mm] = [place(i), place(j)];
            if (shape.off_mm)(x_mm, y_mm).abs() > BESIDE_MM {
                continue;
            }
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for k in i.saturating_sub(reach)..(i + reach + 1).min(count) {
                for l in j.saturating_sub(reach)..(j + reach + 1).min(count) {
                    low = low.min(truth[k * count + l]);
                    high = high.max(truth[k * count + l]);
                }
            }
            let z_mm = at.z_mm(x_mm, y_mm);
            worst = worst.max(z_mm - high).max(low - z_mm);
        }
    }
    worst
}

/// A surface to be evaluated anywhere.
enum Evaluated<'a> {
    Whole(&'a Made),
    Trimmed(Vec<(&'a Face, Vec<Vec<[f64; 2]>>)>),
}

impl<'a> Evaluated<'a> {
    fn of(made: &'a Made) -> Self {
        let Some(model) = &made.trimmed else {
            return Self::Whole(made);
        };
        let outlines = |face: &Face| {
            let loops = core::iter::once(&face.outer).chain(&face.inner);
            let line = |own: &reconstruct::Loop| {
                let curves = own.coedges.iter();
                curves
                    .flat_map(|c| c.parameter_curve.sampled(8))
                    .collect::<Vec<_>>()
            };
            loops.map(line).collect::<Vec<_>>()
        };
        Self::Trimmed(model.faces.iter().map(|f| (f, outlines(f))).collect())
    }

    fn z_mm(&self, x_mm: f64, y_mm: f64) -> f64 {
        match self {
            Self::Whole(made) => {
                // Of pieces along the grid the one that has the nearest node.
                let is_over = |piece: &&surfacing::Piece| {
                    let within = |mm: f64, nodes: &core::ops::Range<usize>| {
                        mm >= nodes.start as f64 - 0.5 && mm <= nodes.end as f64 - 0.5
                    };
                    within(x_mm, &piece.columns) && within(y_mm, &piece.rows)
                };
                let piece = made.pieces.iter().find(is_over);
                piece.map_or(f64::NAN, |p| p.surface.evaluate(x_mm, y_mm)[2])
            }
            Self::Trimmed(faces) => {
                let own = faces.iter().find(|(_, lines)| {
                    lines
                        .iter()
                        .filter(|line| is_within(line, [x_mm, y_mm]))
                        .count()
                        % 2
                        == 1
                });
                own.map_or(f64::NAN, |(face, _)| {
                    let Surface::Patches(patches) = &face.surface;
                    patches.z(x_mm, y_mm)
                })
            }
        }
    }
}

/// By the crossings of a ray along x.
fn is_within(line: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let next = line.iter().cycle().skip(1);
    let crossings = line.iter().zip(next).filter(|(a, b)| {
        (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
    });
    crossings.count() % 2 == 1
}
