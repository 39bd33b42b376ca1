//! What something higher hides: from the laser, whose rays stop at it, or from the sensor, which does not
//! see where they end.

use crate::sight::Sight;

/// Steps along a line, pitches.
const STRIDE: f64 = 0.5;
/// What stands higher than the line by so many pitches hides.
const MARGIN: f64 = 0.25;
/// Where edges are is known to a node: what lies a pitch nearer to what hides it may be hidden, too.
const VAGUE: f64 = 1.0;

/// Where the sensor stands. Scanners tell where the laser's rays come from, but not that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sensor {
    /// x and y from the laser, or from any place along z where rays are parallel, by distance in z.
    lean: [f64; 2],
}

/// A place on a surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spot {
    pub(crate) node: usize,
    pub(crate) z_mm: f64,
}

/// Lines from places towards laser and sensor.
pub(crate) struct Shadows<'a> {
    sight: &'a Sight<'a>,
    /// Heights of nodes that belong to regions; least where they do not.
    heights_mm: Vec<f64>,
    top_mm: f64,
}

impl<'a> Shadows<'a> {
    pub(crate) fn new(sight: &'a Sight<'a>, labels: &[u16]) -> Self {
        let z = labels.iter().zip(sight.image.raw_z_mm());
        let heights_mm: Vec<f64> = z
            .map(|(&label, &z)| {
                if label != 0 && !z.is_nan() {
                    z
                } else {
                    f64::NEG_INFINITY
                }
            })
            .collect();
        let top_mm = heights_mm.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Self {
            sight,
            heights_mm,
            top_mm,
        }
    }

    /// Whether a place would be hidden, give or take a pitch.
    pub(crate) fn hides(&self, spot: Spot, sensor: Option<Sensor>) -> bool {
        let leans = sensor.map(|own| self.towards(spot, own));
        [Some(self.to_laser(spot)), leans]
            .into_iter()
            .flatten()
            .any(|lean| self.is_blocked(spot, lean, VAGUE))
    }

    /// How the line to the laser leans at a place: x and y by z.
    fn to_laser(&self, spot: Spot) -> [f64; 2] {
        let (_, row) = self.sight.grid().place(spot.node);
        match self.sight.camera_mm {
            Some([y, z]) => [0.0, (y - self.sight.image.y_mm(row)) / (z - spot.z_mm)],
            None => [0.0, 0.0],
        }
    }

    fn towards(&self, spot: Spot, sensor: Sensor) -> [f64; 2] {
        let laser = self.to_laser(spot);
        [laser[0] + sensor.lean[0], laser[1] + sensor.lean[1]]
    }

    /// Whether something stands in a line that leaves a place, moved along it by so many pitches.
    fn is_blocked(&self, spot: Spot, lean: [f64; 2], moved: f64) -> bool {
        let length = libm::hypot(lean[0], lean[1]);
        if !(length > LEAST_LEAN && length.is_finite()) {
            return false;
        }
        let grid = self.sight.grid();
        let pitch_mm = self.sight.image.pitch_mm();
        let (column, row) = grid.place(spot.node);
        let way = [lean[0] / length, lean[1] / length];
        let rise_mm = STRIDE * pitch_mm / length;
        let mut steps = 1.0;
        loop {
            let line_mm = spot.z_mm + steps * rise_mm + MARGIN * pitch_mm;
            if line_mm > self.top_mm {
                return false;
            }
            let far = STRIDE * steps + moved;
            let at = |first: usize, way: f64| libm::round(first as f64 + way * far) as i64;
            let Some(node) = grid.node(at(column, way[0]), at(row, way[1])) else {
                return false;
            };
            if self.heights_mm[node] > line_mm {
                return true;
            }
            steps += 1.0;
        }
    }

    /// The place of the sensor that hides what is missing and none of what is seen; `None` where
    /// nothing speaks for one.
    ///
    /// `missing` are places on surfaces carried on to where nothing was measured, `seen` such where
    /// something was.
    pub(crate) fn sensor(&self, missing: &[Spot], seen: &[Spot]) -> Option<Sensor> {
        let (missing, seen) = (thinned(missing), thinned(seen));
        let told = |lean: [f64; 2]| {
            let hidden = |spots: &[Spot]| {
                let each = spots.iter().filter(|spot| {
                    self.is_blocked(**spot, self.to_laser(**spot), 0.0)
                        || self.is_blocked(**spot, self.towards(**spot, Sensor { lean }), 0.0)
                });
                each.count() as f64
            };
            let (lost, wrong) = (hidden(&missing), hidden(&seen));
            lost * libm::log(EXPLAINED / UNEXPLAINED) - wrong * libm::log((1.0 - SEEN) / SEEN)
        };
        let nothing = told([0.0, 0.0]);
        let mut best = (nothing + LEAST_GAIN, None);
        let mut take = |lean: [f64; 2]| {
            let own = told(lean);
            if own > best.0 {
                best = (own, Some(lean));
            }
        };
        for azimuth in 0..AZIMUTHS {
            let (sin, cos) =
                libm::sincos(core::f64::consts::TAU * azimuth as f64 / AZIMUTHS as f64);
            for step in 0..LEANS {
                let lean = FIRST_LEAN * libm::pow(NEXT_LEAN, step as f64);
                take([lean * cos, lean * sin]);
            }
        }
        best.1.map(|lean| Sensor { lean })
    }
}

/// Lines that lean less run along z.
const LEAST_LEAN: f64 = 1e-6;
/// Share of what is missing behind something, and of what is missing elsewhere, beside steps.
const EXPLAINED: f64 = 0.9;
const UNEXPLAINED: f64 = 0.1;
/// Share of what is seen though something seems to hide it.
const SEEN: f64 = 0.05;
/// A sensor must make what is missing so much likelier, in natural logarithms.
const LEAST_GAIN: f64 = 10.0;
/// Places that are tried.
const AZIMUTHS: usize = 16;
const LEANS: usize = 24;
const FIRST_LEAN: f64 = 0.04;
const NEXT_LEAN: f64 = 1.15;
/// Spots that are looked at.
const MOST_SPOTS: usize = 3000;

/// Evenly spread ones, if there are too many.
fn thinned(spots: &[Spot]) -> Vec<Spot> {
    let every = spots.len().div_ceil(MOST_SPOTS).max(1);
    spots.iter().copied().step_by(every).collect()
}
