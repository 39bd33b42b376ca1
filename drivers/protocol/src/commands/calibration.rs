//! Asking what the device's counts mean.

use crate::message::Request;
use crate::wire::{MessageError, Reader, Wire, Writer, message};

message! {
    /// Asks for the [`Calibration`].
    GetCalibration = 0x03 {}
}

message! {
    /// What counts mean, in whole numbers, so that both ends compute with the same.
    ///
    /// Counts are given in picometres and picoradians: an encoder of 1/3 um per count,
    /// rounded to nanometres, would be wrong by 0.1 mm over 100 mm.
    Calibration = 0x83 {
        /// Travel of the table per count, picometres.
        table_count_pm: u32,
        /// x of the part frame at table position 0, nanometres.
        table_origin_nm: i64,
        /// What a sample's two numbers mean.
        head: Head,
    }
}

impl Request for GetCalibration {
    type Reply = Calibration;
}

/// What the measuring head delivers for a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Head {
    /// Laterals are angles of the ray, positive upwards; ranges are distances along it.
    Polar {
        /// y of the camera's centre in the part frame, nanometres.
        camera_y_nm: i64,
        /// z of the camera's centre in the part frame, nanometres.
        camera_z_nm: i64,
        /// Angle per count, picoradians.
        angle_count_prad: u32,
        /// Distance along the ray per count, picometres.
        range_count_pm: u32,
    },
    /// Laterals are y and ranges are z, both in the part frame.
    Cartesian {
        /// y and z per count, picometres.
        count_pm: u32,
    },
}

impl Wire for Head {
    fn put(&self, out: &mut Writer) {
        match *self {
            Self::Polar {
                camera_y_nm,
                camera_z_nm,
                angle_count_prad,
                range_count_pm,
            } => {
                0_u8.put(out);
                camera_y_nm.put(out);
                camera_z_nm.put(out);
                angle_count_prad.put(out);
                range_count_pm.put(out);
            }
            Self::Cartesian { count_pm } => {
                1_u8.put(out);
                count_pm.put(out);
            }
        }
    }

    fn get(input: &mut Reader<'_>) -> Result<Self, MessageError> {
        match u8::get(input)? {
            0 => Ok(Self::Polar {
                camera_y_nm: Wire::get(input)?,
                camera_z_nm: Wire::get(input)?,
                angle_count_prad: Wire::get(input)?,
                range_count_pm: Wire::get(input)?,
            }),
            1 => Ok(Self::Cartesian {
                count_pm: Wire::get(input)?,
            }),
            _ => Err(MessageError::BadValue),
        }
    }
}
