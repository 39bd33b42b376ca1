//! In which units a file has lengths and angles.

use super::super::ReadError;
use super::super::exchange::Exchange;
use super::super::properties::length_unit;

/// Of all numbers of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Units {
    pub(super) length_mm: f64,
    pub(super) angle_rad: f64,
}

/// The units of a file, of which all its contexts must have the same.
pub(super) fn of(exchange: &Exchange<'_>) -> Result<Units, ReadError> {
    let keyword = "GLOBAL_UNIT_ASSIGNED_CONTEXT";
    let mut found: Option<Units> = None;
    for id in exchange.all(keyword) {
        let mut fields = exchange.fields(id, &[keyword])?;
        let (mut length_mm, mut angle_rad) = (None, 1.0);
        for unit in fields.ids("its units")? {
            if exchange.fields(unit, &["LENGTH_UNIT"]).is_ok() {
                length_mm = Some(length_unit(exchange, unit)?);
            } else if exchange.fields(unit, &["PLANE_ANGLE_UNIT"]).is_ok() {
                angle_rad = angle_unit(exchange, unit)?;
            }
        }
        let Some(length_mm) = length_mm else { continue };
        let units = Units {
            length_mm,
            angle_rad,
        };
        if found.is_some_and(|found| found != units) {
            return Err(fields.defect("it has other units than another part of the file"));
        }
        found = Some(units);
    }
    found.ok_or(ReadError::Nothing {
        wanted: "unit of length",
        found: exchange.census(),
    })
}

/// Radians of a unit of plane angles.
fn angle_unit(exchange: &Exchange<'_>, id: u64) -> Result<f64, ReadError> {
    let Ok(mut conversion) = exchange.fields(id, &["CONVERSION_BASED_UNIT"]) else {
        return Ok(1.0);
    };
    conversion.skip("its name")?;
    let factor = conversion.id("its factor")?;
    let keywords = ["PLANE_ANGLE_MEASURE_WITH_UNIT", "MEASURE_WITH_UNIT"];
    let mut fields = exchange.fields(factor, &keywords)?;
    let radians = fields.measure("PLANE_ANGLE_MEASURE", "its value")?;
    if radians.is_finite() && radians > 0.0 {
        Ok(radians)
    } else {
        Err(fields.defect("a unit of this angle is not read"))
    }
}
