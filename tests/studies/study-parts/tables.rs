//! The tables of the study, as Markdown.

use std::collections::BTreeMap;
use std::fmt::Write;

use relief_tests::score::TruthClass;

use crate::edges::Edges;
use crate::grid::Deviation;
use crate::measure::{Face, Measured};
use crate::numbers::Number;
use crate::part::Kind;
use crate::quality::{Quality, median, quality};

/// What all parts together say.
pub(crate) struct Totals<'a> {
    pub(crate) parts: &'a [Measured],
}

/// Whether a face is of a group.
type IsOf = fn(&Face) -> bool;

fn percent(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole.max(1) as f64
}

impl Totals<'_> {
    pub(crate) fn faces(&self) -> impl Iterator<Item = &Face> {
        self.parts.iter().flat_map(|part| &part.faces)
    }

    /// Percent of the faces whose kind is right.
    pub(crate) fn right(&self) -> f64 {
        let right = self.faces().filter(|face| face.is_right()).count();
        percent(right, self.faces().count())
    }

    /// Percent of the faces that are correct after Hoover et al.
    pub(crate) fn correct(&self) -> f64 {
        percent(self.of_class(TruthClass::Correct), self.faces().count())
    }

    pub(crate) fn of_class(&self, class: TruthClass) -> usize {
        self.faces().filter(|face| face.class == class).count()
    }

    pub(crate) fn noise(&self) -> usize {
        self.parts.iter().map(|part| part.noise).sum()
    }

    /// The numbers of faces of a kind; of every kind without one.
    pub(crate) fn numbers(&self, kind: Option<Kind>) -> Vec<&Number> {
        let faces = self
            .faces()
            .filter(|face| kind.is_none_or(|kind| face.kind == kind));
        let found = faces.filter_map(|face| face.found.as_ref());
        found.flat_map(|found| &found.numbers).collect()
    }

    /// How far exported surfaces lie off the true ones, away from edges: where the true face is
    /// of one of these kinds and, if asked for, has been found.
    pub(crate) fn deviation(&self, of: impl Fn(Kind) -> bool, is_found: bool) -> Deviation {
        let mut all = Deviation::default();
        for part in self.parts {
            for (face, deviation) in &part.on_grid.deviations {
                let kind = part.kinds.get(*face);
                if kind.is_some_and(|kind| of(*kind)) && (!is_found || part.is_found(*face)) {
                    all.join(deviation);
                }
            }
        }
        all
    }

    /// Sums over the grids of all parts.
    pub(crate) fn on_grids(&self, of: impl Fn(&Measured) -> usize) -> usize {
        self.parts.iter().map(of).sum()
    }

    /// True edges of all parts between faces that are seen: the sharp ones, and the smooth.
    pub(crate) fn edges(&self) -> (Edges, Edges) {
        let (mut sharp, mut smooth) = (Edges::default(), Edges::default());
        for part in self.parts {
            sharp.join(&part.sharp_edges);
            smooth.join(&part.smooth_edges);
        }
        (sharp, smooth)
    }

    /// What faces are, and what was found.
    pub(crate) fn kinds(&self) -> String {
        let mut out = String::from("| face is | faces |");
        for kind in Kind::ALL {
            let _ = write!(out, " {kind} |");
        }
        out += " unknown | no region | right, % | correct, % |\n| --- |";
        out += &" ---: |".repeat(Kind::ALL.len() + 5);
        out.push('\n');
        for real in Kind::ALL {
            let faces: Vec<&Face> = self.faces().filter(|face| face.kind == real).collect();
            if faces.is_empty() {
                continue;
            }
            let _ = write!(out, "| {real} | {} |", faces.len());
            let found = |kind: Option<Kind>| {
                let found = faces.iter().filter_map(|face| face.found.as_ref());
                found.filter(|found| found.kind == kind).count()
            };
            for kind in Kind::ALL {
                let _ = write!(out, " {} |", found(Some(kind)));
            }
            let none = faces.iter().filter(|face| face.found.is_none()).count();
            let right = faces.iter().filter(|face| face.is_right()).count();
            let is_correct = |face: &&&Face| face.class == TruthClass::Correct;
            let correct = faces.iter().filter(is_correct).count();
            let _ = writeln!(
                out,
                " {} | {none} | {:.1} | {:.1} |",
                found(None),
                percent(right, faces.len()),
                percent(correct, faces.len())
            );
        }
        out
    }

    /// Faces by whether they join another smoothly, and by their size.
    pub(crate) fn joined(&self) -> String {
        let mut out = String::from(
            "| faces | how many | right kind, % | correct, % | over | under | missed |\n\
             | --- | ---: | ---: | ---: | ---: | ---: | ---: |\n",
        );
        let groups: [(&str, IsOf); 4] = [
            ("with sharp edges only", |face| !face.is_joined),
            ("that join another smoothly", |face| face.is_joined),
            ("of fewer than 500 nodes", |face| face.nodes < 500),
            ("of 500 nodes and more", |face| face.nodes >= 500),
        ];
        for (name, is_of) in groups {
            let faces: Vec<&Face> = self.faces().filter(|face| is_of(face)).collect();
            let of_class = |class| faces.iter().filter(|face| face.class == class).count();
            let right = faces.iter().filter(|face| face.is_right()).count();
            let _ = writeln!(
                out,
                "| {name} | {} | {:.1} | {:.1} | {} | {} | {} |",
                faces.len(),
                percent(right, faces.len()),
                percent(of_class(TruthClass::Correct), faces.len()),
                of_class(TruthClass::Over),
                of_class(TruthClass::Under),
                of_class(TruthClass::Missed),
            );
        }
        out
    }

    /// Errors and stated uncertainties against the bound, by kind and number.
    pub(crate) fn qualities(&self) -> String {
        let mut out = String::from(
            "| of | number | how many | rms error / bound | the same by the median | median stated \
             / bound | within the 95 % interval, % | informed error / bound | median inner bound \
             / bound | median bound |\n| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | \
             ---: |\n",
        );
        for kind in Kind::ALL {
            let numbers = self.numbers(Some(kind));
            let mut rows: BTreeMap<&str, Vec<&Number>> = BTreeMap::new();
            for number in &numbers {
                rows.entry(number.name).or_default().push(number);
            }
            if let Some(all) = quality(&numbers) {
                quality_row(&mut out, &format!("**{kind}**"), "all", &all, None);
            }
            for (name, numbers) in &rows {
                if let Some(own) = quality(numbers) {
                    let bound = median(numbers.iter().map(|number| number.bound).collect());
                    quality_row(&mut out, &kind.to_string(), name, &own, Some(bound));
                }
            }
        }
        out
    }

    /// Deviations of exported surfaces by kind.
    pub(crate) fn deviations(&self) -> String {
        let mut out = String::from(
            "| true face | nodes | rms, mm | most, mm | nodes of faces found | rms, mm | most, mm \
             |\n| --- | ---: | ---: | ---: | ---: | ---: | ---: |\n",
        );
        for kind in Kind::ALL {
            let all = self.deviation(|of| of == kind, false);
            let found = self.deviation(|of| of == kind, true);
            if all.nodes == 0 {
                continue;
            }
            let _ = write!(out, "| {kind} |");
            for deviation in [all, found] {
                let _ = if deviation.nodes == 0 {
                    write!(out, " 0 | - | - |")
                } else {
                    let (rms_mm, most_mm) = (deviation.rms_mm(), deviation.most_mm);
                    write!(out, " {} | {rms_mm:.4} | {most_mm:.3} |", deviation.nodes)
                };
            }
            out.push('\n');
        }
        out
    }

    /// The parts with the most that is not as it should be.
    pub(crate) fn worst(&self, count: usize) -> String {
        let mut parts: Vec<(&Measured, f64)> =
            self.parts.iter().map(|p| (p, p.badness())).collect();
        parts.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut out = String::from(
            "| seed | part | faces | not correct | of the wrong kind | nodes on the wrong side, % | \
             rms, mm | most, mm |\n| ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: |\n",
        );
        for (part, _) in parts.into_iter().take(count) {
            let missed = part.faces.iter().filter(|f| f.class != TruthClass::Correct);
            let wrong = part.faces.iter().filter(|face| !face.is_right());
            let deviation = part.deviation();
            let _ = writeln!(
                out,
                "| {} | {} | {} | {} | {} | {:.2} | {:.4} | {:.3} |",
                part.seed,
                part.name,
                part.faces.len(),
                missed.count(),
                wrong.count(),
                percent(part.on_grid.wrong(), part.on_grid.nodes),
                deviation.rms_mm(),
                deviation.most_mm,
            );
        }
        out
    }
}

fn quality_row(out: &mut String, of: &str, number: &str, quality: &Quality, bound: Option<f64>) {
    let _ = writeln!(
        out,
        "| {of} | {number} | {} | {:.2} | {:.2} | {:.2} | {:.1} | {:.2} | {:.2} | {} |",
        quality.numbers,
        quality.ratio,
        quality.median_ratio,
        quality.width,
        100.0 * quality.covered,
        quality.informed_ratio,
        quality.inner_width,
        bound.map_or_else(String::new, |bound| format!("{bound:.5}")),
    );
}
