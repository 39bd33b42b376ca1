//! What is asked of the figures, over all seeds.

use pipeline::Method;

use crate::conditions::Subject;
use crate::experiment::Figures;
use crate::regions::{Reference, RegionFigures};
use crate::results::{Results, of_region};
use crate::tables::{number, oblique_rms_pitches, table};
use crate::upright::Found;

/// At least or at most so much.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Bound {
    AtLeast(f64),
    AtMost(f64),
}

impl Bound {
    /// How far beyond the bound a value is; positive where it misses. NaN misses by far.
    fn missed_by(self, value: f64) -> f64 {
        let by = match self {
            Self::AtLeast(least) => least - value,
            Self::AtMost(most) => value - most,
        };
        if by.is_nan() { f64::INFINITY } else { by }
    }
}

/// A figure, and which it is.
struct Value {
    what: String,
    value: f64,
}

struct Bar {
    what: &'static str,
    bound: Bound,
    unit: &'static str,
    digits: usize,
    values: Vec<Value>,
}

impl Bar {
    fn row(&self) -> Vec<String> {
        let (asked, limit) = match self.bound {
            Bound::AtLeast(limit) => ("at least", limit),
            Bound::AtMost(limit) => ("at most", limit),
        };
        let missed_by = |v: &Value| self.bound.missed_by(v.value);
        let worst = self
            .values
            .iter()
            .max_by(|a, b| missed_by(a).total_cmp(&missed_by(b)));
        let short = |v: f64| format!("{} {}", number(v, self.digits), self.unit);
        let missed = self.values.iter().filter(|v| missed_by(v) > 0.0).count();
        let verdict = if worst.is_none() || missed > 0 {
            "**missed**"
        } else {
            "held"
        };
        let count = self.values.len();
        let share = format!("{} of {count}", count - missed);
        vec![
            self.what.to_owned(),
            format!("{asked} {limit} {}", self.unit),
            worst.map_or_else(|| "none".to_owned(), |w| short(w.value)),
            worst.map_or_else(String::new, |w| w.what.clone()),
            verdict.to_owned(),
            share,
        ]
    }
}

/// Every bar with the worst figure of all runs.
pub(crate) fn bars(results: &Results) -> String {
    let rows: Vec<_> = all(results).iter().map(Bar::row).collect();
    table(
        &["what", "asked", "worst", "where", "verdict", "holds in"],
        &rows,
    )
}

