//! Scans that end in surfaces and an NC program.

use anyhow::{Context, Result, ensure};
use cad_exchange::iges;
use nurbs::BSplineSurface;
use relief_tests::rig::{Published, Rig, small_house};
use reliefd::Config;
use serde_json::{Value, json};

use crate::named;

/// A machine with room for the house on its table.
const MACHINE: &str = r#"
dialect = "linuxcnc"
safe_z_mm = 100.0
work_offset_mm = [300.0, 200.0, -150.0]
rapid_mm_per_min = 6000.0
max_feed_mm_per_min = 3000.0
spindle_rpm = [1000.0, 24000.0]
[travel]
x_mm = [0.0, 600.0]
y_mm = [0.0, 500.0]
z_mm = [-300.0, 0.0]
[stock]
x_mm = [-100.0, 100.0]
y_mm = [-100.0, 150.0]
z_mm = [-80.0, 80.0]
[[tools]]
number = 1
cutter = "ball:10"
flutes = 2
spindle_rpm = 12000
feed_mm_per_min = 1000
plunge_mm_per_min = 300
[[tools]]
number = 2
cutter = "ball:400"
flutes = 2
spindle_rpm = 1000
feed_mm_per_min = 1000
plunge_mm_per_min = 300
"#;

const CONFIG: &str = r#"
[deliverables.surface]
tolerance_mm = 0.5
[deliverables.skin]
tolerance_mm = 0.5
every_mm = 5.0
[deliverables.toolpath]
machine = "machine.toml"
tool = "ball:10"
scallop_mm = 0.5
tolerance_mm = 0.1
pitch_mm = 1.0
"#;

/// A service whose configuration asks for all three.
async fn rig() -> Result<Rig> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("relief.toml");
    std::fs::write(folder.path().join("machine.toml"), MACHINE)?;
    std::fs::write(&file, CONFIG)?;
    let read = Config::load_with_files(&file)?;
    Rig::start_with(&small_house(), |config| {
        config.deliverables = read.deliverables;
    })
    .await
}

fn is_listed(result: &Published, name: &str) -> Result<()> {
    let manifest = result.json("manifest.json")?;
    let files = manifest["files"].as_array().context("files")?;
    let listed = files.iter().find(|file| file["name"] == *name);
    let listed = listed.with_context(|| format!("{name} is not in the manifest"))?;
    assert_eq!(listed["bytes"], json!(result.file(name)?.len()));
    assert_eq!(listed["sha256"], json!(result.sha256(name)?));
    Ok(())
}

/// B-spline surfaces of a file, whole or, where character lines run across the grid, trimmed.
fn surfaces(file: &[u8]) -> Result<Vec<BSplineSurface>> {
    if let Ok(whole) = iges::read_surfaces(file) {
        return Ok(whole.into_iter().map(|own| own.surface).collect());
    }
    let faces = iges::read_model(file)?.faces.into_iter();
    faces
        .map(|face| match face.surface {
            iges::TrimmedSurface::BSpline(surface) => Ok(surface),
            other => anyhow::bail!("a face on {other:?}"),
        })
        .collect()
}

/// Least and greatest coordinates of a surface's control points.
fn extent(surface: &BSplineSurface) -> [[f64; 2]; 3] {
    let mut extent = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for point in surface.points() {
        for (axis, value) in extent.iter_mut().zip(point) {
            *axis = [axis[0].min(*value), axis[1].max(*value)];
        }
    }
    extent
}

