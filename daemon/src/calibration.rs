//! Files that say how a mounted scanner deviates: written by `relief calibrate`, named in the
//! scanner's section, and kept with every scan that they were used for.

use std::fs;
use std::path::{Path, PathBuf};

use deliverables::report::CalibrationReport;
use jiff::Timestamp;
use range_image::calibration::Head;
use range_image::{Calibration, Correction};
use scan_record::Header;
use serde::{Deserialize, Serialize};

/// Days after which a calibration counts as old, unless the configuration says otherwise.
pub const USUAL_DAYS: u32 = 365;

/// A calibration file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalibrationFile {
    /// Model of the scanner that it is for.
    pub scanner_model: String,
    /// Serial number of that.
    pub scanner_serial: String,
    /// When the scans that it was made from were taken, RFC 3339 in UTC.
    pub date: String,
    /// How it was made, in words.
    pub method: String,
    /// What was scanned, in words.
    pub reference: String,
    /// The scans: ids, or files.
    pub scans: Vec<String>,
    /// The program that made it, with its version.
    pub program: String,
    /// Samples that it was made from.
    pub samples: u64,
    /// Root mean square of the samples' distances from the reference without the correction,
    /// millimetres.
    pub residual_before_mm: f64,
    /// The same with it.
    pub residual_after_mm: f64,
    /// Deviations that the scans did not determine; they are zero.
    pub undetermined: Vec<String>,
    /// What the scanner announced: with another announcement the correction has no meaning.
    pub announced: Announced,
    /// The deviations.
    pub correction: Deviations,
    /// Their standard uncertainties; 0 for those that were not determined.
    pub uncertainty: Deviations,
}

/// What a scanner announced.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Announced {
    /// x of the part frame at table position 0.
    pub table_origin_mm: f64,
    /// Travel of the table per count.
    pub table_count_mm: f64,
    /// Of a polar head: y of the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_y_mm: Option<f64>,
    /// Of a polar head: z of the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_z_mm: Option<f64>,
    /// Of a polar head: angle per count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_count_rad: Option<f64>,
    /// Of a polar head: distance along the ray per count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_count_mm: Option<f64>,
    /// Of a Cartesian head: y and z per count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub count_mm: Option<f64>,
}

/// Deviations as [`Correction`] has them; for uncertainties, too.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Deviations {
    /// See [`Correction::angle_offset_rad`].
    pub angle_offset_rad: f64,
    /// See [`Correction::angle_scale`].
    pub angle_scale: f64,
    /// See [`Correction::range_offset_mm`].
    pub range_offset_mm: f64,
    /// See [`Correction::range_scale`].
    pub range_scale: f64,
    /// See [`Correction::camera_mm`].
    pub camera_x_mm: f64,
    /// See [`Correction::camera_mm`].
    pub camera_y_mm: f64,
    /// See [`Correction::camera_mm`].
    pub camera_z_mm: f64,
    /// See [`Correction::table_y_rad`].
    pub table_y_rad: f64,
    /// See [`Correction::table_z_rad`].
    pub table_z_rad: f64,
    /// See [`Correction::table_scale`].
    pub table_scale: f64,
}

/// Why a calibration cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is no calibration.
    #[error("{} is no calibration: {what}; `relief calibrate -o` writes one", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// It is for another scanner.
    #[error(
        "the calibration of {date} is for {for_scanner}, but this is {scanner}: a scan with the \
         wrong correction is worse than none. Calibrate this scanner (relief calibrate), name its \
         own file as `calibration` in [{section}], or remove the key"
    )]
    OtherScanner {
        /// Date of the calibration.
        date: String,
        /// The scanner that it is for.
        for_scanner: String,
        /// The scanner that there is.
        scanner: String,
        /// Section of the configuration.
        section: String,
    },
    /// The scanner announces other numbers than when it was calibrated.
    #[error(
        "{scanner} announces other counts or another place of its camera than when it was \
         calibrated on {date}, perhaps after new firmware: the correction has no meaning any more. \
         Calibrate it anew (relief calibrate), or remove the key `calibration` in [{section}]"
    )]
    OtherAnnouncement {
        /// Date of the calibration.
        date: String,
        /// The scanner.
        scanner: String,
        /// Section of the configuration.
        section: String,
    },
}