fn all(results: &Results) -> Vec<Bar> {
    let truth = Reference::Truth as usize;
    let image = Reference::RangeImage as usize;
    let regions = |what, method, least, figure: &dyn Fn(&RegionFigures) -> f64| Bar {
        what,
        bound: Bound::AtLeast(least),
        unit: "dB",
        digits: 1,
        values: of_regions(results, method, figure),
    };
    let whole = |what, bound, unit, digits, figure: fn(&Figures) -> f64| Bar {
        what,
        bound,
        unit,
        digits,
        values: of_runs(results, Method::Relief, figure),
    };
    vec![
        regions(
            "`relief`, each region against the truth",
            Method::Relief,
            90.0,
            &|r| r.face_db[truth],
        ),
        regions(
            "`shim-lee`, each region against the truth",
            Method::ShimLee,
            75.0,
            &|r| r.face_db[truth],
        ),
        regions(
            "`relief`, each region against its range image",
            Method::Relief,
            80.0,
            &|r| r.face_db[image],
        ),
        regions(
            "`relief` above Naik & Jain on the same range image, either reference",
            Method::Relief,
            20.0,
            &|r| (r.face_db[truth] - r.naik_db[truth]).min(r.face_db[image] - r.naik_db[image]),
        ),
        whole(
            "`relief`, whole image against its range image: lost and invented",
            Bound::AtMost(0.0),
            "nodes",
            0,
            |f| (f.whole[0].lost_nodes + f.whole[0].invented_nodes) as f64,
        ),
        whole(
            "`relief`, whole image against its range image: SNR",
            Bound::AtLeast(80.0),
            "dB",
            1,
            |f| f.whole[0].snr_db,
        ),
        whole(
            "`relief`, whole image against the image as regridded: lost and invented",
            Bound::AtMost(0.0),
            "nodes",
            0,
            |f| (f.as_regridded.lost_nodes + f.as_regridded.invented_nodes) as f64,
        ),
        whole(
            "`relief`, whole image against the image as regridded: SNR",
            Bound::AtLeast(80.0),
            "dB",
            1,
            |f| f.as_regridded.snr_db,
        ),
        whole(
            "`relief`, whole image against the truth: lost and invented",
            Bound::AtMost(0.0),
            "nodes",
            0,
            |f| (f.whole[1].lost_nodes + f.whole[1].invented_nodes) as f64,
        ),
        whole(
            "`relief`, whole image against the truth: SNR",
            Bound::AtLeast(80.0),
            "dB",
            1,
            |f| f.whole[1].snr_db,
        ),
        whole(
            "`relief`, vertices beyond the truth's corners",
            Bound::AtMost(12.0),
            "vertices",
            0,
            |f| f.vertices as f64 - f.corners as f64,
        ),
        whole(
            "`relief`, trimming curves from the true outlines, the farthest point",
            Bound::AtMost(0.5),
            "pitches",
            2,
            |f| f.trimming.most_mm / f.pitch_mm,
        ),
        whole(
            "`relief`, silhouettes off both axes, rms",
            Bound::AtMost(0.05),
            "pitches",
            3,
            oblique_rms_pitches,
        ),
        Bar {
            what: "`relief`, silhouettes along an axis, beyond the interval that the samples allow",
            bound: Bound::AtMost(0.0),
            unit: "pitches",
            digits: 3,
            values: beyond(&results.upright),
        },
    ]
}

fn beyond(upright: &[Found]) -> Vec<Value> {
    let value = |found: &Found| Value {
        what: format!("House upright, seed {}", found.seed),
        value: found.silhouette.beyond_mm / found.pitch_mm,
    };
    upright.iter().map(value).collect()
}

fn of_runs(results: &Results, method: Method, figure: fn(&Figures) -> f64) -> Vec<Value> {
    let runs = Subject::ALL.into_iter().flat_map(|s| results.of(s, method));
    let value = |e: &crate::results::Entry| Value {
        what: format!("{}, seed {}", e.subject.title(), e.seed),
        value: figure(&e.figures),
    };
    runs.map(value).collect()
}

fn of_regions(
    results: &Results,
    method: Method,
    figure: &dyn Fn(&RegionFigures) -> f64,
) -> Vec<Value> {
    let mut values = Vec::new();
    for subject in Subject::ALL {
        for e in results.of(subject, method) {
            for (k, region) in subject.regions().iter().enumerate() {
                values.push(Value {
                    what: format!("{}, {}, seed {}", subject.title(), region.name, e.seed),
                    value: of_region(&e.figures, k, figure),
                });
            }
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bar(bound: Bound, values: &[f64]) -> Vec<String> {
        let values = values.iter().map(|&value| Value {
            what: format!("case {value}"),
            value,
        });
        let bar = Bar {
            what: "it",
            bound,
            unit: "dB",
            digits: 1,
            values: values.collect(),
        };
        bar.row()
    }

    #[test]
    fn the_worst_decides() {
        let held = bar(Bound::AtLeast(80.0), &[81.0, 80.0, f64::INFINITY]);
        assert_eq!(held[2..], ["80.0 dB", "case 80", "held", "3 of 3"]);
        let missed = bar(Bound::AtMost(0.5), &[0.4, 0.6, 0.7]);
        assert_eq!(missed[2..], ["0.7 dB", "case 0.7", "**missed**", "1 of 3"]);
    }

    #[test]
    fn what_is_not_there_misses() {
        assert_eq!(bar(Bound::AtLeast(1.0), &[2.0, f64::NAN])[4], "**missed**");
        assert_eq!(bar(Bound::AtLeast(1.0), &[])[4], "**missed**");
    }
}
