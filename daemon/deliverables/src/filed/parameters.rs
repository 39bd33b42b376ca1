//! Numbers of shapes, with their uncertainties.

use page::{Block, Column, Line, Section, Table, number};

use super::{figure, triple};
use crate::report::{Quantity, Report, ShapeNumbers};

/// Standard uncertainties to either side that hold the truth in 95 of 100 cases.
const COVERING: f64 = 1.96;

/// The table of parameters; `None` where no region has any.
pub(super) fn parameters(report: &Report) -> Option<Section> {
    let mut rows = Vec::new();
    for region in &report.regions.list {
        let Some(shape) = &region.shape else { continue };
        let Some(numbers) = &shape.numbers else {
            continue;
        };
        let family = match shape.hollow {
            Some(true) => format!("hollow {}", shape.family),
            _ => shape.family.clone(),
        };
        for [name, value, uncertainty, interval] in of_shape(&shape.family, numbers) {
            rows.push(vec![
                Line::new().count(region.label.into()),
                family.clone().into(),
                name,
                value,
                uncertainty,
                interval,
            ]);
        }
    }
    if rows.is_empty() {
        return None;
    }
    let text = "Fitted to the samples, away from the borders of each region; x along the table, y \
                up, z towards the camera. Uncertainties follow from the scatter of the samples: \
                they hold as long as the scanner is calibrated and the surface is of that shape.";
    Some(Section {
        id: "parameters",
        heading: "Parameters".into(),
        blocks: vec![
            Block::Text(text.into()),
            Block::Table(Table {
                caption: "Parameters with their standard uncertainties (k = 1). Of places and \
                          directions, that in the way in which they are known least."
                    .into(),
                columns: vec![
                    Column::words("Region"),
                    Column::words("Shape"),
                    Column::words("Parameter"),
                    Column::numbers("Value"),
                    Column::numbers("Uncertainty"),
                    Column::numbers("95 % interval"),
                ],
                rows,
            }),
        ],
    })
}

/// Name, value, uncertainty and interval of each parameter.
fn of_shape(family: &str, numbers: &ShapeNumbers) -> Vec<[Line; 4]> {
    let mut rows: Vec<[Line; 4]> = Vec::new();
    for (name, quantity, unit) in [
        ("radius", numbers.radius_mm, " mm"),
        ("tube radius", numbers.tube_radius_mm, " mm"),
        ("half angle", numbers.half_angle_deg, "\u{b0}"),
    ] {
        if let Some(quantity) = quantity {
            rows.push(row(name, quantity, unit));
        }
    }
    let (point, direction) = match family {
        "plane" => ("point", "normal"),
        "cylinder" | "revolution" => ("point of the axis", "axis"),
        "extrusion" => ("point", "direction"),
        "cone" => ("apex", "axis"),
        _ => ("centre", "axis"),
    };
    let within = |uncertainty: f64, unit: &str| {
        let decimals = number::decimals_of(uncertainty);
        let shown = number::fixed(COVERING * uncertainty, decimals);
        Line::new().text(format!("\u{b1} {shown}{unit}"))
    };
    if let (Some(towards), Some(uncertainty)) =
        (numbers.direction, numbers.direction_uncertainty_deg)
    {
        let decimals = number::decimals_of(uncertainty.to_radians()).min(6);
        rows.push([
            direction.into(),
            triple(towards, decimals),
            uncertain(uncertainty, "\u{b0}"),
            within(uncertainty, "\u{b0}"),
        ]);
    }
    let uncertainty = numbers.point_uncertainty_mm;
    rows.push([
        point.into(),
        triple(numbers.point_mm, number::decimals_of(uncertainty)).text(" mm"),
        uncertain(uncertainty, " mm"),
        within(uncertainty, " mm"),
    ]);
    if let Some(profile) = numbers.profile {
        rows.push([
            "profile".into(),
            Line::new().text(format!("spline of {} coefficients", profile.coefficients)),
            uncertain(profile.uncertainty_mm, " mm"),
            within(profile.uncertainty_mm, " mm"),
        ]);
    }
    rows
}

fn row(name: &str, quantity: Quantity, unit: &str) -> [Line; 4] {
    let Quantity { value, uncertainty } = quantity;
    let decimals = number::decimals_of(uncertainty);
    let at = |value: f64| number::fixed(value, decimals);
    let interval = format!(
        "{} to {}{unit}",
        at(value - COVERING * uncertainty),
        at(value + COVERING * uncertainty)
    );
    [
        name.into(),
        figure(Some(value), decimals).text(unit),
        uncertain(uncertainty, unit),
        interval.into(),
    ]
}

fn uncertain(uncertainty: f64, unit: &str) -> Line {
    let decimals = number::decimals_of(uncertainty);
    let line = Line::new()
        .text("\u{b1} ")
        .line(figure(Some(uncertainty), decimals));
    line.text(unit)
}
