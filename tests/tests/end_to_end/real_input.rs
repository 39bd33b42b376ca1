//! A scan of a real object by a real scanner, sent over the wire again.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Result;
use relief_tests::direct::{self, Label};
use relief_tests::rig::{Rig, recording};

/// The view, if it is there: it is not part of the source.
fn view() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../shared/data/stanford_bunny/bun000.ply.gz");
    if path.is_file() {
        return Some(path);
    }
    println!("skipped: {} is not there", path.display());
    None
}

/// A fifth of the view's columns, from its middle: the model is made four times.
fn cut(view: &Path, folder: &Path) -> Result<PathBuf> {
    let columns = scan_files::read(view, &scan_files::ReadOptions::default())?.columns;
    let count = columns.len();
    let mut text = String::new();
    for column in &columns[2 * count / 5..3 * count / 5] {
        for sample in &column.samples {
            writeln!(text, "{} {} {}", column.x_mm, sample.y_mm, sample.z_mm)?;
        }
    }
    let path = folder.join("bunny.xyz");
    fs::write(&path, text)?;
    Ok(path)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_real_scan_gives_the_same_file_by_wire_and_directly() -> Result<()> {
    let Some(view) = view() else {
        return Ok(());
    };
    let folder = tempfile::tempdir()?;
    let input = cut(&view, folder.path())?;
    let rig = Rig::start(&recording(input.clone())).await?;
    let mut request = super::named("bunny");
    request.operator = "A. Measurer".into();
    let ended = rig.scan_to_result(&request).await?;
    let sent = scan_files::read(&input, &scan_files::ReadOptions::default())?;
    assert_eq!(ended.scan.columns as usize, sent.columns.len());
    let result = rig.result(&ended.scan.id).await?;
    let report = result.json("report.json")?;
    assert_eq!(report["scan"]["samples"], sent.points());
    assert!(
        report["model"]["faces"]
            .as_u64()
            .is_some_and(|faces| faces >= 1)
    );

    let label = Label::of(&ended.scan)?;
    let direct = direct::scan_file(&input, &label, 0)?;
    assert!(
        result.iges()? == &direct,
        "the file read directly gives other bytes"
    );
    let journal = rig.journal(&ended.scan.id).await?;
    let from_journal = direct::journal(&journal, &label, 0)?;
    assert!(
        result.iges()? == &from_journal,
        "the journal gives other bytes"
    );
    let converted = rig.folder().join("converted.igs");
    if let Some(converted) = direct::program(&input, &label, &converted)? {
        assert!(
            result.iges()? == &converted,
            "`relief convert` gives other bytes"
        );
    }
    rig.end().await
}
