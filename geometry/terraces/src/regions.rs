//! What is done where: the operations and the treated edges as regions of the plan, each with a
//! height and a rule.

use std::collections::BTreeSet;

use crate::arrange::Drawing;
use crate::emit::FLAT_PART;
use crate::error::BuildError;
use crate::height::Height;
use crate::outline::Outline;
use crate::part::{Floor, Kind, Part};
use crate::plan::{P2, Piece, distance};

/// What a region does to the cells within it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Rule {
    /// The block itself.
    Fill,
    /// Lowers what is higher, but not what stands above a ceiling.
    Lower { ceiling: f64 },
    /// Raises what is lower, but not what lies below a floor.
    Lift { floor: f64 },
}

/// What of an operation a surface is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// The block's top, an operation's floor or top.
    Floor,
    /// A wall.
    Wall,
    /// The chamfer or round of an upper edge.
    UpperEdge,
    /// The chamfer or fillet of a lower edge.
    LowerEdge,
    /// The block's bottom.
    Bottom,
}

/// A region of the plan and what is done there. Operation 0 is the block.
#[derive(Debug, Clone)]
pub(crate) struct Region {
    pub(crate) operation: usize,
    pub(crate) role: Role,
    pub(crate) height: usize,
    pub(crate) rule: Rule,
    pub(crate) bounds: [P2; 2],
}

/// Regions, surfaces and the drawing that they are of.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scene {
    /// The bottom is number 0.
    pub(crate) heights: Vec<Height>,
    pub(crate) regions: Vec<Region>,
    pub(crate) drawing: Drawing,
    /// Crossings that have been drawn: region (none for the bottom) and both surfaces.
    pub(crate) crossed: BTreeSet<(Option<usize>, usize, usize)>,
}

impl Scene {
    /// An empty scene with a bottom.
    pub(crate) fn new(part: &Part) -> Self {
        let mut scene = Self::default();
        scene.heights.push(Height::Level { z: part.bottom_mm });
        scene
    }

    /// The number of a surface, one that is there if it is the same.
    pub(crate) fn height(&mut self, height: Height, snap_mm: f64) -> usize {
        let tolerance = snap_mm.max(1e-6);
        let known = self
            .heights
            .iter()
            .position(|other| other.is(&height, tolerance));
        known.unwrap_or_else(|| {
            self.heights.push(height);
            self.heights.len() - 1
        })
    }

    pub(crate) fn add(&mut self, region: Region, border: &[Piece]) {
        self.drawing.add_loop(border, self.regions.len());
        self.regions.push(region);
    }

    /// Adds the block or an operation.
    pub(crate) fn add_operation(
        &mut self,
        part: &Part,
        index: usize,
        outline: &Outline,
    ) -> Result<(), BuildError> {
        let bounds = outline.bounds();
        let (height, rule) = if index == 0 {
            (Height::Level { z: part.top_mm }, Rule::Fill)
        } else {
            let operation = &part.operations[index - 1];
            let rule = match operation.kind {
                Kind::Cut => Rule::Lower {
                    ceiling: f64::INFINITY,
                },
                Kind::Raise => Rule::Lift {
                    floor: f64::NEG_INFINITY,
                },
            };
            let height = floor(part, index - 1, outline)?;
            (height, rule)
        };
        let center = match (&height, outline.as_circle()) {
            (Height::Ring { c, r, .. }, _) if farthest(outline, *c) <= FLAT_PART * r => None,
            (_, Some((c, _))) if height.axis().is_some_and(|axis| distance(axis, c) < 1e-9) => {
                Some((c, outline.pieces()[0].from()))
            }
            (Height::Ring { c, .. }, _) => {
                let far = [0, 1, 2, 3].map(|k| distance(*c, [bounds[k & 1][0], bounds[k >> 1][1]]));
                let reach = far.into_iter().fold(0.0, f64::max);
                Some((*c, [c[0] + reach, c[1]]))
            }
            _ => None,
        };
        if let Some((from, to)) = center {
            // From the axis outwards, where a face around it is cut open.
            self.drawing.add(&Piece::Line { from, to }, None, true);
        }
        let height = self.height(height, part.snap_mm);
        let region = Region {
            operation: index,
            role: Role::Floor,
            height,
            rule,
            bounds,
        };
        self.add(region, outline.pieces());
        Ok(())
    }
}

/// The surface of an operation's floor.
fn floor(part: &Part, index: usize, outline: &Outline) -> Result<Height, BuildError> {
    let operation = &part.operations[index];
    let wrong = |what| {
        Err(BuildError::Floor {
            name: operation.name.clone(),
            what,
        })
    };
    let is_cut = operation.kind == Kind::Cut;
    let ends = outline.bounds();
    let height = match operation.floor {
        Floor::Level { z_mm } => Height::Level { z: z_mm },
        Floor::Plane { z_mm, slope } if distance(slope, [0.0; 2]) < 1e-9 => {
            Height::Level { z: z_mm }
        }
        Floor::Plane { z_mm, slope } => Height::Plane { z: z_mm, slope },
        Floor::Through if is_cut => Height::Level { z: part.bottom_mm },
        Floor::Through => return wrong("only a cut goes through"),
        Floor::Tip { rim_mm, angle_rad } => {
            let Some((c, r)) = outline.as_circle() else {
                return wrong("a conical tip needs a circular outline");
            };
            if !(0.2..3.1).contains(&angle_rad) {
                return wrong("the angle of its tip is not between 0.2 and 3.1 rad");
            }
            let slope = 1.0 / libm::tan(0.5 * angle_rad);
            let slope = if is_cut { slope } else { -slope };
            Height::Cone {
                c,
                z: rim_mm - slope * r,
                slope,
            }
        }
        Floor::Sphere {
            center_mm: [x, y, z],
            radius_mm,
        } => {
            if farthest(outline, [x, y]) > radius_mm + 1e-6 {
                return wrong("its outline reaches beyond its sphere");
            }
            Height::Ring {
                c: [x, y],
                ring: 0.0,
                z,
                r: radius_mm,
                side: if is_cut { -1.0 } else { 1.0 },
            }
        }
        Floor::FreeForm(ref spline) => {
            let block = part.outline.bounds();
            let domain = [spline.u_knots().domain(), spline.v_knots().domain()];
            for k in 0..2 {
                let (from, to) = (ends[0][k].max(block[0][k]), ends[1][k].min(block[1][k]));
                if domain[k].0 > from + 1e-9 || domain[k].1 < to - 1e-9 {
                    return wrong("its heights do not cover its outline");
                }
            }
            if !spline.points().iter().all(|[z]| z.is_finite()) {
                return wrong("a height is not finite");
            }
            Height::Spline(spline.clone())
        }
    };
    let [a, b] = ends;
    let corners = [a, b, [a[0], b[1]], [b[0], a[1]]];
    if !corners.iter().all(|&corner| height.at(corner).abs() < 1e6) {
        return wrong("a height is not finite or beyond 1e6 mm");
    }
    Ok(height)
}

/// Distance of the farthest place of an outline.
fn farthest(outline: &Outline, from: P2) -> f64 {
    let pieces = outline.pieces().iter();
    let places = pieces.flat_map(|piece| (0..16).map(|k| piece.at(f64::from(k) / 16.0)));
    places.map(|at| distance(at, from)).fold(0.0, f64::max)
}
