//! Surfaces by their numbers: entities 190 to 198; and by their profiles: 120 and 122.

use super::error::ReadError;
use super::file::{Entity, File, Record};
use super::model::{SplineCurve, curve};

/// What a face may lie on.
pub(super) const SURFACES: [u32; 9] = [114, 120, 122, 128, 190, 192, 194, 196, 198];

/// A surface by its numbers or its profile. Millimetres and radians.
#[derive(Debug, Clone, PartialEq)]
pub enum AnalyticSurface {
    /// Entity 190; the axis of its frame is its normal.
    Plane {
        /// Where it lies.
        frame: SurfaceFrame,
    },
    /// Entity 192.
    Cylinder {
        /// Where it lies.
        frame: SurfaceFrame,
        /// Its radius.
        radius_mm: f64,
    },
    /// Entity 194.
    Cone {
        /// Where it lies.
        frame: SurfaceFrame,
        /// Its radius at the origin of its frame; it grows along the axis.
        radius_mm: f64,
        /// Angle between axis and surface.
        half_angle_rad: f64,
    },
    /// Entity 196.
    Sphere {
        /// Where it lies.
        frame: SurfaceFrame,
        /// Its radius.
        radius_mm: f64,
    },
    /// Entity 198.
    Torus {
        /// Where it lies.
        frame: SurfaceFrame,
        /// Radius of the circle in the middle of the tube.
        radius_mm: f64,
        /// Radius of the tube.
        tube_mm: f64,
    },
    /// Entity 122.
    Extrusion {
        /// What is shifted.
        profile: SplineCurve<3>,
        /// Where its start comes to.
        end_mm: [f64; 3],
    },
    /// Entity 120.
    Revolution {
        /// What is turned.
        profile: SplineCurve<3>,
        /// Two points of the axis, which leads from the first to the second.
        axis_mm: [[f64; 3]; 2],
        /// From the profile's place on so far to so far, radians.
        angles_rad: [f64; 2],
    },
}

/// Where a surface lies, and from where its angles count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceFrame {
    /// Its origin, millimetres.
    pub origin_mm: [f64; 3],
    /// Its axis.
    pub axis: [f64; 3],
    /// The direction from which angles count.
    pub reference: [f64; 3],
}

pub(super) fn is_analytic(entity: &Entity) -> bool {
    matches!(entity.entity, 120 | 122 | 190..=198)
}

/// Entity 122 or 120.
pub(super) fn swept(
    file: &File,
    entity: &Entity,
    record: &mut Record<'_>,
) -> Result<AnalyticSurface, ReadError> {
    if entity.entity == 122 {
        let profile = curve(file, record.pointer("its directrix", &[112, 126])?)?;
        let end_mm = record.reals("the end of its generatrix")?;
        return Ok(AnalyticSurface::Extrusion { profile, end_mm });
    }
    let line = record.pointer("its axis", &[110])?;
    if line.transformation != 0 {
        return Err(file.defect(line, "transformed axes are not read"));
    }
    let mut of_line = file.record(line)?;
    let axis_mm = [
        of_line.reals("a coordinate of its start")?,
        of_line.reals("a coordinate of its end")?,
    ];
    let profile = curve(file, record.pointer("its generatrix", &[112, 126])?)?;
    let angles_rad = record.reals("an angle")?;
    Ok(AnalyticSurface::Revolution {
        profile,
        axis_mm,
        angles_rad,
    })
}

/// One of entities 190 to 198 in its parameterised form.
pub(super) fn analytic(
    file: &File,
    entity: &Entity,
    record: &mut Record<'_>,
) -> Result<AnalyticSurface, ReadError> {
    if entity.form != 1 {
        return Err(record.defect("surfaces without a reference direction are not read"));
    }
    let origin_mm = triple(file, record.pointer("its location", &[116])?)?;
    // The sphere's radius comes before its axis.
    let sphere_mm = match entity.entity {
        196 => Some(length(record, "its radius")?),
        _ => None,
    };
    let axis = triple(file, record.pointer("its axis", &[123])?)?;
    let framed = |record: &mut Record<'_>| -> Result<SurfaceFrame, ReadError> {
        let reference = triple(file, record.pointer("its reference direction", &[123])?)?;
        Ok(SurfaceFrame {
            origin_mm,
            axis,
            reference,
        })
    };
    if let Some(radius_mm) = sphere_mm {
        let frame = framed(record)?;
        return Ok(AnalyticSurface::Sphere { frame, radius_mm });
    }
    match entity.entity {
        190 => Ok(AnalyticSurface::Plane {
            frame: framed(record)?,
        }),
        192 => {
            let radius_mm = length(record, "its radius")?;
            let frame = framed(record)?;
            Ok(AnalyticSurface::Cylinder { frame, radius_mm })
        }
        194 => {
            let radius_mm = length(record, "its radius")?;
            let half_angle_deg = length(record, "its half angle")?;
            if half_angle_deg >= 90.0 {
                let reason = format!("its half angle is {half_angle_deg} degrees, not below 90");
                return Err(record.defect(reason));
            }
            let half_angle_rad = half_angle_deg.to_radians();
            Ok(AnalyticSurface::Cone {
                frame: framed(record)?,
                radius_mm,
                half_angle_rad,
            })
        }
        _ => {
            let radius_mm = length(record, "its major radius")?;
            let tube_mm = length(record, "its minor radius")?;
            Ok(AnalyticSurface::Torus {
                frame: framed(record)?,
                radius_mm,
                tube_mm,
            })
        }
    }
}

/// The coordinates of a point (116) or direction (123).
fn triple(file: &File, entity: &Entity) -> Result<[f64; 3], ReadError> {
    if entity.transformation != 0 {
        return Err(file.defect(entity, "transformed points and directions are not read"));
    }
    file.record(entity)?.reals("a coordinate")
}

fn length(record: &mut Record<'_>, name: &str) -> Result<f64, ReadError> {
    let length = record.real(name)?;
    if length.is_finite() && length > 0.0 {
        Ok(length)
    } else {
        Err(record.defect(format!("{name} is {length}, not above 0")))
    }
}
