//! The page.

use std::collections::HashSet;
use std::fmt::Write as _;

use anyhow::Result;
use fill::{Filled, Method, Outcome, Settings, TriangleMesh, fill};
use glam::DVec3;
use range_image::Unmonitored;
use relief_surfaces::kept::{PICTURES, Page};

use crate::base::{Base, base};
use crate::common::compacted;
use crate::objects::{Object, door, figure, hill};
use crate::scene::{Part, View, picture};

const MODEL: [u8; 3] = [150, 182, 214];
const NEW: [u8; 3] = [244, 176, 92];
const BASE: [u8; 3] = [247, 222, 170];
/// Width of lines along edges, pixels.
const LINE: f64 = 0.6;

/// The page, and its pictures by name, where they are wanted.
pub(crate) fn page(is_drawn: bool) -> Result<Page> {
    let mut page = String::from(
        "# Yoo, done again\n\n\
         Figures 5 to 7 of D.-J. Yoo, *A study on filling holes of the polygon model using implicit surface\n\
         scheme* (section 4), with `relief`'s own code (`--method yoo` is the paper's way). Made by\n\
         `cargo xtask reproduce`; do not edit by hand.\n\n\
         **The objects are made up.** The paper's models are not to be had, and its figures are known to us\n\
         by their captions and text only. Ours are formulas (`tests/fillings/src/figures/objects.rs`), out of\n\
         whose meshes holes are cut: so what was in the holes is known. The paper gives no numbers, neither of\n\
         triangles nor of deviations; it says that holes are closed and that the base surface runs smoothly on\n\
         from the model, also beyond it.\n\n\
         Rows: `--method yoo`, thin plates and Ferguson patches, and Relief, the default. A hole is one trimmed\n\
         surface where its mean normal sees it whole, and several where it does not, which is not in the paper;\n\
         the elements of such a hole are on the implicit surface itself. *Off* is the distance of new vertices from the\n\
         formula, root mean square and largest, in all and the former of the hole's size in the worst hole;\n\
         *border* the largest angle between a new triangle on the border and the formula, beside that of the\n\
         old triangles there. In the pictures what is new is orange, and dark what is seen from behind.\n\n",
    );
    let mut pictures = Vec::new();
    for one in [figure_5, figure_6, figure_7] {
        pictures.extend(one(&mut page, is_drawn)?);
    }
    Ok((page, pictures))
}

