//! Outlines settled where the samples say.

use nurbs::PiecewiseCubic;
use range_image::{Cancelled, Monitor};

use super::beside::{Memory, settled, with_samples};
use super::deflect::{Drawn, Rule, deflect};
use super::sway::Sway;
use crate::evidence::Seen;

/// A sample in pitches.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placed {
    pub(crate) region: u16,
    pub(crate) place: [f64; 2],
    pub(crate) seen: Seen,
}

/// Samples beside outlines and steps, and the region of each piece.
#[derive(Debug, Clone, Default)]
pub(crate) struct Outlines {
    pub(crate) samples: Vec<Placed>,
    pub(crate) regions: Vec<u16>,
    /// Of each border, whether z jumps there from one surface to another.
    pub(crate) steps: Vec<bool>,
    /// How closely each border is followed from the beginning, as [`super::map::build`] counts it;
    /// those that are not there, as closely as is needed for none to cross.
    pub(crate) levels: Vec<usize>,
}

/// Farthest that a corner is moved, pitches.
const CORNER_FARTHEST: f64 = 2.0;

/// Moves the outlines, and `junctions` with them. Gives for each path of each border whether the
/// samples told where it lies.
///
/// # Errors
/// Cancelled.
pub(crate) fn settle(
    borders: &mut [Drawn<'_>],
    junctions: &mut [[f64; 2]],
    outlines: &Outlines,
    memory: &mut Memory,
    monitor: &dyn Monitor,
) -> Result<Vec<Vec<bool>>, Cancelled> {
    let count = |b: &Drawn<'_>| b.paths.as_deref().map_or(0, Vec::len);
    if outlines.samples.is_empty() {
        return Ok(borders.iter().map(|b| vec![false; count(b)]).collect());
    }
    let done = settled(with_samples(borders, outlines, monitor)?, memory, monitor)?;
    // Of each border, path by path; a border without outlines stays as it is.
    let mut sways: Vec<Vec<Option<Sway>>> = borders.iter().map(|_| Vec::new()).collect();
    let mut layouts = Vec::new();
    for settled in done {
        let (border, path) = (settled.border, sways[settled.border].len());
        let Some(paths) = borders[border].paths.as_deref_mut() else {
            continue;
        };
        if path == 0 {
            paths.clear();
        }
        let Some(found) = settled.found else {
            paths.push(settled.curve);
            sways[border].push(None);
            continue;
        };
        paths.push(found.base);
        layouts.push(([border, path], found.layout));
        // From inwards to the left.
        sways[border].push(Some(if settled.side > 0.0 {
            found.sway
        } else {
            found.sway.reversed()
        }));
    }
    for (sways, border) in sways.iter_mut().zip(borders.iter()) {
        sways.resize(count(border), None);
    }
    let rule = Rule {
        farthest: CORNER_FARTHEST,
        blunt: true,
        deflection: |[border, path]: [usize; 2], _: &_, _: &_, _| sways[border][path].clone(),
    };
    deflect(borders, junctions, &rule);
    for (of, layout) in layouts {
        monitor.check()?;
        if let Some(path) = path_of(borders, of)
            && let Some(plainer) = layout.plainer(path)
        {
            *path = plainer;
        }
    }
    let is_settled = |paths: &Vec<Option<Sway>>| paths.iter().map(Option::is_some).collect();
    Ok(sways.iter().map(is_settled).collect())
}

fn path_of<'a>(
    borders: &'a mut [Drawn<'_>],
    [border, path]: [usize; 2],
) -> Option<&'a mut PiecewiseCubic<2>> {
    borders[border].paths.as_deref_mut()?.get_mut(path)
}

#[cfg(test)]
mod tests {
    use super::super::cracks::Chain;
    use super::*;
    use range_image::Unmonitored;

    /// Where the border between two pieces of these regions runs, drawn at 0, when samples are
    /// parted at 0.3; `None` where it stays.
    fn settled(regions: [u16; 2], is_step: bool) -> Option<f64> {
        let chain = Chain {
            left: 1,
            right: 2,
            middles: (0..=40).map(|k| [f64::from(k), 0.0]).collect(),
            ends: Some((0, 1)),
        };
        let mut paths = vec![PiecewiseCubic::line([0.0, 0.0], [40.0, 0.0], 40.0).unwrap()];
        let mut samples = Vec::new();
        for k in 1..40 {
            let mut add = |region: u16, y: f64, seen: Seen| {
                let place = [f64::from(k), y];
                samples.push(Placed {
                    region,
                    place,
                    seen,
                });
            };
            add(7, 0.8, Seen::Present);
            add(9, -0.2, Seen::Present);
            // The upper surface hides some of the lower.
            add(9, 1.2, Seen::Missing);
            add(7, -0.6, Seen::Missing);
            add(9, -0.7, Seen::Lost);
        }
        let outlines = Outlines {
            levels: Vec::new(),
            samples,
            regions: regions.to_vec(),
            steps: vec![is_step],
        };
        let mut junctions = [[0.0, 0.0], [40.0, 0.0]];
        let mut borders = [Drawn {
            chain: &chain,
            paths: Some(&mut paths),
            as_drawn: false,
            is_step,
        }];
        let told = settle(
            &mut borders,
            &mut junctions,
            &outlines,
            &mut Memory::default(),
            &Unmonitored,
        );
        let is_told = told.unwrap() == [[true]];
        let (first, last) = paths[0].domain();
        let middle = paths[0].evaluate(0.5 * (first + last))[1];
        assert!(is_told || middle == 0.0, "{middle}");
        is_told.then_some(middle)
    }

    #[test]
    fn a_step_runs_between_the_samples_of_its_two_sides() {
        let middle = settled([7, 9], true).expect("samples tell");
        assert!((middle - 0.3).abs() < 0.05, "{middle}");
    }

    #[test]
    fn samples_do_not_tell_where_a_crease_runs_or_one_region_is_cut() {
        assert_eq!(settled([7, 9], false), None);
        assert_eq!(settled([7, 7], true), None);
    }
}
