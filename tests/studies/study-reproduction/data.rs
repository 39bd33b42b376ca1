//! What the pictures are drawn from: one JSON file for each object, and its IGES files.
//! `docs/pictures/reproduction.py` draws them.

use std::fs;
use std::io::BufWriter;
use std::path::Path;

use anyhow::{Context, Result};
use range_image::RangeImage;
use reconstruct::comparison::{FittedRectangle, fit_both_ways};
use reconstruct::erosion::erosion_residue;
use reconstruct::extension::{NodeRectangle, bounding_rectangle};
use reconstruct::{EdgeKind, Model, Surface};
use relief_tests::outline::polygon;
use segment::{Window, normals};
use serde_json::{Value, json};

use crate::conditions::Subject;
use crate::experiment::Run;

/// Towards the single light of the pseudo-intensity image.
const LIGHT: [f64; 3] = [-0.42, 0.52, 0.744];
/// How far a surface is shown beyond the nodes of its region, nodes.
const BEYOND: i64 = 2;
/// Points of an edge's path to a piece.
const POINTS_PER_PIECE: usize = 24;
/// Label of regions that are none of the object's, in the pictures.
const OTHER: usize = 9;

pub(crate) fn write(folder: &Path, subject: Subject, runs: &[&Run]) -> Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let mut roads = serde_json::Map::new();
    for run in runs {
        let name = format!("{}-{}.igs", subject.name(), run.method);
        fs::write(folder.join(name), &run.iges)?;
        roads.insert(run.method.to_string(), road(run)?);
    }
    let all = json!({ "title": subject.title(), "roads": roads });
    let path = folder.join(format!("{}.json", subject.name()));
    let file =
        fs::File::create(&path).with_context(|| format!("cannot write {}", path.display()))?;
    serde_json::to_writer(BufWriter::new(file), &all)?;
    Ok(())
}

fn road(run: &Run) -> Result<Value> {
    let (image, map) = (&run.image, &run.outcome.regions);
    let model = &run.outcome.reconstruction.model;
    let number = |label: u16| match run.labels.iter().position(|l| *l == Some(label)) {
        _ if label == 0 => 0,
        Some(k) => k + 1,
        None => OTHER,
    };
    let light: Vec<f64> = normals(image, Window::Plain)
        .raw()
        .iter()
        .map(|n| n.iter().zip(LIGHT).map(|(n, l)| n * l).sum())
        .collect();
    let residue: Vec<bool> = erosion_residue(map).iter().map(|r| r.is_border()).collect();
    let labels: Vec<usize> = map.raw_labels().iter().map(|&l| number(l)).collect();
    let faces: Vec<Value> = model
        .faces
        .iter()
        .map(|face| {
            let loops = core::iter::once(&face.outer).chain(&face.inner);
            let loops: Vec<_> = loops.map(|l| polygon(model, l)).collect();
            let Surface::Patches(patches) = &face.surface;
            let member = |c: usize, r: usize| map.label(c, r) == face.region;
            let rectangle = bounding_rectangle(image, member).map(wider);
            let z = |x, y| patches.z(x, y);
            json!({
                "number": number(face.region),
                "loops": loops,
                "surface": rectangle.map(|r| sampled(image, r, z)),
            })
        })
        .collect();
    let mut ways = Vec::new();
    for label in run.labels.iter().flatten() {
        let both = fit_both_ways(image, map, *label)?;
        ways.push(json!({
            "number": number(*label),
            "naik": way(image, &both.background),
            "extension": way(image, &both.extended),
        }));
    }
    Ok(json!({
        "columns": image.columns(),
        "rows": image.rows(),
        "pitch_mm": image.pitch_mm(),
        "x_mm": image.x_mm(0),
        "y_mm": image.y_mm(0),
        "z_mm": image.raw_z_mm(),
        "restored_mm": run.outcome.reconstruction.restored.raw_z_mm(),
        "true_mm": on_grid_of(run),
        "light": light,
        "labels": labels,
        "residue": residue,
        "edges": edges(model),
        "vertices_mm": model.vertices.iter().map(|v| [v.x_mm, v.y_mm]).collect::<Vec<_>>(),
        "faces": faces,
        "ways": ways,
    }))
}

/// z of the truth at the nodes of the range image.
fn on_grid_of(run: &Run) -> Vec<f64> {
    let image = &run.image;
    let nodes = (0..image.columns()).flat_map(|c| (0..image.rows()).map(move |r| (c, r)));
    let z = nodes.map(|(c, r)| run.truth.at(image, c, r).map_or(f64::NAN, |(z, _)| z));
    z.collect()
}

fn wider(tight: NodeRectangle) -> NodeRectangle {
    NodeRectangle {
        column_first: tight.column_first - BEYOND,
        row_first: tight.row_first - BEYOND,
        columns: tight.columns + 2 * BEYOND as usize,
        rows: tight.rows + 2 * BEYOND as usize,
    }
}

/// A function at the nodes of a rectangle.
fn sampled(image: &RangeImage, at: NodeRectangle, z: impl Fn(f64, f64) -> f64) -> Value {
    let pitch_mm = image.pitch_mm();
    let mut z_mm = Vec::with_capacity(at.columns * at.rows);
    for column in 0..at.columns as i64 {
        for row in 0..at.rows as i64 {
            let x = image.x_mm(0) + (at.column_first + column) as f64 * pitch_mm;
            let y = image.y_mm(0) + (at.row_first + row) as f64 * pitch_mm;
            z_mm.push(z(x, y));
        }
    }
    json!({
        "column": at.column_first,
        "row": at.row_first,
        "columns": at.columns,
        "rows": at.rows,
        "z_mm": z_mm,
    })
}

/// What a spline was fitted to, and the spline at the same nodes.
fn way(image: &RangeImage, fitted: &FittedRectangle) -> Value {
    let mut spline = sampled(image, fitted.region.rectangle, |x, y| {
        fitted.spline.value(x, y)
    });
    spline["given_mm"] = json!(fitted.region.z_mm);
    spline
}

fn edges(model: &Model) -> Vec<Value> {
    let kind = |kind| match kind {
        EdgeKind::Silhouette => "silhouette",
        EdgeKind::Step => "step",
        EdgeKind::Crease => "crease",
    };
    let edge = |e: &reconstruct::Edge| json!({ "kind": kind(e.kind), "points_mm": e.path.sampled(POINTS_PER_PIECE) });
    model.edges.iter().map(edge).collect()
}
