//! Where a surface ends with nothing behind it.
//!
//! The last samples of the columns lie anywhere up to one spacing inside the outline. Where
//! the next one would be, there is none, so the outline passes between the samples and
//! those places, and the line that separates the two is known better than any one column
//! tells.

use super::arc::Arc;
use super::missing::{Around, Places};
use super::posterior::Posterior;
use super::side::{Labelled, Line, lengthen, separate};
use super::surfaces::Surface;
use super::wedge::Wedge;
use crate::neighbours::Neighbour;

/// Windows in which samples and missing ones are looked at, first around the node and then
/// along the line found there.
const WINDOWS: usize = 8;
const FAR: [usize; 2] = [25, 16];
/// The same where it is bent, by and by.
const BENT: [usize; 4] = [4, 8, 16, 25];
/// The same beside a corner.
const CORNER: usize = 16;
/// Farther inside of the line, in spacings, a node beside the samples owes that to something
/// else than the line, as where the scan ends or where outliers lie in its surface's stead.
const ELSEWHERE: f64 = 1.0;

/// Where a node lies to the outline that ends its surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    Inside,
    Outside,
    /// Well inside, or no sample is missing anywhere around.
    Clear,
    /// Samples are missing, but not beyond any line.
    Unknown,
}

/// Finds silhouettes; keeps its buffers from one node to the next.
#[derive(Debug, Default)]
pub(crate) struct Silhouette {
    samples: Vec<Neighbour>,
    places: Places,
    labelled: Vec<Labelled>,
    kept: Vec<Labelled>,
    posterior: Posterior,
}

impl Silhouette {
    /// Where the node lies to the outline that ends its surfaces, or, where these do not tell,
    /// this one of them: what shows far behind it fills the places where its samples are missing.
    /// `wider` gives the samples of so many windows, nearest first.
    pub(crate) fn side(
        &mut self,
        around: &Around<'_>,
        surface: &Surface,
        mut wider: impl FnMut(&mut Vec<Neighbour>, usize),
    ) -> Side {
        let alone = Around {
            before: Some(*surface),
            ..*around
        };
        match self.side_of(around, &mut wider) {
            Side::Unknown => self.side_of(&alone, &mut wider),
            known => known,
        }
    }

    fn side_of(
        &mut self,
        around: &Around<'_>,
        wider: &mut impl FnMut(&mut Vec<Neighbour>, usize),
    ) -> Side {
        self.samples.clear();
        wider(&mut self.samples, WINDOWS);
        if self.label(usize::MAX, around, None).is_none() {
            return if self.places.are_whole() {
                Side::Clear
            } else {
                Side::Unknown
            };
        }
        let Some(line) = separate(&mut self.labelled, &mut self.posterior) else {
            return Side::Unknown;
        };
        let mut distance = line.distance();
        if line.is_near() {
            self.samples.clear();
            wider(&mut self.samples, FAR[0]);
            distance = self.lengthened(&line, around).unwrap_or(distance);
        }
        match distance {
            d if d > ELSEWHERE => Side::Clear,
            d if d > 0.0 => Side::Inside,
            _ => Side::Outside,
        }
    }

    /// The node's distance from the edge that this line is part of: straight as far as it goes
    /// on so, else bent, else with a corner, else bent as far as an arc goes on.
    fn lengthened(&mut self, line: &Line, around: &Around<'_>) -> Option<f64> {
        if let Some(distance) = self.straight(line, around) {
            return Some(distance);
        }
        let bent = self.bent(line, around);
        match bent {
            Some((distance, true)) => Some(distance),
            _ => self.corner(line, around).or(bent.map(|bent| bent.0)),
        }
    }

    /// The node's distance from the corner that the line leads to.
    fn corner(&mut self, line: &Line, around: &Around<'_>) -> Option<f64> {
        let dropped = self.label(CORNER, around, Some(line))?;
        let wedge = Wedge::find(
            line,
            dropped,
            &self.labelled,
            &mut self.kept,
            &mut self.posterior,
        )?;
        Some(wedge.distance())
    }

    /// The node's distance from the line as far as it goes on straight.
    fn straight(&mut self, line: &Line, around: &Around<'_>) -> Option<f64> {
        FAR.into_iter().find_map(|windows| {
            let dropped = self.label(windows, around, Some(line))?;
            let longer = lengthen(
                line,
                dropped,
                &mut self.labelled,
                &mut self.kept,
                &mut self.posterior,
            )?;
            Some(longer.distance())
        })
    }

    /// The node's distance from the arc that the line is part of, and whether it goes on as
    /// far as was looked.
    fn bent(&mut self, line: &Line, around: &Around<'_>) -> Option<(f64, bool)> {
        let mut followed = None;
        let mut next = Arc::of(line);
        for windows in BENT {
            let dropped = self.label(windows, around, Some(line))?;
            let longer = next.follow(dropped, &self.labelled, &mut self.kept, &mut self.posterior);
            let Some(longer) = longer else { break };
            next = longer;
            followed = Some((longer.distance(), windows >= CORNER));
        }
        followed
    }

    /// Labels the samples of so many of the `FAR` windows, and the places near them where
    /// samples are missing. Returns the share of samples that are lost beside the line, or
    /// everywhere; `None` where none are missing.
    fn label(&mut self, windows: usize, around: &Around<'_>, line: Option<&Line>) -> Option<f64> {
        let number = match line {
            Some(_) => self.samples.len() * windows / FAR[0],
            None => self.samples.len(),
        };
        self.places.find(self.samples.get(..number)?, around)?;
        Some(self.places.label(around.spacing, line, &mut self.labelled))
    }
}
