//! Whether a gap is an opening, by the rays that went there.
//!
//! A ray into an opening comes back from below the surface or not at all. A ray onto a surface comes back
//! from it or is lost: by chance as anywhere, or more often, where it glares or is black; then rays are
//! lost around the gap, too, since gloss and stains have no sharp borders. How often, nobody knows
//! beforehand: shares are integrated over (all values from 0 to 1 being as likely).

/// What became of rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// They came back from the surface that is carried on.
    pub on_surface: u32,
    /// From below it.
    pub below: u32,
    /// From above it.
    pub above: u32,
    /// Not at all.
    pub lost: u32,
}

impl Counts {
    pub(crate) fn returned(&self) -> f64 {
        f64::from(self.on_surface) + f64::from(self.below) + f64::from(self.above)
    }

    pub(crate) fn with(self, other: Self) -> Self {
        Self {
            on_surface: self.on_surface + other.on_surface,
            below: self.below + other.below,
            above: self.above + other.above,
            lost: self.lost + other.lost,
        }
    }

    pub(crate) fn all(&self) -> f64 {
        self.returned() + f64::from(self.lost)
    }
}

/// What rays tell of a gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// Those that went into it, away from its border if it is wide enough for that.
    pub inside: Counts,
    /// Those that went to the surface around it.
    pub around: Counts,
    /// Natural logarithm of the odds of an opening against a surface.
    pub log_odds: f64,
    /// Of the same against a surface of which rays are lost by chance alone.
    pub log_odds_of_chance: f64,
}

/// Rays on surfaces of the whole scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Usual {
    /// How many.
    pub(crate) rays: f64,
    /// Share that is lost.
    pub(crate) lost: f64,
    /// Share of those that come back which come from elsewhere.
    pub(crate) astray: f64,
}

/// Share of what comes back out of an opening from where its surface would be: burrs, chamfers,
/// outliers.
const ON_OPENING: f64 = 0.01;
/// Share of what comes back out of an opening from below.
const BELOW_OPENING: f64 = 0.9;
/// Openings narrower than so many pitches are that rare among gaps as narrow.
const RARE: [(f64, f64); 2] = [(2.5, 0.01), (4.0, 0.1)];
/// Share of gloss and stains that end as sharply as openings do.
const SHARP: f64 = 0.2;

impl Evidence {
    /// `rings` are the rays that went around it, ring by ring from its border outwards; `size` is the
    /// gap's, pitches.
    pub(crate) fn new(inside: Counts, rings: &[Counts], usual: &Usual, size: f64) -> Self {
        let astray = usual.astray;
        let [on, below, above] = [inside.on_surface, inside.below, inside.above].map(f64::from);
        let share = log_beta(f64::from(inside.lost) + 1.0, inside.returned() + 1.0);
        let half = libm::log(0.5 * astray);
        let rarity = RARE.iter().find(|(narrow, _)| size < *narrow);
        let rare = rarity.map_or(0.0, |(_, share)| libm::log(*share));
        let opening = rare
            + share
            + on * libm::log(ON_OPENING)
            + below * libm::log(BELOW_OPENING)
            + above * half;
        let returned = on * libm::log(1.0 - astray) + (below + above) * half;
        let gloss = share + returned + blurred(rings, usual);
        // Chance had every place of the scan to leave such a gap in.
        let chance = libm::log(usual.rays.max(1.0))
            + f64::from(inside.lost) * libm::log(usual.lost)
            + inside.returned() * libm::log(1.0 - usual.lost)
            + returned;
        Self {
            inside,
            around: rings
                .iter()
                .fold(Counts::default(), |sum, own| sum.with(*own)),
            log_odds: opening - log_sum(gloss, chance),
            log_odds_of_chance: opening - chance,
        }
    }
}

/// How much likelier the rays around a gap are if it is blurred than if its border is an opening's,
/// around which as many are lost as anywhere: logarithm of the ratio.
///
/// What is blurred reaches out by one ring, or two, and so on, as likely each, with any share of rays
/// lost in each ring that it reaches.
fn blurred(rings: &[Counts], usual: &Usual) -> f64 {
    let mut reached = 0.0;
    let mut sum = libm::log(SHARP);
    for ring in rings {
        let (lost, back) = (f64::from(ring.lost), ring.returned());
        let as_usual = lost * libm::log(usual.lost) + back * libm::log(1.0 - usual.lost);
        reached += log_beta(lost + 1.0, back + 1.0) - as_usual;
        let own = libm::log((1.0 - SHARP) / rings.len() as f64);
        sum = log_sum(sum, own + reached);
    }
    sum
}

/// Logarithm of Euler's beta function.
fn log_beta(a: f64, b: f64) -> f64 {
    libm::lgamma(a) + libm::lgamma(b) - libm::lgamma(a + b)
}

/// Logarithm of the sum of what two logarithms stand for.
fn log_sum(a: f64, b: f64) -> f64 {
    let most = a.max(b);
    most + libm::log(libm::exp(a - most) + libm::exp(b - most))
}

#[cfg(test)]
mod tests {
    use super::*;

    const USUAL: Usual = Usual {
        rays: 50_000.0,
        lost: 0.02,
        astray: 0.02,
    };

    fn counts(on_surface: u32, below: u32, above: u32, lost: u32) -> Counts {
        Counts {
            on_surface,
            below,
            above,
            lost,
        }
    }

    fn odds(inside: Counts, around: Counts) -> f64 {
        Evidence::new(inside, &[around], &USUAL, 6.0).log_odds
    }

    #[test]
    fn what_comes_back_tells() {
        let ordinary = counts(300, 2, 2, 6);
        assert!(odds(counts(0, 20, 1, 80), ordinary) > 10.0);
        assert!(odds(counts(20, 1, 0, 80), ordinary) < -10.0);
        // Outliers alone are no bottom, and one sample in the plane no surface.
        assert!(odds(counts(30, 3, 1, 100), ordinary) < -10.0);
        assert!(odds(counts(1, 30, 1, 100), ordinary) > 10.0);
    }

    #[test]
    fn where_nothing_comes_back_the_border_tells() {
        let nothing = counts(0, 0, 0, 100);
        assert!(odds(nothing, counts(300, 2, 2, 6)) > 1.0);
        assert!(odds(nothing, counts(150, 2, 2, 150)) < -5.0);
    }

    #[test]
    fn a_border_that_is_blurred_by_one_ring_tells() {
        let rings = |first: u32| [counts(75 - first, 0, 0, first), counts(300, 0, 0, 6)];
        let odds = |first| Evidence::new(counts(0, 0, 0, 120), &rings(first), &USUAL, 9.0).log_odds;
        assert!(odds(3) > 0.5);
        assert!(odds(14) < -5.0);
    }

    #[test]
    fn narrow_openings_need_more() {
        let lost = counts(0, 0, 0, 7);
        let ordinary = counts(177, 1, 1, 4);
        let odds = |size| Evidence::new(lost, &[ordinary], &USUAL, size).log_odds;
        assert!(odds(4.0) > 0.0 && odds(1.5) < 0.0);
    }

    #[test]
    fn chance_takes_few_rays_and_not_many() {
        let ordinary = counts(60, 1, 0, 1);
        assert!(odds(counts(0, 0, 0, 2), ordinary) < 0.0);
        assert!(odds(counts(0, 0, 0, 9), ordinary) > 0.0);
    }
}