impl CalibrationFile {
    /// Reads a file.
    ///
    /// # Errors
    /// [`CalibrationError::Read`] and [`CalibrationError::Content`].
    pub fn read(path: &Path) -> Result<Self, CalibrationError> {
        let text = fs::read_to_string(path).map_err(|source| CalibrationError::Read {
            path: path.to_owned(),
            source,
        })?;
        let content = |what: String| CalibrationError::Content {
            path: path.to_owned(),
            what,
        };
        let file: Self = toml::from_str(&text).map_err(|error| content(one_line(&error)))?;
        if file.time().is_none() {
            let date = &file.date;
            return Err(content(format!("date {date:?} is no RFC 3339 time")));
        }
        if let Some(odd) = file.correction().implausible() {
            return Err(content(odd.to_owned()));
        }
        Ok(file)
    }

    /// The file as text.
    #[must_use]
    pub fn to_toml(&self) -> String {
        const HEAD: &str = "# How this scanner deviates from what it announces. Made by `relief \
                            calibrate`; name the\n# file as `calibration` in the scanner's section \
                            of the configuration.\n";
        // These types serialise to TOML whatever they hold.
        format!("{HEAD}{}", toml::to_string(self).unwrap_or_default())
    }

    /// When its scans were taken.
    fn time(&self) -> Option<Timestamp> {
        self.date.parse().ok()
    }

    /// The deviations, as geometry needs them.
    #[must_use]
    pub fn correction(&self) -> Correction {
        let own = &self.correction;
        Correction {
            angle_offset_rad: own.angle_offset_rad,
            angle_scale: own.angle_scale,
            range_offset_mm: own.range_offset_mm,
            range_scale: own.range_scale,
            camera_mm: [own.camera_x_mm, own.camera_y_mm, own.camera_z_mm],
            table_y_rad: own.table_y_rad,
            table_z_rad: own.table_z_rad,
            table_scale: own.table_scale,
        }
    }

    /// The correction, if it is for this scanner; `section` is that of the configuration.
    ///
    /// # Errors
    /// [`CalibrationError::OtherScanner`] and [`CalibrationError::OtherAnnouncement`].
    pub fn for_scanner(
        &self,
        model: &str,
        serial: &str,
        announced: &Calibration,
        section: &str,
    ) -> Result<Correction, CalibrationError> {
        let scanner = format!("{model}, serial number {serial}");
        if (model, serial) != (self.scanner_model.as_str(), self.scanner_serial.as_str()) {
            let (model, serial) = (&self.scanner_model, &self.scanner_serial);
            return Err(CalibrationError::OtherScanner {
                date: self.date.clone(),
                for_scanner: format!("{model}, serial number {serial}"),
                scanner,
                section: section.to_owned(),
            });
        }
        if self.announced != Announced::of(announced) {
            return Err(CalibrationError::OtherAnnouncement {
                date: self.date.clone(),
                scanner,
                section: section.to_owned(),
            });
        }
        Ok(self.correction())
    }

    /// Whole days from then to a time; negative if it was later.
    #[must_use]
    pub fn age_days(&self, at: Timestamp) -> i64 {
        const DAY_S: i64 = 86_400;
        let made = self.time().unwrap_or(at);
        (at.as_second() - made.as_second()).div_euclid(DAY_S)
    }
}

impl Announced {
    /// What this scanner announces, whatever the correction.
    #[must_use]
    pub fn of(calibration: &Calibration) -> Self {
        let mut announced = Self {
            table_origin_mm: calibration.table_origin_mm,
            table_count_mm: calibration.table_count_mm,
            camera_y_mm: None,
            camera_z_mm: None,
            angle_count_rad: None,
            range_count_mm: None,
            count_mm: None,
        };
        match calibration.head {
            Head::Polar {
                camera_y_mm,
                camera_z_mm,
                angle_count_rad,
                range_count_mm,
            } => {
                announced.camera_y_mm = Some(camera_y_mm);
                announced.camera_z_mm = Some(camera_z_mm);
                announced.angle_count_rad = Some(angle_count_rad);
                announced.range_count_mm = Some(range_count_mm);
            }
            Head::Cartesian { count_mm } => announced.count_mm = Some(count_mm),
        }
        announced
    }
}

/// A calibration in force for a scanner: what its scans' journals say of where the correction came
/// from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InForce {
    /// The file.
    pub file: CalibrationFile,
    /// Days after which it is old.
    pub calibration_days: u32,
}

impl InForce {
    /// What to say of it if it is old at this time.
    #[must_use]
    pub fn overdue(&self, at: Timestamp) -> Option<String> {
        let days = self.file.age_days(at);
        (days > i64::from(self.calibration_days)).then(|| {
            format!(
                "the scanner's calibration of {} is {days} days old, more than the {} of \
                 calibration_days: calibrate it anew (relief calibrate)",
                self.file.date, self.calibration_days
            )
        })
    }

