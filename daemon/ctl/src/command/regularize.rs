//! Regularities: options that `convert`, `scan`, `rerun` and `demo` share.

use clap::ValueEnum;
use pipeline::{Regularize, RegularizeSettings, Round, Settings};
use relief_api::SettingOverrides;
use serde_json::json;

/// The bound where none is given, as [`RegularizeSettings`] has it.
const BOUND: &str = "3";

/// Whether regularities are looked for.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub(crate) struct RegularizeArgs {
    /// Make planes, cylinders, cones, spheres and tori parallel, perpendicular, coplanar, coaxial,
    /// symmetric, of equal and of round sizes where their uncertainties allow of it and chance
    /// hardly explains it. BOUND is how many standard uncertainties each may be off, 1 to 6.
    /// Nothing is moved farther than 0.25 mm and 2 degrees; the report lists each
    #[arg(
        long,
        value_name = "BOUND",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = BOUND,
        value_parser = bound
    )]
    regularize: Option<f64>,
    /// Unit that sizes are round in: millimetres and their parts, or inches and their fractions;
    /// default: millimetres
    #[arg(long, value_name = "UNIT", value_enum, requires = "regularize")]
    regularize_units: Option<RoundName>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum RoundName {
    Mm,
    Inch,
}

fn bound(text: &str) -> Result<f64, String> {
    let (low, high) = RegularizeSettings::BOUNDS;
    let bound = text.parse::<f64>().ok();
    bound
        .filter(|bound| (low..=high).contains(bound))
        .ok_or_else(|| format!("expected {low} to {high} standard uncertainties, such as {BOUND}"))
}

impl RegularizeArgs {
    /// Changes what the user says differently.
    pub(crate) fn apply(self, settings: &mut Settings) {
        if let Some(bound) = self.regularize {
            settings.regularize = Regularize::On(RegularizeSettings {
                bound,
                round: match self.regularize_units {
                    None | Some(RoundName::Mm) => Round::Millimetre,
                    Some(RoundName::Inch) => Round::Inch,
                },
                ..RegularizeSettings::default()
            });
        }
    }

    /// The same as overrides of the service's settings.
    pub(crate) fn add_to(self, overrides: &mut SettingOverrides) {
        if let Some(bound) = self.regularize {
            overrides.insert("reconstruct.regularize".to_owned(), json!(bound));
        }
        if let Some(units) = self.regularize_units {
            let name = match units {
                RoundName::Mm => "mm",
                RoundName::Inch => "inch",
            };
            overrides.insert("reconstruct.regularize_units".to_owned(), json!(name));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use reliefd::config::Processing;

    #[derive(Debug, Parser)]
    struct Cli {
        #[command(flatten)]
        args: RegularizeArgs,
    }

    fn parse(text: &[&str]) -> Result<RegularizeArgs, String> {
        let all = ["relief"].iter().chain(text);
        let parsed = Cli::try_parse_from(all).map_err(|error| error.to_string())?;
        Ok(parsed.args)
    }

    #[test]
    fn file_and_service_get_the_same() {
        for text in [
            &[][..],
            &["--regularize"],
            &["--regularize=2.5"],
            &["--regularize=4", "--regularize-units=inch"],
        ] {
            let args = parse(text).unwrap();
            let mut settings = Settings::new(0.5);
            args.apply(&mut settings);
            let mut overrides = SettingOverrides::new();
            args.add_to(&mut overrides);
            let service = Processing::default().with_overrides(&overrides).unwrap();
            assert_eq!(
                service.pipeline_settings(0.5, 0.5).regularize,
                settings.regularize,
                "{text:?}"
            );
            assert_eq!(settings.regularize != Regularize::Off, !text.is_empty());
        }
        assert_eq!(
            BOUND.parse::<f64>().unwrap(),
            RegularizeSettings::default().bound
        );
    }

    #[test]
    fn bounds_that_cannot_be_are_refused() {
        for text in ["0.5", "7", "nan", "many"] {
            let error = parse(&[&format!("--regularize={text}")]).unwrap_err();
            assert!(error.contains("1 to 6 standard uncertainties"), "{error}");
        }
        assert!(parse(&["--regularize-units=inch"]).is_err());
    }
}