type Drawn = Option<(&'static str, Vec<u8>)>;

fn figure_5(page: &mut String, is_drawn: bool) -> Result<Drawn> {
    /// The sheet and 20 mm around.
    const DRAWN_MM: [f64; 2] = [160.0, 132.0];
    let object = hill();
    let base = base(&object.mesh, DVec3::ZERO, DRAWN_MM, [80, 66])?;
    page.push_str(
        "## Figure 5: three holes\n\n\
         The paper: a model with three holes, (a) before, (b) the base surface through all its vertices,\n\
         (c) filled. Ours: an open sheet of 120 x 92 mm with a round hole, a long one and a bent one.\n\n",
    );
    told_base(page, &object, &base);
    let filled = told(page, &object)?;
    caption(
        page,
        5,
        "(a) before, (b) the model on its base surface, which reaches 20 mm beyond it, (c) filled as the paper does.",
    );
    let view = View {
        azimuth_deg: -28.0,
        elevation_deg: 42.0,
        middle_mm: DVec3::new(0.0, 0.0, 4.0),
        across_mm: 205.0,
    };
    drawn(is_drawn, "yoo-figure-5.png", || {
        let panels = [
            (view, vec![meshed(&object.mesh)]),
            (view, vec![sheet(&base.drawn), over(&object.mesh, 2.0)]),
            (view, vec![old(&filled), new(&filled)]),
        ];
        picture(&panels, [340, 260])
    })
}

fn figure_6(page: &mut String, is_drawn: bool) -> Result<Drawn> {
    /// Of the points around a hole those that are taken (section 5 of the paper says so), and how much of
    /// the base surface is drawn.
    const AROUND_MM: f64 = 290.0;
    const DRAWN_MM: f64 = 660.0;
    let object = door();
    let hole = DVec3::new(-30.0, -20.0, 0.0);
    let far = |v: u32| {
        let arm = DVec3::from_array(object.mesh.vertices_mm[v as usize]) - hole;
        libm::hypot(arm.x, arm.y)
    };
    let own = object.mesh.triangles.iter().copied();
    let own = own.filter(|t| t.iter().all(|v| far(*v) < AROUND_MM));
    let near = compacted(&object.mesh, own.collect());
    let base = base(&near, hole, [DRAWN_MM; 2], [66; 2])?;
    page.push_str(
        "## Figure 6: a panel of a car\n\n\
         The paper: a panel of a car's body with one hole of a complex shape, (a) before, (b) the base\n\
         surface, (c) filled. Ours: the panel of a door, 1000 x 720 mm, with a line of character and a hollow\n\
         across the hole; the base surface is put through the points around it alone.\n\n",
    );
    told_base(page, &object, &base);
    let filled = told(page, &object)?;
    caption(
        page,
        6,
        "(a) before, (b) what is taken of the panel on the base surface, nearer, (c) filled as the paper does.",
    );
    let view = View {
        azimuth_deg: -24.0,
        elevation_deg: 48.0,
        middle_mm: DVec3::new(0.0, 0.0, -30.0),
        across_mm: 1190.0,
    };
    let closer = View {
        middle_mm: hole,
        across_mm: 880.0,
        ..view
    };
    drawn(is_drawn, "yoo-figure-6.png", || {
        let panels = [
            (view, vec![meshed(&object.mesh)]),
            (closer, vec![sheet(&base.drawn), over(&near, 8.0)]),
            (view, vec![old(&filled), new(&filled)]),
        ];
        picture(&panels, [340, 280])
    })
}

fn figure_7(page: &mut String, is_drawn: bool) -> Result<Drawn> {
    let object = figure();
    page.push_str(
        "## Figure 7: many holes\n\n\
         The paper: a model for rapid prototyping with holes all over it, (a) before, (b) shaded after they\n\
         were filled. Ours: a figure of 98 mm with holes in head, trunk and limbs.\n\n",
    );
    let filled = told(page, &object)?;
    caption(
        page,
        7,
        "(a) before, from the front and from behind, (b) filled as the paper does, the same.",
    );
    let view = |azimuth_deg: f64| View {
        azimuth_deg,
        elevation_deg: 8.0,
        middle_mm: DVec3::new(0.0, 0.0, 49.0),
        across_mm: 66.0,
    };
    drawn(is_drawn, "yoo-figure-7.png", || {
        let before = |azimuth| (view(azimuth), vec![part(&object.mesh, MODEL)]);
        let after = |azimuth| (view(azimuth), vec![round(&filled), round_new(&filled)]);
        let panels = [before(20.0), before(200.0), after(20.0), after(200.0)];
        picture(&panels, [250, 400])
    })
}

fn drawn(
    is_drawn: bool,
    name: &'static str,
    make: impl FnOnce() -> Result<Vec<u8>>,
) -> Result<Drawn> {
    is_drawn.then(|| Ok((name, make()?))).transpose()
}

fn caption(page: &mut String, number: usize, panels: &str) {
    let _ = writeln!(
        page,
        "\n![Figure {number}]({PICTURES}/yoo-figure-{number}.png)\n\nFrom left to right {panels}\n"
    );
}

fn part(mesh: &TriangleMesh, colour: [u8; 3]) -> Part<'_> {
    Part {
        mesh,
        triangles: 0..mesh.triangles.len(),
        colour,
        line: 0.0,
        lift_mm: 0.0,
        is_round: true,
    }
}

fn meshed(mesh: &TriangleMesh) -> Part<'_> {
    Part {
        line: LINE,
        is_round: false,
        ..part(mesh, MODEL)
    }
}

fn sheet(mesh: &TriangleMesh) -> Part<'_> {
    part(mesh, BASE)
}

/// A model that lies on a sheet: it is in front wherever it may be on both sides of it.
fn over(mesh: &TriangleMesh, lift_mm: f64) -> Part<'_> {
    Part {
        lift_mm,
        ..meshed(mesh)
    }
}

fn old(filled: &Filled) -> Part<'_> {
    Part {
        triangles: 0..filled.old_triangles,
        ..meshed(&filled.mesh)
    }
}

fn new(filled: &Filled) -> Part<'_> {
    Part {
        triangles: filled.old_triangles..filled.mesh.triangles.len(),
        colour: NEW,
        ..meshed(&filled.mesh)
    }
}

fn round(filled: &Filled) -> Part<'_> {
    Part {
        line: 0.0,
        is_round: true,
        ..old(filled)
    }
}

fn round_new(filled: &Filled) -> Part<'_> {
    Part {
        line: 0.0,
        is_round: true,
        ..new(filled)
    }
}

