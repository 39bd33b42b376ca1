//! Samples of what lies behind, beneath the surface in front of it.
//!
//! The rays of a column are not parallel. Past an edge that faces away from the middle of the
//! fan they go on outwards, and meet what lies far behind at a y at which the surface in front
//! still has samples. A range image has one z at each place, that of the surface in front, so
//! what lies beneath it tells nothing, but would take places in windows and blur where the
//! surface in front ends.
//!
//! A groove is no such thing: each sample of its bottom is one that its brim has not. So
//! beneath means between two samples of the front that are as near to each other as neighbours.

use super::lower_median;

/// Usual distances in y between two samples, within which they are neighbours. Between those of
/// a brim, with one sample of a groove in between, there are two.
const NEIGHBOURS: f64 = 1.6;
/// Usual distances beyond the last sample of a front that covers some, within which it may go on.
const BEYOND: f64 = 1.0;
/// Steepest slope, over a usual distance, of a surface that is seen: what lies farther behind is
/// none of it.
const STEEPEST: f64 = 6.0;
/// Fewest samples of which a usual distance is told.
const LEAST: usize = 8;

/// Takes out the hidden ones of samples in ascending y.
pub(super) fn take_out(samples: &mut Vec<(f64, f64)>) {
    if samples.len() < LEAST {
        return;
    }
    let gaps = samples.windows(2).map(|pair| pair[1].0 - pair[0].0);
    let mut gaps: Vec<f64> = gaps.filter(|gap| *gap > 0.0).collect();
    let Some(usual_mm) = lower_median(&mut gaps) else {
        return;
    };
    let column = Column {
        samples,
        usual_mm,
        far_mm: STEEPEST * usual_mm,
    };
    let mut covers = vec![false; samples.len()];
    let mut is_hidden = vec![false; samples.len()];
    for (k, is_hidden) in is_hidden.iter_mut().enumerate() {
        if let Some((low, high)) = column.cover(k) {
            *is_hidden = true;
            (covers[low], covers[high]) = (true, true);
        }
    }
    if !is_hidden.contains(&true) {
        return;
    }
    for (k, is_hidden) in is_hidden.iter_mut().enumerate() {
        let mut before = column.before(k, BEYOND).chain(column.after(k, BEYOND));
        *is_hidden |= before.any(|front| covers[front]);
    }
    let mut is_hidden = is_hidden.into_iter();
    samples.retain(|_| !is_hidden.next().unwrap_or(false));
}

struct Column<'a> {
    samples: &'a [(f64, f64)],
    usual_mm: f64,
    far_mm: f64,
}

impl Column<'_> {
    /// The neighbours on one surface between which a sample lies, far behind.
    fn cover(&self, k: usize) -> Option<(usize, usize)> {
        let low = self.before(k, NEIGHBOURS).next()?;
        let high = self.after(k, NEIGHBOURS).next()?;
        let ((y0, z0), (y1, z1)) = (self.samples[low], self.samples[high]);
        let is_near = y1 - y0 <= NEIGHBOURS * self.usual_mm;
        (is_near && (z1 - z0).abs() <= self.far_mm).then_some((low, high))
    }

    /// The samples below this one, nearest first, within so many usual distances, that it lies
    /// far behind.
    fn before(&self, k: usize, within: f64) -> impl Iterator<Item = usize> {
        self.of((0..k).rev(), k, within)
    }

    /// The same above it.
    fn after(&self, k: usize, within: f64) -> impl Iterator<Item = usize> {
        self.of(k + 1..self.samples.len(), k, within)
    }

    fn of(
        &self,
        places: impl Iterator<Item = usize>,
        k: usize,
        within: f64,
    ) -> impl Iterator<Item = usize> {
        let (y, z) = self.samples[k];
        places
            .take_while(move |j| (self.samples[*j].0 - y).abs() <= within * self.usual_mm)
            .filter(move |j| self.samples[*j].1 - z > self.far_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a fan of rays from 400 mm before z = 0 meets of a plate at z = 0 from y = 40 to `end`
    /// and a wall 40 mm behind it.
    fn column(end_mm: f64) -> Vec<(f64, f64)> {
        let rays = (0..300).map(|k| 0.001 * f64::from(k));
        let mut samples: Vec<(f64, f64)> = rays
            .map(|slope| match 400.0 * slope {
                y if (40.0..=end_mm).contains(&y) => (y, 0.0),
                _ => (440.0 * slope, -40.0),
            })
            .collect();
        samples.sort_by(|s, t| s.0.total_cmp(&t.0));
        samples
    }

    #[test]
    fn what_lies_beneath_an_edge_is_taken_out() {
        let before = column(80.0);
        let beneath = |s: &&(f64, f64)| s.1 < -1.0 && s.0 > 40.0 && s.0 < 44.0;
        let hidden = before.iter().filter(beneath).count();
        assert!((7..=11).contains(&hidden), "{hidden}");
        let mut after = before.clone();
        take_out(&mut after);
        // Of the first ray past the edge nothing tells whether the plate goes on beneath it.
        assert!(!after.iter().any(|s| beneath(&s)), "{after:?}");
        let of_plate = |samples: &[(f64, f64)]| samples.iter().filter(|s| s.1 == 0.0).count();
        assert_eq!(of_plate(&after), of_plate(&before));
        assert!(before.len() - after.len() <= hidden + 2);
    }

    #[test]
    fn a_groove_keeps_its_bottom() {
        for width in 1..4 {
            let is_groove = |k: i32| (20..20 + width).contains(&k);
            let samples: Vec<_> = (0..60)
                .map(|k| (0.4 * f64::from(k), if is_groove(k) { -10.0 } else { 0.0 }))
                .collect();
            let mut after = samples.clone();
            take_out(&mut after);
            assert_eq!(after, samples, "{width}");
        }
    }

    #[test]
    fn noise_and_slopes_hide_nothing() {
        let samples: Vec<_> = (0..200)
            .map(|k| {
                let y = 0.4 * f64::from(k) + 0.15 * f64::from(k * 7 % 5);
                (y, 4.0 * y + 0.3 * f64::from(k * 13 % 7))
            })
            .collect();
        let mut after = samples.clone();
        take_out(&mut after);
        assert_eq!(after, samples);
    }
}
