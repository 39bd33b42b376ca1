//! Tables 1 and 2 and Figures 1 to 3 and 5 of Jo, Kwon & Han, with like data.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use nurbs::BSplineCurve;
use range_image::Unmonitored;
use relief_surfaces::kept::{PICTURES, Page};
use skin::{Method, Settings, Skin, section_curves, skin};

use crate::figures::{Line, deviations, section};
use crate::torso::{NOISE_MM, POINTS, heights, sections};

const SEED: u64 = 1;
/// The section that is drawn (section 2.1 of the paper), and the tolerance (section 2.2).
const DRAWN_AT_MM: f64 = 1298.0;
const DRAWN_TOLERANCE_MM: f64 = 7.0;
/// Places along a curve that is drawn.
const PLACES: usize = 800;

/// A row of Table 2: sections, tolerance in millimetres, knots after merging, after removal, and
/// control points around a section after that.
struct Published(usize, f64, usize, usize, usize);

const TABLE_2: [Published; 4] = [
    Published(9, 10.0, 218, 22, 18),
    Published(9, 7.0, 285, 28, 24),
    Published(21, 10.0, 408, 27, 23),
    Published(21, 7.0, 571, 31, 27),
];

/// The page and its pictures by name.
pub(crate) fn page() -> Result<Page> {
    let mut page = format!(
        "# Jo, Kwon & Han, done again\n\n\
         Tables 1 and 2 and Figures 1 to 3 and 5 of Jo, Kwon & Han, *A NURBS approximation surface\n\
         representing human body by using knot removal*, with `relief`'s own code (`--method jo` is the\n\
         paper's way). Made by `cargo xtask reproduce`; do not edit by hand.\n\n\
         **The data are made up.** The paper's body scans are not to be had. Ours is a torso by formula\n\
         (`tests/surfaces/src/sections/torso.rs`), hip to neck, limbs left out: {POINTS} points a section at angles\n\
         that are not even, normal noise of {NOISE_MM} mm, seed {SEED}. So the paper's numbers can be\n\
         compared in size only. Its figures are known to us by their captions and text, and Table 1 by\n\
         its caption.\n\n"
    );
    let mut pictures = curves(&mut page)?;
    let made = skins()?;
    table_1(&made, &mut page);
    pictures.push(("jo-figure-5.svg", figure_5(&made, &mut page)?.into()));
    table_2(&made, &mut page);
    Ok((page, pictures))
}

/// Of each row of Table 2: by the paper's way, and by ours.
fn skins() -> Result<Vec<[Skin; 2]>> {
    let by = |count: usize, tolerance_mm: f64, method: Method| {
        let settings = Settings {
            method,
            ..Settings::new(tolerance_mm)
        };
        let what = || format!("{count} sections, {tolerance_mm} mm");
        skin(&sections(&heights(count), SEED), &settings, &Unmonitored).with_context(what)
    };
    let both = |Published(count, tolerance_mm, ..): &Published| {
        Ok([
            by(*count, *tolerance_mm, Method::Jo)?,
            by(*count, *tolerance_mm, Method::Relief)?,
        ])
    };
    TABLE_2.iter().map(both).collect()
}

fn flat(points: &[[f64; 3]]) -> Vec<[f64; 2]> {
    points.iter().map(|[x, y, _]| [*x, *y]).collect()
}

fn drawn(curve: &BSplineCurve<3>) -> Vec<[f64; 2]> {
    let at = |k: usize| curve.evaluate(k as f64 / PLACES as f64);
    flat(&(0..=PLACES).map(at).collect::<Vec<_>>())
}

/// The greatest distance of a data point from a curve, and its root mean square; millimetres.
fn off(curve: &BSplineCurve<3>, points: &[[f64; 3]]) -> [f64; 2] {
    let off_mm = points.iter().map(|p| curve.closest(*p).distance);
    let (most, squares) = off_mm.fold((0.0_f64, 0.0), |(most, sum), d| (most.max(d), sum + d * d));
    [most, (squares / points.len() as f64).sqrt()]
}

