//! E57: points in metres, with what is known of the scan.

use std::io::{Cursor, Write};

use e57::{DateTime, E57Writer, IntensityLimits, Record, RecordDataType, RecordName, RecordValue};

use crate::error::MeshFileError;
use crate::points::{Census, Points};
use crate::threemf::text;

/// Seconds from 1970 to the epoch of GPS, 6 January 1980, and leap seconds since that.
const GPS_EPOCH_S: f64 = 315_964_800.0;
const LEAP_S: f64 = 18.0;

/// What stands in a file beside its points.
#[derive(Debug, Clone, Copy)]
pub struct ScanDetails<'a> {
    /// Name of the scan.
    pub name: &'a str,
    /// Name and version of the program that wrote it.
    pub generator: &'a str,
    /// Where the points came from: the scanner, or a file.
    pub source: &'a str,
    /// Serial number of the scanner, where it is known.
    pub serial: Option<&'a str>,
    /// When the scan was taken, seconds since 1970.
    pub taken_s: f64,
    /// Two identifiers that no other file has, each such as
    /// `{3f2504e0-4f89-41d3-9a0c-0305e82c3301}`: of the file and of the scan.
    pub guids: [&'a str; 2],
}

pub(crate) fn write(
    points: &dyn Points,
    census: Census,
    details: &ScanDetails<'_>,
    sink: &mut dyn Write,
) -> Result<(), MeshFileError> {
    let refused = |error: e57::Error| MeshFileError::Format {
        format: "E57",
        reason: error.to_string(),
    };
    let mut bytes = Cursor::new(Vec::new());
    let [of_file, of_scan] = details.guids;
    let mut file = E57Writer::new(&mut bytes, of_file).map_err(refused)?;
    let taken = || DateTime {
        gps_time: details.taken_s - GPS_EPOCH_S + LEAP_S,
        atomic_reference: false,
    };
    file.set_creation(Some(taken()));
    let mut prototype = vec![
        Record::CARTESIAN_X_F64,
        Record::CARTESIAN_Y_F64,
        Record::CARTESIAN_Z_F64,
    ];
    if census.has_intensity {
        prototype.push(Record {
            name: RecordName::Intensity,
            data_type: RecordDataType::U8,
        });
    }
    let mut scan = file.add_pointcloud(of_scan, prototype).map_err(refused)?;
    scan.set_name(Some(character_data(details.name)));
    scan.set_description(Some(character_data(&format!(
        "measured by {}, written by {}; y up, z towards the camera",
        details.source, details.generator
    ))));
    scan.set_acquisition_start(Some(taken()));
    scan.set_sensor_model(Some(character_data(details.source)));
    scan.set_sensor_serial(details.serial.map(character_data));
    if census.has_intensity {
        scan.set_intensity_limits(Some(IntensityLimits {
            intensity_min: Some(RecordValue::Integer(0)),
            intensity_max: Some(RecordValue::Integer(255)),
        }));
    }
    let mut failed = None;
    let visited = points.visit(&mut |point| {
        let mut values: Vec<RecordValue> = point
            .place_mm
            .iter()
            .map(|mm| RecordValue::Double(mm / 1000.0))
            .collect();
        if census.has_intensity {
            values.push(RecordValue::Integer(i64::from(point.intensity)));
        }
        scan.add_point(values).map_err(|error| {
            failed = Some(error);
            std::io::ErrorKind::InvalidData.into()
        })
    });
    if let Some(error) = failed {
        return Err(refused(error));
    }
    visited.map_err(MeshFileError::Points)?;
    scan.finalize().map_err(refused)?;
    drop(scan);
    file.finalize().map_err(refused)?;
    drop(file);
    sink.write_all(bytes.get_ref())?;
    Ok(())
}

/// Text without what would end a section of character data, in which the library puts it.
fn character_data(of: &str) -> String {
    text(of).replace("]]>", "]] >")
}
