//! Writes random parts as solids for a judge, with what it should find:
//! `cargo run --release -p cad-exchange --example random_solids -- FOLDER FIRST_SEED COUNT`.

#![allow(clippy::disallowed_types)]

// Terraces' own tests build these parts, too.
#[path = "../../terraces/tests/random/mod.rs"]
mod random;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{BufWriter, Write as _};

use cad_exchange::step::{LengthUnit, Schema, WriteOptions, write_solid};
use terraces::{SolidSurface, Warning};

const USAGE: &str = "usage: random_solids FOLDER FIRST_SEED COUNT";
/// Places of each part that are looked at.
const PLACES: usize = 150;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, first, count] = &arguments[..] else {
        return Err(USAGE.into());
    };
    fs::create_dir_all(folder)?;
    let (first, count): (u64, u64) = (first.parse()?, count.parse()?);
    let (mut built, mut failed) = (0, 0);
    let mut warnings: BTreeMap<&str, usize> = BTreeMap::new();
    for seed in first..first + count {
        let Some(mut random) = random::random(seed) else {
            println!("{seed}: no part");
            failed += 1;
            continue;
        };
        let solid = match random.part.build() {
            Ok(solid) => solid,
            Err(error) => {
                println!("{seed}: {error}");
                failed += 1;
                continue;
            }
        };
        built += 1;
        let (mut is_parted, mut is_stepped) = (false, false);
        for warning in &solid.warnings {
            let kind = match warning {
                Warning::EdgeLeft { .. } => "edges left as they are",
                Warning::Moved { .. } => "outlines moved",
                Warning::Crossing { .. } => "steps where floors cross",
                Warning::Parted { .. } => "parted",
                _ => "others",
            };
            is_parted |= kind == "parted";
            is_stepped |= kind == "steps where floors cross";
            *warnings.entry(kind).or_default() += 1;
        }
        let unit = [LengthUnit::Millimetre, LengthUnit::Inch][(seed % 4 == 3) as usize];
        let schema = [Schema::Ap242, Schema::Ap214][(seed % 2) as usize];
        let options = WriteOptions {
            schema,
            unit,
            ..WriteOptions::new(format!("part {seed}"), "2026-11-21T09:30:00")
        };
        let mut out = BufWriter::new(File::create(format!("{folder}/{seed}.step"))?);
        write_solid(&solid.solid, &options, &mut out)?;
        out.flush()?;
        let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
        for face in &solid.solid.faces {
            let kind = match face.surface {
                SolidSurface::Plane(_) => "plane",
                SolidSurface::Cylinder { .. } => "cylinder",
                SolidSurface::Cone { .. } => "cone",
                SolidSurface::Sphere { .. } => "sphere",
                SolidSurface::Torus { .. } => "torus",
                SolidSurface::Spline(_) => "spline",
            };
            *kinds.entry(kind).or_default() += 1;
        }
        let faces = solid.solid.faces.iter();
        let palette = &options.palette;
        let faces = faces.map(|f| (&f.name, palette[f.operation % palette.len()]));
        let faces: Vec<String> = faces
            .map(|(name, rgb)| format!("[{name:?}, {rgb:?}]"))
            .collect();
        // Where only the largest part is kept, or floors are stepped, places may differ.
        let wanted = if is_parted || is_stepped { 0 } else { PLACES };
        let frame = random.part.frame;
        let y: [f64; 3] = {
            let ([a, b, c], [x, y, z]) = (frame.z, frame.x);
            [b * z - c * y, c * x - a * z, a * y - b * x]
        };
        let (mut on, mut void) = (Vec::new(), Vec::new());
        for [px, py, pz] in random.places(wanted) {
            let is_void = pz <= random.part.bottom_mm;
            let pz = if is_void { pz + 0.5 } else { pz };
            let at: [f64; 3] = core::array::from_fn(|k| {
                frame.origin_mm[k] + px * frame.x[k] + py * y[k] + pz * frame.z[k]
            });
            if is_void { void.push(at) } else { on.push(at) }
        }
        let mut json = String::new();
        write!(
            json,
            "{{\"seed\": {seed}, \"name\": \"part {seed}\", \"unit_mm\": {:?}, \
             \"volume_mm3\": {:?}, \"is_exact\": {}, \"kinds\": {:?}, \"faces\": [{}], \
             \"z\": {:?}, \"on\": {on:?}, \"void\": {void:?}, \"box_mm\": {:?}}}",
            unit.mm(),
            solid.solid.volume_mm3,
            random.is_exact,
            kinds,
            faces.join(", "),
            frame.z,
            solid.solid.bounding_box_mm(),
        )?;
        fs::write(format!("{folder}/{seed}.json"), json)?;
    }
    println!("{built} parts built, {failed} not; {warnings:?}");
    if failed > 0 {
        return Err(format!("{failed} parts could not be built").into());
    }
    Ok(())
}
