//! Writes a hand-made part as IGES or STEP, for judging with other programs:
//! `cargo run -p cad-exchange --example write_sample -- part.igs 114`, or `part.step ap242`; with a
//! shape after that a rectangle of it, such as `part.igs 190 hollow-cone`.
//! Prints what a judge should find, as JSON.

#![allow(clippy::unwrap_used, clippy::disallowed_types)]

#[allow(dead_code)]
mod sample;

use cad_exchange::iges::{self, Entities};
use cad_exchange::step::{self, LengthUnit, Schema};
use std::fs::File;
use std::io::{BufWriter, Write as _};

const USAGE: &str = "usage: write_sample FILE.igs [114|128|190|186] [SHAPE], \
                     or FILE.step [ap242|ap214|inch] [SHAPE]";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or(USAGE)?;
    let kind = arguments.next();
    let (model, areas_mm2) = match arguments.next().as_deref() {
        None => (sample::model(), sample::areas_mm2().to_vec()),
        Some(name) => {
            let model = sample::of_shape(name).ok_or(USAGE)?;
            let options = step::WriteOptions::new("sample", "2026-11-21T09:30:00");
            let summary = step::write(&model, &options, &mut std::io::sink())?;
            (model, vec![summary.area_mm2])
        }
    };
    let mut out = BufWriter::new(File::create(&path)?);
    if path.ends_with(".igs") {
        let entities = match kind.as_deref() {
            None | Some("114") => Entities::Parametric114,
            Some("128") => Entities::Rational128,
            Some("190") => Entities::Analytic,
            Some("186") => Entities::Boundary,
            Some(_) => return Err(USAGE.into()),
        };
        let options = iges::WriteOptions {
            entities,
            author: "A. Author".to_owned(),
            organization: "Relief".to_owned(),
            ..iges::WriteOptions::new("sample", "20261121.093000")
        };
        iges::write(&model, &options, &mut out)?;
    } else {
        let (schema, unit) = match kind.as_deref() {
            None | Some("ap242") => (Schema::Ap242, LengthUnit::Millimetre),
            Some("ap214") => (Schema::Ap214, LengthUnit::Millimetre),
            Some("inch") => (Schema::Ap242, LengthUnit::Inch),
            Some(_) => return Err(USAGE.into()),
        };
        let options = step::WriteOptions {
            schema,
            unit,
            author: "A. Author".to_owned(),
            organization: "Relief".to_owned(),
            ..step::WriteOptions::new("sample", "2026-11-21T09:30:00")
        };
        step::write(&model, &options, &mut out)?;
    }
    out.flush()?;
    let faces: Vec<String> = model
        .faces
        .iter()
        .zip(areas_mm2)
        .map(|(face, area)| format!("{{\"name\": \"{}\", \"area_mm2\": {area}}}", face.name))
        .collect();
    println!("{{\"faces\": [{}]}}", faces.join(", "));
    Ok(())
}
