//! Which holes of a range image are closed: options that `convert`, `scan` and `rerun` share.

use clap::ValueEnum;
use pipeline::{FillMode, FillSettings};
use relief_api::SettingOverrides;
use serde_json::json;

/// Which holes are closed.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(next_help_heading = "Holes of the range image")]
pub(crate) struct FillImageArgs {
    /// Close holes that dropouts, gloss and shadows have left, and keep those that are openings
    /// of the part (auto), close all that are small enough (all), or none (off). The report
    /// lists each hole with what speaks for it. Default: what was configured, else off; auto
    /// with one of the options below
    #[arg(long, value_name = "WHICH", value_enum)]
    fill: Option<FillName>,
    /// Close holes up to this size: the diameter of the largest circle that fits into them,
    /// millimetres; default: 10
    #[arg(long, value_name = "MM")]
    fill_max_mm: Option<f64>,
    /// Keep the hole at this place whatever speaks against it; may be given more than once
    #[arg(long, value_name = "X,Y", value_parser = place, allow_hyphen_values = true)]
    fill_keep: Vec<At>,
    /// Close the hole at this place, whatever speaks against it and whatever its size; may be
    /// given more than once
    #[arg(long, value_name = "X,Y", value_parser = place, allow_hyphen_values = true)]
    fill_close: Vec<At>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FillName {
    Off,
    Auto,
    All,
}

impl FillName {
    fn mode(self) -> FillMode {
        match self {
            Self::Off => FillMode::Off,
            Self::Auto => FillMode::Auto,
            Self::All => FillMode::All,
        }
    }
}

/// x and y, millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
struct At([f64; 2]);

fn place(text: &str) -> Result<At, String> {
    let (x, y) = text
        .split_once(',')
        .ok_or("expected X,Y in millimetres, such as 12.5,-30")?;
    let number = |text: &str| match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(format!("`{text}` is no length in millimetres")),
    };
    Ok(At([number(x)?, number(y)?]))
}

fn places(given: &[At]) -> Vec<[f64; 2]> {
    given.iter().map(|at| at.0).collect()
}

impl FillImageArgs {
    fn is_any(&self) -> bool {
        self.fill_max_mm.is_some() || !self.fill_keep.is_empty() || !self.fill_close.is_empty()
    }

    /// Changes what the user says differently.
    pub(crate) fn apply(&self, settings: &mut FillSettings) {
        match self.fill {
            Some(name) => settings.mode = name.mode(),
            None if self.is_any() && settings.mode == FillMode::Off => {
                settings.mode = FillMode::Auto;
            }
            None => {}
        }
        if let Some(max_size_mm) = self.fill_max_mm {
            settings.max_size_mm = max_size_mm;
        }
        if !self.fill_keep.is_empty() {
            settings.keep_mm = places(&self.fill_keep);
        }
        if !self.fill_close.is_empty() {
            settings.close_mm = places(&self.fill_close);
        }
    }

    /// The same as overrides of the service's settings.
    pub(crate) fn add_to(&self, overrides: &mut SettingOverrides) {
        let mut put = |key: &str, value: serde_json::Value| {
            overrides.insert(key.to_owned(), value);
        };
        if let Some(name) = self.fill {
            put("fill.mode", json!(name.mode().as_str()));
        }
        if let Some(max_size_mm) = self.fill_max_mm {
            put("fill.max_size_mm", json!(max_size_mm));
        }
        if !self.fill_keep.is_empty() {
            put("fill.keep_mm", json!(places(&self.fill_keep)));
        }
        if !self.fill_close.is_empty() {
            put("fill.close_mm", json!(places(&self.fill_close)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_two_lengths() {
        assert_eq!(place("12.5,-30"), Ok(At([12.5, -30.0])));
        assert!(place("12.5").unwrap_err().contains("expected X,Y"));
        assert!(place("a,1").unwrap_err().contains("`a` is no length"));
    }

    #[test]
    fn file_and_service_get_the_same() {
        let args = FillImageArgs {
            fill_max_mm: Some(4.0),
            fill_keep: vec![At([1.0, 2.0])],
            fill_close: vec![At([-3.0, 4.5])],
            ..FillImageArgs::default()
        };
        let mut settings = pipeline::Settings::new(0.5);
        args.apply(&mut settings.fill);
        assert_eq!(settings.fill.mode, FillMode::Auto);
        settings.validate().unwrap();
        let mut overrides = SettingOverrides::new();
        args.add_to(&mut overrides);
        let processing = reliefd::config::Processing::default();
        let served = processing.with_overrides(&overrides).unwrap();
        assert_eq!(served.pipeline_settings(0.5, 0.5), settings);
    }
}