fn told_base(page: &mut String, object: &Object, base: &Base) {
    let inside = object.mesh.vertices_mm.len();
    let _ = writeln!(
        page,
        "The base surface: {} points where the function is zero, {} beside them where it is not; the model has\n\
         {inside} vertices. Those that were taken lie {:.6} mm off it at most, and it is turned against the\n\
         triangles around a vertex by {:.2} degrees at most.\n",
        base.zeros, base.others, base.off_mm, base.turned_deg
    );
}

/// Fills by the paper's way, which is returned, and by ours.
fn told(page: &mut String, object: &Object) -> Result<Filled> {
    page.push_str(
        "| way | vertices before | triangles before | holes | filled | trimmed surfaces | points around | new vertices | new triangles | off mm | largest | of the size % | border deg | of the old | open edges |\n\
         | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n",
    );
    let by = |method: Method| {
        let settings = Settings {
            method,
            patches: true,
            ..Settings::default()
        };
        fill(object.mesh.clone(), &settings, &Unmonitored)
    };
    let [yoo, relief] = [by(Method::Yoo)?, by(Method::Relief)?];
    for (name, own) in [("`--method yoo`", &yoo), ("Relief", &relief)] {
        row(page, name, object, own);
    }
    Ok(yoo)
}

fn row(page: &mut String, name: &str, object: &Object, own: &Filled) {
    let (mut holes, mut filled, mut trimmed, mut around) = (0, 0, 0, Vec::new());
    for hole in &own.holes {
        match hole.outcome {
            Outcome::Filled { points, .. } => {
                filled += 1;
                around.push(points);
            }
            Outcome::Open { .. } => {}
            _ => continue,
        }
        holes += 1;
        trimmed += hole.patch.iter().flatten().map(Vec::len).sum::<usize>();
    }
    let least = around.iter().min().copied().unwrap_or_default();
    let most = around.iter().max().copied().unwrap_or_default();
    let around = if least == most {
        least.to_string()
    } else {
        format!("{least} to {most}")
    };
    let first = object.mesh.vertices_mm.len();
    let offs: Vec<(DVec3, f64)> = own.mesh.vertices_mm[first..]
        .iter()
        .map(|place| DVec3::from_array(*place))
        .map(|place| (place, (object.off)(place).0))
        .collect();
    // New vertices come hole by hole, in the holes' order.
    let mut worst = 0.0_f64;
    let mut next = 0;
    for hole in &own.holes {
        if let Outcome::Filled { vertices, .. } = hole.outcome {
            let its = offs.get(next..next + vertices).unwrap_or_default();
            next += vertices;
            worst = worst.max(rms(its) / hole.hole.size_mm);
        }
    }
    let largest = offs.iter().fold(0.0_f64, |most, own| most.max(own.1.abs()));
    let new = own.mesh.triangles.len() - own.old_triangles;
    let [new_deg, old_deg] = border_deg(own, object);
    let _ = writeln!(
        page,
        "| {name} | {first} | {} | {holes} | {filled} | {trimmed} | {around} | {} | {new} | {:.4} | {largest:.4} | {:.3} | {new_deg:.2} | {old_deg:.2} | {} |",
        object.mesh.triangles.len(),
        offs.len(),
        rms(&offs),
        100.0 * worst,
        open_edges(own)
    );
}

fn rms(offs: &[(DVec3, f64)]) -> f64 {
    let squares: f64 = offs.iter().map(|own| own.1 * own.1).sum();
    (squares / offs.len().max(1) as f64).sqrt()
}

/// The largest angle to the formula of new triangles on the border, and of old ones there.
fn border_deg(own: &Filled, object: &Object) -> [f64; 2] {
    let old = object.mesh.vertices_mm.len() as u32;
    let angle = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| DVec3::from_array(own.mesh.vertices_mm[v as usize]));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let along = normal.dot((object.off)((a + b + c) / 3.0).1);
        libm::acos(along.clamp(-1.0, 1.0)).to_degrees()
    };
    let (before, new) = own.mesh.triangles.split_at(own.old_triangles);
    let border: HashSet<u32> = new.iter().flatten().copied().filter(|v| *v < old).collect();
    [new, before].map(|own| {
        own.iter()
            .filter(|t| t.iter().filter(|v| border.contains(v)).count() >= 2)
            .map(angle)
            .fold(0.0, f64::max)
    })
}

/// Edges of one triangle alone.
fn open_edges(own: &Filled) -> usize {
    let sides = |t: &[u32; 3]| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
    let all: HashSet<(u32, u32)> = own.mesh.triangles.iter().flat_map(sides).collect();
    all.iter().filter(|&&(a, b)| !all.contains(&(b, a))).count()
}