    /// What a journal says of the correction in its header; `None` without one, or if another
    /// program wrote it.
    #[must_use]
    pub fn kept_with(header: &Header) -> Option<Self> {
        header.calibration.correction?;
        serde_json::from_slice(&header.correction).ok()
    }

    /// What a report says of it, for a scan of this time.
    #[must_use]
    pub fn report(&self, at: Option<Timestamp>) -> CalibrationReport {
        CalibrationReport {
            date: self.file.date.clone(),
            age_days: at.map(|at| self.file.age_days(at)),
            residual_mm: self.file.residual_after_mm,
            undetermined: self.file.undetermined.clone(),
        }
    }
}

/// The parser's message without the picture of the place.
fn one_line(error: &toml::de::Error) -> String {
    error
        .message()
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn calibration() -> Calibration {
        Calibration {
            table_origin_mm: -200.0,
            table_count_mm: 0.01,
            head: Head::Polar {
                camera_y_mm: 0.0,
                camera_z_mm: 750.0,
                angle_count_rad: 1e-6,
                range_count_mm: 0.1,
            },
            correction: None,
        }
    }

    fn file() -> CalibrationFile {
        CalibrationFile {
            scanner_model: "SLC-2".into(),
            scanner_serial: "7".into(),
            date: "2026-01-31T10:00:00Z".into(),
            method: "spheres".into(),
            reference: "a sphere".into(),
            scans: vec!["a.scan".into()],
            program: "relief".into(),
            samples: 12,
            residual_before_mm: 0.06,
            residual_after_mm: 0.05,
            undetermined: vec!["camera y".into()],
            announced: Announced::of(&calibration()),
            correction: Deviations {
                angle_scale: 0.1 + 0.2 - 0.3,
                table_y_rad: 1.0 / 3.0,
                ..Deviations::default()
            },
            uncertainty: Deviations::default(),
        }
    }

    #[test]
    fn a_file_is_read_as_it_was_written_to_the_last_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("calibration.toml");
        fs::write(&path, file().to_toml()).unwrap();
        assert_eq!(CalibrationFile::read(&path).unwrap(), file());
    }

    #[test]
    fn what_is_no_calibration_is_refused_in_words() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("calibration.toml");
        let told = |text: &str| {
            fs::write(&path, text).unwrap();
            CalibrationFile::read(&path).unwrap_err().to_string()
        };
        let good = file().to_toml();
        assert!(told("x = 1").contains("is no calibration: unknown field"));
        let odd = good.replace("2026-01-31", "soon");
        assert!(told(&odd).contains("is no RFC 3339 time"));
        let wild = good.replace("range_offset_mm = 0.0", "range_offset_mm = nan");
        assert!(told(&wild).contains("a length is off"), "{wild}");
        let gone = CalibrationFile::read(Path::new("none.toml")).unwrap_err();
        assert!(gone.to_string().starts_with("cannot read none.toml"));
    }

    #[test]
    fn a_correction_is_for_its_own_scanner_as_it_announces_itself() {
        let told = |model: &str, serial: &str, calibration: &Calibration| {
            let file = file();
            file.for_scanner(model, serial, calibration, "scanner")
        };
        assert_eq!(
            told("SLC-2", "7", &calibration()).unwrap(),
            file().correction()
        );
        for (model, serial) in [("SLC-2", "8"), ("SLC-3", "7")] {
            let error = told(model, serial, &calibration()).unwrap_err().to_string();
            assert!(error.contains("is for SLC-2, serial number 7"), "{error}");
            assert!(error.contains("remove the key"), "{error}");
        }
        let mut other = calibration();
        other.table_count_mm = 0.02;
        let error = told("SLC-2", "7", &other).unwrap_err().to_string();
        assert!(error.contains("announces other counts"), "{error}");
    }

    #[test]
    fn a_calibration_grows_old() {
        let own = InForce {
            file: file(),
            calibration_days: 365,
        };
        let at = |text: &str| text.parse::<Timestamp>().unwrap();
        assert_eq!(own.file.age_days(at("2026-02-01T09:59:59Z")), 0);
        assert_eq!(own.file.age_days(at("2026-02-01T10:00:00Z")), 1);
        assert_eq!(own.overdue(at("2027-01-31T10:00:00Z")), None);
        let told = own.overdue(at("2027-02-01T10:00:00Z")).unwrap();
        assert!(told.contains("366 days old"), "{told}");
    }
}
