//! `relief scan --preview`.

use relief_api::{ScanPreview, StartScan, path};

use crate::failure::Failure;
use crate::output;
use crate::service::Client;

pub(super) async fn show(client: &Client, request: &StartScan, json: bool) -> Result<(), Failure> {
    let preview: ScanPreview = client.post(path::SCAN_PREVIEW, request).await?;
    output::either(json, &preview, told)
}

fn told(preview: &ScanPreview) -> String {
    let [x_first, x_last] = preview.x_mm;
    let mut lines = vec![format!(
        "columns   {} from x {x_first:.3} to {x_last:.3} mm, {:.3} mm apart",
        preview.columns, preview.column_pitch_mm
    )];
    lines.push(match (preview.y_mm, preview.sample_spacing_mm) {
        (Some([y_first, y_last]), Some(spacing)) => format!(
            "samples   {} from y {y_first:.3} to {y_last:.3} mm, {spacing:.3} mm apart where z is 0",
            preview.samples
        ),
        _ => format!("samples   {}", preview.samples),
    });
    lines.push(match preview.exposure_us {
        0 => "exposure  as the scanner finds best".to_owned(),
        us => format!("exposure  {us} us"),
    });
    lines.push(match preview.least_s {
        Some(seconds) => format!("time      at least {}", time(seconds)),
        None => "time      the scanner does not say how fast it is".to_owned(),
    });
    lines.push(format!(
        "disk      at most {:.1} MB for the columns",
        preview.journal_bytes as f64 / 1e6
    ));
    if let Some([across, up]) = preview.grid_nodes {
        lines.push(format!("grid      at most {across} x {up} nodes"));
    }
    if let Some(window) = preview.window_mm {
        lines.push(format!(
            "window    a node's samples come from within a circle of {window:.2} mm"
        ));
    }
    lines.push(format!(
        "faces     from {:.2} mm2 on, seen from the camera",
        preview.least_face_mm2
    ));
    for (key, value) in &preview.settings {
        lines.push(format!("          {key} = {}", shown(value)));
    }
    lines.extend(preview.notes.iter().map(|note| format!("note      {note}")));
    if let Some(why) = &preview.refused {
        lines.push(format!("refused   at this moment: {why}"));
    }
    lines.join("\n")
}

/// A setting as it is written in the configuration, to a few digits.
fn shown(value: &serde_json::Value) -> String {
    match value.as_f64().filter(|_| value.is_f64()) {
        Some(number) => format!("{}", (number * 1e6).round() / 1e6),
        None => value.to_string(),
    }
}

fn time(seconds: f64) -> String {
    if seconds < 120.0 {
        format!("{seconds:.1} s")
    } else {
        format!("{:.1} min", seconds / 60.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_known_is_not_made_up() {
        let preview = ScanPreview {
            scanner: "scanner".into(),
            columns: 240,
            column_pitch_mm: 0.5,
            x_mm: [-60.0, 59.5],
            samples: 256,
            y_mm: None,
            sample_spacing_mm: None,
            exposure_us: 0,
            least_s: None,
            grid_nodes: None,
            window_mm: None,
            least_face_mm2: 12.5,
            settings: [("regrid.pitch_mm".to_owned(), 0.5.into())].into(),
            journal_bytes: 1_500_000,
            refused: Some("another scan is under way".into()),
            notes: Vec::new(),
        };
        let expected = "\
columns   240 from x -60.000 to 59.500 mm, 0.500 mm apart
samples   256
exposure  as the scanner finds best
time      the scanner does not say how fast it is
disk      at most 1.5 MB for the columns
faces     from 12.50 mm2 on, seen from the camera
          regrid.pitch_mm = 0.5
refused   at this moment: another scan is under way";
        assert_eq!(told(&preview), expected);
        let whole = ScanPreview {
            y_mm: Some([-1.0, 1.0]),
            sample_spacing_mm: Some(0.4),
            least_s: Some(130.0),
            window_mm: Some(3.531),
            grid_nodes: Some([3, 4]),
            ..preview
        };
        let text = told(&whole);
        for words in [
            "y -1.000 to 1.000 mm, 0.400 mm",
            "2.2 min",
            "3.53 mm",
            "3 x 4 nodes",
        ] {
            assert!(text.contains(words), "{text}");
        }
    }
}
