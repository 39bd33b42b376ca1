//! Writes a hand-made part as IGES, for judging with other programs:
//! `cargo run -p cad-exchange --example write_sample -- part.igs 114`.
//! Prints what a judge should find, as JSON.

#![allow(clippy::unwrap_used, clippy::disallowed_types)]

mod sample;

use cad_exchange::iges::{self, Entities, WriteOptions};
use std::fs::File;
use std::io::{BufWriter, Write as _};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments
        .next()
        .ok_or("usage: write_sample FILE.igs [114|128]")?;
    let entities = match arguments.next().as_deref() {
        None | Some("114") => Entities::Parametric114,
        Some("128") => Entities::Rational128,
        Some(other) => return Err(format!("{other}: expected 114 or 128").into()),
    };
    let options = WriteOptions {
        entities,
        author: "A. Author".to_owned(),
        organization: "Relief".to_owned(),
        ..WriteOptions::new("sample", "20261121.093000")
    };
    let model = sample::model();
    let mut out = BufWriter::new(File::create(&path)?);
    iges::write(&model, &options, &mut out)?;
    out.flush()?;
    let faces: Vec<String> = model
        .faces
        .iter()
        .zip(sample::areas_mm2())
        .map(|(face, area)| format!("{{\"name\": \"{}\", \"area_mm2\": {area}}}", face.name))
        .collect();
    println!("{{\"faces\": [{}]}}", faces.join(", "));
    Ok(())
}
