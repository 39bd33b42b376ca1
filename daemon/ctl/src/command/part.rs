//! What counts as the part: options that `convert`, `scan` and `rerun` share.

use pipeline::{BackgroundPolicy, Settings};
use relief_api::SettingOverrides;
use serde_json::json;

use crate::command::fill_image::FillImageArgs;

/// Where a limit is left out. Nothing is scanned from a kilometre away, and JSON has no
/// infinity.
const OPEN_MM: f64 = 1e6;

/// What counts as the part.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(next_help_heading = "What counts as the part")]
pub(crate) struct PartArgs {
    /// Ignore samples with x outside of these limits, millimetres; one may be left out, as
    /// in `-50,`
    #[arg(long, value_name = "MIN,MAX", value_parser = limits, allow_hyphen_values = true)]
    roi_x_mm: Option<Limits>,
    /// The same for y (up)
    #[arg(long, value_name = "MIN,MAX", value_parser = limits, allow_hyphen_values = true)]
    roi_y_mm: Option<Limits>,
    /// The same for z (towards the camera)
    #[arg(long, value_name = "MIN,MAX", value_parser = limits, allow_hyphen_values = true)]
    roi_z_mm: Option<Limits>,
    /// Make faces of a table, back plane or fixture, too, which are otherwise recognised
    /// and left out
    #[arg(long)]
    keep_background: bool,
    /// Leave out regions of fewer grid nodes
    #[arg(long, value_name = "N")]
    minimum_nodes: Option<usize>,
    /// Leave out regions that cover less, seen from the camera, square millimetres
    #[arg(long, value_name = "MM2")]
    minimum_area_mm2: Option<f64>,
    #[command(flatten)]
    fill: FillImageArgs,
}

/// Least and greatest coordinate, millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limits(f64, f64);

impl Limits {
    /// Both of them.
    pub(crate) fn mm(self) -> (f64, f64) {
        (self.0, self.1)
    }
}

pub(crate) fn limits(text: &str) -> Result<Limits, String> {
    let (low, high) = text
        .split_once(',')
        .ok_or("expected MIN,MAX, such as -30,60 or -30, for no upper limit")?;
    let side = |text: &str, open: f64| match text.trim() {
        "" => Ok(open),
        text => match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(format!("`{text}` is no length in millimetres")),
        },
    };
    let (low, high) = (side(low, f64::NEG_INFINITY)?, side(high, f64::INFINITY)?);
    if low >= high {
        return Err(format!(
            "nothing lies between {low} and {high}: the first limit must be below the second"
        ));
    }
    Ok(Limits(low, high))
}

impl PartArgs {
    /// Changes what the user says differently.
    pub(crate) fn apply(&self, settings: &mut Settings) {
        let roi = &mut settings.regrid.roi;
        for (place, given) in [
            (&mut roi.x_mm, self.roi_x_mm),
            (&mut roi.y_mm, self.roi_y_mm),
            (&mut roi.z_mm, self.roi_z_mm),
        ] {
            if let Some(Limits(low, high)) = given {
                *place = (low, high);
            }
        }
        if self.keep_background {
            settings.background = BackgroundPolicy::Keep;
        }
        if let Some(nodes) = self.minimum_nodes {
            settings.segment.minimum_nodes = nodes;
        }
        if let Some(area_mm2) = self.minimum_area_mm2 {
            settings.segment.minimum_area_mm2 = area_mm2;
        }
        self.fill.apply(&mut settings.fill);
    }

    /// The same as overrides of the service's settings.
    pub(crate) fn add_to(&self, overrides: &mut SettingOverrides) {
        let mut put = |key: &str, value: serde_json::Value| {
            overrides.insert(key.to_owned(), value);
        };
        for (key, given) in [
            ("regrid.roi_x_mm", self.roi_x_mm),
            ("regrid.roi_y_mm", self.roi_y_mm),
            ("regrid.roi_z_mm", self.roi_z_mm),
        ] {
            if let Some(Limits(low, high)) = given {
                put(key, json!([low.max(-OPEN_MM), high.min(OPEN_MM)]));
            }
        }
        if self.keep_background {
            put("segment.background", json!("keep"));
        }
        if let Some(nodes) = self.minimum_nodes {
            put("segment.minimum_nodes", json!(nodes));
        }
        if let Some(area_mm2) = self.minimum_area_mm2 {
            put("segment.minimum_area_mm2", json!(area_mm2));
        }
        self.fill.add_to(overrides);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_may_be_open_but_not_empty() {
        assert_eq!(limits("-30,60"), Ok(Limits(-30.0, 60.0)));
        assert_eq!(limits(" -30 , "), Ok(Limits(-30.0, f64::INFINITY)));
        assert_eq!(limits(",1e2"), Ok(Limits(f64::NEG_INFINITY, 100.0)));
        for (text, expected) in [
            ("5,-5", "the first limit must be below"),
            ("5,5", "nothing lies between 5 and 5"),
            ("5", "expected MIN,MAX"),
            ("a,5", "`a` is no length"),
            ("NaN,5", "no length"),
        ] {
            let error = limits(text).unwrap_err();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }

    #[test]
    fn file_and_service_get_the_same() {
        let args = PartArgs {
            roi_z_mm: Some(Limits(-30.0, 60.0)),
            roi_x_mm: Some(Limits(-5.0, f64::INFINITY)),
            keep_background: true,
            minimum_nodes: Some(80),
            minimum_area_mm2: Some(12.5),
            ..PartArgs::default()
        };
        let mut settings = Settings::new(0.5);
        args.apply(&mut settings);
        settings.validate().unwrap();
        assert_eq!(settings.regrid.roi.z_mm, (-30.0, 60.0));
        let mut overrides = SettingOverrides::new();
        args.add_to(&mut overrides);
        let processing = reliefd::config::Processing::default();
        let served = processing.with_overrides(&overrides).unwrap();
        let mut served = served.pipeline_settings(0.5, 0.5);
        assert_eq!(served.regrid.roi.x_mm, (-5.0, OPEN_MM));
        served.regrid.roi.x_mm.1 = f64::INFINITY;
        assert_eq!(served, settings);
    }
}