/// Figures 1 to 3.
fn curves(page: &mut String) -> Result<Vec<(&'static str, Vec<u8>)>> {
    // Sections come in stacks: a second one, that is not drawn.
    let stack = sections(&[DRAWN_AT_MM, DRAWN_AT_MM + 50.0], SEED);
    let curves = section_curves(&stack, DRAWN_TOLERANCE_MM, &Unmonitored)?;
    let own = curves.first().context("no curve")?;
    let _ = write!(
        page,
        "## Figures 1 to 3: a section's curves\n\n\
         The paper: a section of the body at a height of 1.298 m, (1) interpolated, (2) by least squares\n\
         within 0.007 m, (3) both. It gives no numbers.\n\n\
         | curve | knots | control points | farthest data point mm | rms mm |\n| --- | ---: | ---: | ---: | ---: |\n"
    );
    for (name, curve) in [
        ("interpolating", &own.interpolating),
        ("approximating", &own.approximating),
    ] {
        let [most, rms] = off(curve, &own.points);
        let (knots, points) = (curve.knots().knots().len(), curve.points().len());
        let _ = writeln!(
            page,
            "| {name} | {knots} | {points} | {most:.3} | {rms:.3} |"
        );
    }
    let _ = writeln!(
        page,
        "\n![Figure 1]({PICTURES}/jo-figure-1.svg)\n\n![Figure 2]({PICTURES}/jo-figure-2.svg)\n\n\
         ![Figure 3]({PICTURES}/jo-figure-3.svg)\n\n\
         Dots are the data, squares the control points of the approximating curve.\n"
    );
    let points = flat(&own.points);
    let (through, near) = (drawn(&own.interpolating), drawn(&own.approximating));
    let polygon = flat(own.approximating.points());
    let interpolating = || Line {
        label: format!(
            "interpolating, {} control points",
            own.interpolating.points().len()
        ),
        class: "i",
        places: &through,
    };
    let approximating = || Line {
        label: format!(
            "within {DRAWN_TOLERANCE_MM} mm, {} control points",
            polygon.len()
        ),
        class: "c",
        places: &near,
    };
    let control = Line {
        label: "control points".to_owned(),
        class: "p",
        places: &polygon,
    };
    Ok(vec![
        (
            "jo-figure-1.svg",
            section(&points, &[interpolating()]).into(),
        ),
        (
            "jo-figure-2.svg",
            section(&points, &[approximating(), control]).into(),
        ),
        (
            "jo-figure-3.svg",
            section(&[], &[interpolating(), approximating()]).into(),
        ),
    ])
}

fn table_1(made: &[[Skin; 2]], page: &mut String) {
    let _ = write!(
        page,
        "## Table 1: knots after approximation\n\n\
         The paper: knots of each section's own curve. Its numbers are not known to us; ours, from hip to\n\
         neck:\n\n| sections | tolerance mm | knots of the sections |\n| ---: | ---: | --- |\n"
    );
    for (Published(count, tolerance_mm, ..), [jo, _]) in TABLE_2.iter().zip(made) {
        let knots: Vec<String> = jo
            .counts
            .of_sections
            .iter()
            .map(ToString::to_string)
            .collect();
        let _ = writeln!(page, "| {count} | {tolerance_mm} | {} |", knots.join(", "));
    }
    page.push('\n');
}

/// Deviations of the middle section of the last row but two before and after knots are removed.
fn figure_5(made: &[[Skin; 2]], page: &mut String) -> Result<String> {
    const ROW: usize = 1;
    let Published(count, tolerance_mm, ..) = &TABLE_2[ROW];
    let [jo, _] = made.get(ROW).context("no such row")?;
    let middle = count / 2;
    let of = jo
        .deviations
        .iter()
        .zip(&jo.before_mm)
        .filter(|(own, _)| own.section == middle);
    let (after, before): (Vec<f64>, Vec<f64>) =
        of.map(|(own, before)| (own.off_mm, *before)).unzip();
    let most = |off_mm: &[f64]| off_mm.iter().copied().fold(0.0, f64::max);
    let _ = writeln!(
        page,
        "## Figure 5: deviations before and after knots are removed\n\n\
         The paper: what the approximation has spent of the tolerance counts when knots are removed. It\n\
         gives no numbers. Ours: section {} of {count} at {tolerance_mm} mm, {:.3} mm at most before and {:.3} mm after; of\n\
         all sections {:.3} and {:.3} mm.\n\n![Figure 5]({PICTURES}/jo-figure-5.svg)\n",
        middle + 1,
        most(&before),
        most(&after),
        most(&jo.before_mm),
        jo.most_mm(),
    );
    Ok(deviations(
        *tolerance_mm,
        &[("before", "i", &before), ("after", "c", &after)],
    ))
}

fn table_2(made: &[[Skin; 2]], page: &mut String) {
    page.push_str(
        "## Table 2: knots and control points\n\n\
         \"Relief\" is the default method: common knots from the start, closed with C2, fewer rows than\n\
         sections. Points in all are those of the surface; the paper's, of as many rows as sections, are its\n\
         points around times the sections.\n\n\
         | sections | tolerance mm | | knots merged | knots after removal | points around | rows | points in all | farthest mm |\n\
         | ---: | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: |\n",
    );
    for (Published(count, tolerance_mm, merged, removed, around), [jo, own]) in
        TABLE_2.iter().zip(made)
    {
        let _ = writeln!(
            page,
            "| {count} | {tolerance_mm} | paper | {merged} | {removed} | {around} | {count} | {} | not given |",
            around * count
        );
        for (name, found) in [("`--method jo`", jo), ("Relief", own)] {
            let counts = &found.counts;
            let merged = counts
                .merged
                .map_or_else(|| "-".to_owned(), |merged| merged.to_string());
            let _ = writeln!(
                page,
                "| {count} | {tolerance_mm} | {name} | {merged} | {} | {} | {} | {} | {:.3} |",
                counts.around,
                counts.points_around,
                counts.rows,
                counts.points(),
                found.most_mm(),
            );
        }
    }
    page.push_str(
        "\nThe paper: the data grow with the sections and with a narrower tolerance. So they do here. With\n\
         Relief they grow less than the sections, since rows are taken out that their neighbours tell as well.\n",
    );
}
