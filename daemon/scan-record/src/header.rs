//! What stands before the columns.

use range_image::correction::DEVIATIONS;
use range_image::{Calibration, Correction, calibration::Head};

use crate::format::Fields;

/// Everything about a scan that is known before its first column.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// From counts to millimetres, as the scanner announced it, and the correction that was in
    /// use.
    pub calibration: Calibration,
    /// Nominal distance of neighbouring columns, millimetres; 0 where unknown.
    pub column_pitch_mm: f64,
    /// Nominal distance of neighbouring samples in a column, millimetres; 0 where unknown.
    pub sample_spacing_mm: f64,
    /// Who measured: the scanner's identity, in the writer's encoding.
    pub identity: Vec<u8>,
    /// What was asked of the scanner, in the writer's encoding.
    pub plan: Vec<u8>,
    /// The processing settings at the time of the scan, in the writer's encoding.
    pub settings: Vec<u8>,
    /// Name, part, operator, note and the like, in the writer's encoding.
    pub metadata: Vec<u8>,
    /// Where the correction came from, in the writer's encoding; not kept without one.
    pub correction: Vec<u8>,
}

/// Version of a file without a correction.
const UNCORRECTED: u16 = 1;
/// Version of a file with one.
const CORRECTED: u16 = 2;

const HEAD_POLAR: u8 = 0;
const HEAD_CARTESIAN: u8 = 1;

impl Header {
    pub(crate) fn encode(&self) -> Vec<u8> {
        let (kind, head) = match self.calibration.head {
            Head::Polar {
                camera_y_mm,
                camera_z_mm,
                angle_count_rad,
                range_count_mm,
            } => (
                HEAD_POLAR,
                [camera_y_mm, camera_z_mm, angle_count_rad, range_count_mm],
            ),
            Head::Cartesian { count_mm } => (HEAD_CARTESIAN, [count_mm, 0.0, 0.0, 0.0]),
        };
        let mut out = Vec::new();
        out.extend_from_slice(&self.calibration.table_origin_mm.to_le_bytes());
        out.extend_from_slice(&self.calibration.table_count_mm.to_le_bytes());
        out.push(kind);
        for number in head {
            out.extend_from_slice(&number.to_le_bytes());
        }
        out.extend_from_slice(&self.column_pitch_mm.to_le_bytes());
        out.extend_from_slice(&self.sample_spacing_mm.to_le_bytes());
        for bytes in [&self.identity, &self.plan, &self.settings, &self.metadata] {
            // Lengths beyond u32 cannot pass the writer's limit on the whole payload.
            out.extend_from_slice(&(bytes.len() as u32).to_le_bytes());
            out.extend_from_slice(bytes);
        }
        if let Some(correction) = &self.calibration.correction {
            for number in correction.to_array() {
                out.extend_from_slice(&number.to_le_bytes());
            }
            out.extend_from_slice(&(self.correction.len() as u32).to_le_bytes());
            out.extend_from_slice(&self.correction);
        }
        out
    }

    /// The version of a file with this header.
    pub(crate) fn version(&self) -> u16 {
        match self.calibration.correction {
            None => UNCORRECTED,
            Some(_) => CORRECTED,
        }
    }

    /// Whether files of this version are read.
    pub(crate) fn knows(version: u16) -> bool {
        matches!(version, UNCORRECTED | CORRECTED)
    }

    /// The reason in words when the payload is no header of this version.
    pub(crate) fn decode(payload: &[u8], version: u16) -> Result<Self, &'static str> {
        let header = Self::fields(payload, version == CORRECTED)?;
        let calibration = &header.calibration;
        let scale = match calibration.head {
            Head::Polar {
                camera_y_mm,
                camera_z_mm,
                angle_count_rad,
                range_count_mm,
            } => {
                if !(camera_y_mm.is_finite() && camera_z_mm.is_finite()) {
                    return Err("the camera's position is not finite");
                }
                [angle_count_rad, range_count_mm]
            }
            Head::Cartesian { count_mm } => [count_mm, count_mm],
        };
        let usable = |scale: f64| scale.is_finite() && scale != 0.0;
        if !calibration.table_origin_mm.is_finite()
            || !usable(calibration.table_count_mm)
            || !scale.into_iter().all(usable)
        {
            return Err("the calibration has a scale that is zero or not finite");
        }
        let spacing = |mm: f64| mm.is_finite() && mm >= 0.0;
        if !spacing(header.column_pitch_mm) || !spacing(header.sample_spacing_mm) {
            return Err("a nominal spacing is negative or not finite");
        }
        if let Some(odd) = calibration.correction.and_then(|c| c.implausible()) {
            return Err(odd);
        }
        Ok(header)
    }

    fn fields(payload: &[u8], corrected: bool) -> Result<Self, &'static str> {
        const SHORT: &str = "it is too short";
        let mut fields = Fields(payload);
        let mut number = || fields.f64().ok_or(SHORT);
        let (table_origin_mm, table_count_mm) = (number()?, number()?);
        let kind = fields.u8().ok_or(SHORT)?;
        let mut number = || fields.f64().ok_or(SHORT);
        let numbers = [number()?, number()?, number()?, number()?];
        let head = match kind {
            HEAD_POLAR => Head::Polar {
                camera_y_mm: numbers[0],
                camera_z_mm: numbers[1],
                angle_count_rad: numbers[2],
                range_count_mm: numbers[3],
            },
            HEAD_CARTESIAN => Head::Cartesian {
                count_mm: numbers[0],
            },
            _ => return Err("it names a kind of measuring head that this version does not know"),
        };
        let (column_pitch_mm, sample_spacing_mm) = (number()?, number()?);
        let mut bytes = || fields.bytes().map(<[u8]>::to_vec).ok_or(SHORT);
        let mut header = Self {
            calibration: Calibration {
                table_origin_mm,
                table_count_mm,
                head,
                correction: None,
            },
            column_pitch_mm,
            sample_spacing_mm,
            identity: bytes()?,
            plan: bytes()?,
            settings: bytes()?,
            metadata: bytes()?,
            correction: Vec::new(),
        };
        if corrected {
            let mut deviations = [0.0; DEVIATIONS];
            for deviation in &mut deviations {
                *deviation = fields.f64().ok_or(SHORT)?;
            }
            header.calibration.correction = Some(Correction::from_array(deviations));
            header.correction = fields.bytes().map(<[u8]>::to_vec).ok_or(SHORT)?;
        }
        if !fields.is_empty() {
            return Err("it is too long");
        }
        Ok(header)
    }
}
