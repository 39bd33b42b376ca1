//! The surface as the finishing cutter sees it, in directions along and across the passes.

use crate::cusp::level_step_mm;
use crate::cutter::Cutter;
use crate::surface::Surface;

/// A cutter over a surface, with passes in a direction.
pub(crate) struct Field<'a> {
    pub(crate) surface: &'a Surface,
    pub(crate) cutter: Cutter,
    /// Unit direction of passes.
    pub(crate) along: [f64; 2],
    /// Limits along and across them, within the cutter's reach of the surface.
    pub(crate) s: [f64; 2],
    pub(crate) t: [f64; 2],
}

impl<'a> Field<'a> {
    pub(crate) fn new(surface: &'a Surface, cutter: Cutter, angle_deg: f64) -> Self {
        let (sine, cosine) = libm::sincos(angle_deg.to_radians());
        // Right angles are meant as such.
        let round = |c: f64| {
            if c.abs() < 1e-12 {
                0.0
            } else if c.abs() > 1.0 - 1e-12 {
                c.signum()
            } else {
                c
            }
        };
        let along = [round(cosine), round(sine)];
        let [low, high] = surface.bounds_mm();
        let mut field = Self {
            surface,
            cutter,
            along,
            s: [f64::INFINITY, f64::NEG_INFINITY],
            t: [f64::INFINITY, f64::NEG_INFINITY],
        };
        let reach = cutter.radius_mm();
        for x in [low[0] - reach, high[0] + reach] {
            for y in [low[1] - reach, high[1] + reach] {
                let (s, t) = (x * along[0] + y * along[1], y * along[0] - x * along[1]);
                field.s = [field.s[0].min(s), field.s[1].max(s)];
                field.t = [field.t[0].min(t), field.t[1].max(t)];
            }
        }
        field
    }

    pub(crate) fn place(&self, s: f64, t: f64) -> [f64; 2] {
        let [x, y] = self.along;
        [s * x - t * y, s * y + t * x]
    }

    /// How many places there would be on passes that leave cusps of this height on level ground,
    /// so far from each other along them; slopes have more.
    pub(crate) fn places(&self, cusp_mm: f64, step_mm: f64) -> usize {
        let count = |[from, to]: [f64; 2], step: f64| ((to - from) / step).ceil() as usize + 1;
        let across = level_step_mm(&self.cutter, cusp_mm).max(1e-3);
        count(self.t, across).saturating_mul(count(self.s, step_mm))
    }

    /// Height of the tip where the cutter mills the surface: it touches a face, or stands above the
    /// surface. Elsewhere it would only roll around the outline.
    pub(crate) fn tip(&self, at: [f64; 2]) -> Option<f64> {
        self.contact(at).map(|(tip, _)| tip)
    }

    /// The same; `None` also where it is not below `limit_mm`.
    pub(crate) fn tip_below(&self, at: [f64; 2], limit_mm: f64) -> Option<f64> {
        self.contact_below(at, limit_mm).map(|(tip, _)| tip)
    }

    fn contact(&self, at: [f64; 2]) -> Option<(f64, bool)> {
        self.contact_below(at, f64::INFINITY)
    }

    fn contact_below(&self, at: [f64; 2], limit_mm: f64) -> Option<(f64, bool)> {
        let contact = self.surface.drop_below(&self.cutter, at, limit_mm)?;
        let mills = !contact.on_edge || self.surface.height_mm(at).is_some();
        mills.then_some((contact.z_mm, contact.on_edge))
    }

    /// The height for a way and a place across, and whether the cutter is on an edge there.
    pub(crate) fn contact_at(&self, s: f64, t: f64) -> Option<(f64, bool)> {
        self.contact(self.place(s, t))
    }

    /// The same for a way and a place across.
    pub(crate) fn tip_at(&self, s: f64, t: f64) -> Option<f64> {
        self.tip(self.place(s, t))
    }

    /// Ways along a pass, so many of them within the cutter's radius that slopes and cusps can be told
    /// from heights there.
    pub(crate) fn stations(&self, in_radius: f64) -> Vec<f64> {
        let [low, high] = self.s;
        let step = (self.cutter.radius_mm() / in_radius).min((high - low) / 64.0);
        let count = ((high - low) / step).ceil().clamp(8.0, 4000.0) as usize;
        (0..=count)
            .map(|k| low + (high - low) * k as f64 / count as f64)
            .collect()
    }
}
