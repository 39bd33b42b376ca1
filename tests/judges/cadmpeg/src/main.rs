//! Judges an IGES file with `cadmpeg-codec-iges`, which shares no code with us:
//! `judge-cadmpeg FILE.igs [EXPECTED_FACES]`. Prints what was read and what was lost;
//! exits with 1 when faces are missing or something was lost by error.

use std::fs::File;
use std::process::ExitCode;

use cadmpeg_codec_iges::IgesCodec;
use cadmpeg_ir::report::Severity;
use cadmpeg_ir::{Codec, DecodeOptions};

fn main() -> ExitCode {
    match judge() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            eprintln!("judge-cadmpeg: {error}");
            ExitCode::from(2)
        }
    }
}

fn judge() -> Result<bool, Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments
        .next()
        .ok_or("usage: judge-cadmpeg FILE.igs [EXPECTED_FACES]")?;
    let expected: Option<usize> = arguments.next().map(|n| n.parse()).transpose()?;
    let mut input = File::open(&path).map_err(|error| format!("{path}: {error}"))?;
    let result = IgesCodec.decode(&mut input, &DecodeOptions::default())?;
    let model = &result.ir().model;
    println!(
        "{path}: {} faces, {} loops, {} edges, {} vertices, {} surfaces, {} curves",
        model.faces.len(),
        model.loops.len(),
        model.edges.len(),
        model.vertices.len(),
        model.surfaces.len(),
        model.curves.len(),
    );
    for face in &model.faces {
        println!("face {:?}, colour {:?}", face.name, face.color);
    }
    let mut errors = 0;
    for loss in &result.report().losses {
        println!("{:?}: {}", loss.severity, loss.message);
        if matches!(loss.severity, Severity::Error | Severity::Blocking) {
            errors += 1;
        }
    }
    let complete = expected.is_none_or(|count| count == model.faces.len());
    Ok(errors == 0 && complete && !model.faces.is_empty())
}