/// Greatest and least coordinates of a program's moves, in those of the model.
fn moves(program: &str) -> Result<[[f64; 2]; 3]> {
    let mut extent = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for line in program.lines().filter(|line| !line.contains("G53")) {
        for word in line.split_whitespace() {
            let Some(axis) = word.get(..1).and_then(|letter| "XYZ".find(letter)) else {
                continue;
            };
            let value: f64 = word[1..].parse().with_context(|| line.to_owned())?;
            let [low, high] = extent[axis];
            extent[axis] = [low.min(value), high.max(value)];
        }
    }
    Ok(extent)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_ends_in_surfaces_and_an_nc_program() -> Result<()> {
    let rig = rig().await?;
    let ended = rig.scan_to_result(&named("house")).await?;
    assert_eq!(ended.job.left_out, Vec::<String>::new());
    let stages: Vec<&str> = ended.job.timings.iter().map(|t| t.stage.as_str()).collect();
    assert!(
        stages
            .windows(3)
            .any(|s| s == ["surface", "skin", "toolpath"]),
        "{stages:?}"
    );
    let result = rig.result(&ended.scan.id).await?;
    for name in [
        "house.igs",
        "house.surface.igs",
        "house.skin.igs",
        "house.nc",
        "surface-deviations.png",
        "surface-contours.png",
        "surface-curvature.png",
        "skin-sections.png",
        "skin-deviations.png",
        "toolpath.png",
    ] {
        is_listed(&result, name)?;
    }
    let report = result.json("report.json")?;
    surfaces_are_what_the_report_says(&result, &report)?;
    the_program_is_within_travel(&result, &report)?;
    let settings = &report["settings"];
    assert_eq!(settings["surface"]["knots"], "optimal");
    assert_eq!(settings["skin"]["every_mm"], 5.0);
    assert_eq!(settings["toolpath"]["machine"]["tools"][0]["number"], 1);
    assert_eq!(result.json("manifest.json")?["settings"], *settings);

    // Again, with what was kept with the scan: the same bytes. Without two of them: not there.
    let again = rig.rerun_to_result(&ended.scan.id, &[]).await?;
    let again = rig.result(&again.result).await?;
    let off = [
        ("deliverables.skin", json!("off")),
        ("deliverables.toolpath", json!("off")),
    ];
    let fewer = rig.rerun_to_result(&ended.scan.id, &off).await?;
    let fewer = rig.result(&fewer.result).await?;
    for name in [
        "house.igs",
        "house.surface.igs",
        "house.skin.igs",
        "house.nc",
    ] {
        assert_eq!(again.sha256(name)?, result.sha256(name)?, "{name}");
        let is_off = name.contains("skin") || name.contains("nc");
        assert_eq!(fewer.files.contains_key(name), !is_off, "{name}");
    }
    the_surface_of_a_roof_is_milled(&rig, &ended.scan.id).await?;
    rig.end().await
}

/// A part of the scan without steps, whose surface is milled in place of the model.
async fn the_surface_of_a_roof_is_milled(rig: &Rig, scan: &str) -> Result<()> {
    let roof = [
        ("deliverables.skin", json!("off")),
        ("deliverables.toolpath.of", json!("surface")),
        ("regrid.roi_x_mm", json!([-20.0, 20.0])),
        ("regrid.roi_y_mm", json!([-10.0, 5.0])),
    ];
    let roof = rig.rerun_to_result(scan, &roof).await?;
    assert_eq!(roof.left_out, Vec::<String>::new());
    let result = rig.result(&roof.result).await?;
    let report = result.json("report.json")?;
    assert_eq!(report["toolpath"]["of"], "surface");
    let [x, y, _] = moves(&String::from_utf8(result.file("house.nc")?.to_vec())?)?;
    ensure!(x[0] >= -30.0 && x[1] <= 30.0, "x {x:?}");
    ensure!(y[0] >= -20.0 && y[1] <= 15.0, "y {y:?}");
    Ok(())
}

fn surfaces_are_what_the_report_says(result: &Published, report: &Value) -> Result<()> {
    let low = report["range_image"]["z_min_mm"].as_f64().context("z")?;
    let high = report["range_image"]["z_max_mm"].as_f64().context("z")?;
    for (key, name) in [("surface", "house.surface.igs"), ("skin", "house.skin.igs")] {
        let told = &report[key];
        assert_eq!(told["file"], name);
        let read = surfaces(result.file(name)?.as_ref())?;
        ensure!(!read.is_empty(), "no surface in {name}");
        let points: usize = read.iter().map(|own| own.points().len()).sum();
        let [_, _, z] = extent(&read[0]);
        // Control points swing beyond what they make, but not far.
        ensure!(
            z[0] > low - 60.0 && z[1] < high + 60.0,
            "{name}: {z:?}, measured {low} to {high}"
        );
        if key == "skin" {
            assert_eq!(told["counts"]["points"], json!(points));
            assert_eq!(read.len(), 1);
            assert_eq!(told["deviation"]["within_tolerance_share"], 1.0);
        } else {
            let max = told["surface"]["max_mm"].as_f64().context("max_mm")?;
            ensure!(max <= 0.5, "{max} mm off");
            ensure!(
                points
                    >= told["surface"]["control_points"]
                        .as_u64()
                        .context("points")? as usize
            );
        }
    }
    Ok(())
}

fn the_program_is_within_travel(result: &Published, report: &Value) -> Result<()> {
    let told = &report["toolpath"];
    assert_eq!(
        (&told["file"], &told["of"]),
        (&json!("house.nc"), &json!("model"))
    );
    assert_eq!(told["operations"][0]["cutter"], "ball:10");
    let gouge = told["simulation"]["gouge_mm"].as_f64().context("gouge")?;
    ensure!(gouge <= 0.01, "{gouge} mm too deep");
    let program = String::from_utf8(result.file("house.nc")?.to_vec())?;
    ensure!(program.ends_with("M30\n%\n"), "no end");
    ensure!(program.contains("(model: house)"), "no title");
    let [x, y, z] = moves(&program)?;
    // The work offset is (300, 200, -150).
    ensure!(x[0] + 300.0 >= 0.0 && x[1] + 300.0 <= 600.0, "x {x:?}");
    ensure!(y[0] + 200.0 >= 0.0 && y[1] + 200.0 <= 500.0, "y {y:?}");
    ensure!(z[0] - 150.0 >= -300.0 && z[1] - 150.0 <= 0.0, "z {z:?}");
    ensure!(x[1] - x[0] > 20.0 && y[1] - y[0] > 20.0, "hardly moves");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_tool_too_large_leaves_the_rest_and_says_why() -> Result<()> {
    let rig = rig().await?;
    let mut request = named("house");
    request.settings = [
        ("deliverables.toolpath.tool".to_owned(), json!("ball:400")),
        ("deliverables.toolpath.scallop_mm".to_owned(), json!(0.5)),
    ]
    .into();
    let ended = rig.scan_to_result(&request).await?;
    let [why] = ended.job.left_out.as_slice() else {
        anyhow::bail!("{:?}", ended.job.left_out);
    };
    ensure!(
        why.starts_with("house.nc was left out: ") && why.contains("ball:400"),
        "{why}"
    );
    let result = rig.result(&ended.scan.id).await?;
    for name in [
        "house.igs",
        "house.surface.igs",
        "house.skin.igs",
        "report.html",
    ] {
        is_listed(&result, name)?;
    }
    ensure!(
        !result.files.keys().any(|name| name.ends_with(".nc")),
        "a program"
    );
    let report = result.json("report.json")?;
    let warnings = report["warnings"].as_array().context("warnings")?;
    ensure!(warnings.contains(&json!(why)), "{warnings:?}");
    assert_eq!(report["toolpath"], Value::Null);
    rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_is_cancelled_while_it_plans() -> Result<()> {
    let rig = rig().await?;
    let ended = rig
        .scan_to_result(&{
            let mut request = named("house");
            request.settings = [("deliverables.toolpath".to_owned(), json!("off"))].into();
            request
        })
        .await?;
    let machine: Value = serde_json::to_value(toml::from_str::<toml::Value>(MACHINE)?)?;
    let mut events = rig.client().events().await?;
    let slow = [
        ("deliverables.toolpath.machine", machine),
        ("deliverables.toolpath.tool", json!("ball:10")),
        ("deliverables.toolpath.scallop_mm", json!(0.0002)),
    ];
    let job = rig.rerun(&ended.scan.id, &slow).await?;
    let planning = |event: &relief_api::Event| match event {
        relief_api::Event::Progress { job: id, stage, .. }
            if *id == job.id && stage == "toolpath" =>
        {
            Some(())
        }
        _ => None,
    };
    events.until(planning).await?;
    let _: relief_api::Job = rig
        .client()
        .ask(&relief_api::path::job_cancel(job.id))
        .await?;
    let job = events
        .job_becomes(job.id, relief_api::JobState::is_over)
        .await?;
    assert_eq!(job.state, relief_api::JobState::Cancelled);
    assert_eq!(rig.spooled()?, [ended.scan.id], "nothing of it is left");
    rig.end().await
}
