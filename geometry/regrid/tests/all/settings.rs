//! Settings out of range are refused by name.

use regrid::{RegridError, RegridSettings, Regridder, Roi, SupportSettings, regrid};

#[test]
fn each_setting_has_its_limits() {
    let good = RegridSettings::with_pitch(0.5);
    assert_eq!(good.validate(), Ok(()));
    let support = |change: fn(&mut SupportSettings)| {
        let mut settings = good;
        change(&mut settings.support);
        settings
    };
    let roi = |roi: Roi| RegridSettings { roi, ..good };
    let nan = f64::NAN;
    for (settings, name) in [
        (
            RegridSettings {
                pitch_mm: 0.0,
                ..good
            },
            "pitch_mm = 0",
        ),
        (
            RegridSettings {
                pitch_mm: nan,
                ..good
            },
            "pitch_mm = NaN",
        ),
        (
            RegridSettings {
                pitch_mm: 1e300,
                ..good
            },
            "pitch_mm = 1e300: must be from",
        ),
        (
            RegridSettings {
                pitch_mm: f64::INFINITY,
                ..good
            },
            "pitch_mm = inf",
        ),
        (
            RegridSettings {
                neighbours: 5,
                ..good
            },
            "neighbours = 5: must be from 6",
        ),
        (RegridSettings { draws: 0, ..good }, "draws = 0"),
        (
            RegridSettings {
                reach_columns: 0,
                ..good
            },
            "reach_columns = 0",
        ),
        (
            RegridSettings {
                threads: 100_000,
                ..good
            },
            "threads",
        ),
        (support(|s| s.radius = 0.5), "support.radius"),
        (support(|s| s.margin = -0.1), "support.margin"),
        (
            support(|s| s.inlier_floor = f64::NAN),
            "support.inlier_floor",
        ),
        (support(|s| s.least_samples = 2), "support.least_samples"),
        (
            roi(Roi {
                x_mm: (1.0, 1.0),
                ..Roi::default()
            }),
            "roi.x_mm = [1, 1]",
        ),
        (
            roi(Roi {
                y_mm: (2.0, 1.0),
                ..Roi::default()
            }),
            "roi.y_mm",
        ),
        (
            roi(Roi {
                z_mm: (nan, 1.0),
                ..Roi::default()
            }),
            "roi.z_mm",
        ),
    ] {
        let error = settings.validate().unwrap_err();
        assert!(error.to_string().contains(name), "{error} lacks {name}");
        assert_eq!(
            Regridder::new(settings).unwrap_err().to_string(),
            error.to_string()
        );
        let batch = regrid(Vec::new(), &settings, &range_image::Unmonitored);
        assert!(matches!(batch, Err(RegridError::Settings(_))));
    }
}
