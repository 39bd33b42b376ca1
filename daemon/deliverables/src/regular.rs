//! Regularities, for the report.

use pipeline::{Refused, Regularities, Regularity, Regularize, Round, Tangent, Target};

use crate::report::{RefusedReport, RegularitiesReport, RegularityReport};

/// The unit that numbers are round in; `None` where none were looked for.
pub(crate) fn round_name(regularize: &Regularize) -> Option<String> {
    match regularize {
        Regularize::Off => None,
        Regularize::On(settings) => Some(match settings.round {
            Round::Millimetre => "mm".to_owned(),
            Round::Inch => "inch".to_owned(),
        }),
    }
}

pub(crate) fn regularities(found: &Regularities) -> RegularitiesReport {
    RegularitiesReport {
        accepted: found.accepted.iter().map(accepted).collect(),
        refused: found.refused.iter().map(refused).collect(),
    }
}

pub(crate) fn tangent(found: &Tangent) -> RegularitiesReport {
    RegularitiesReport {
        accepted: found.accepted.iter().map(accepted).collect(),
        refused: found.refused.iter().map(refused).collect(),
    }
}

/// A length in millimetres, and an angle in degrees.
fn values(target: Option<Target>) -> (Option<f64>, Option<f64>) {
    match target {
        None => (None, None),
        Some(Target::Millimetres(mm)) => (Some(mm), None),
        Some(Target::Degrees(deg)) => (None, Some(deg)),
    }
}

fn accepted(own: &Regularity) -> RegularityReport {
    let (value_mm, value_deg) = values(own.target);
    RegularityReport {
        kind: own.kind.as_str().to_owned(),
        regions: own.labels.clone(),
        value_mm,
        value_deg,
        off_mm: own.off_mm,
        off_deg: own.off_rad.map(f64::to_degrees),
        deviations: own.deviations,
        freedom: own.freedom,
        p: own.p,
        chance: own.chance,
        moved_mm: own.moved_mm,
        turned_deg: own.turned_rad.to_degrees(),
    }
}

fn refused(own: &Refused) -> RefusedReport {
    let (value_mm, value_deg) = values(own.target);
    RefusedReport {
        kind: own.kind.as_str().to_owned(),
        regions: own.labels.clone(),
        value_mm,
        value_deg,
        off_mm: own.off_mm,
        off_deg: own.off_rad.map(f64::to_degrees),
        deviations: own.deviations,
        p: own.p,
        reason: own.reason.as_str().to_owned(),
    }
}
