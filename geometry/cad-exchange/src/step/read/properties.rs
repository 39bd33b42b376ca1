//! Units, colours and validation properties.

use std::collections::BTreeMap;

use super::ReadError;
use super::exchange::Exchange;
use super::shapes::Shapes;

/// Of a representation's context.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Context {
    pub(super) unit_mm: f64,
    pub(super) uncertainty_mm: f64,
}

pub(super) fn context(exchange: &Exchange<'_>, id: u64) -> Result<Context, ReadError> {
    let mut fields = exchange.fields(id, &["GLOBAL_UNIT_ASSIGNED_CONTEXT"])?;
    let mut unit_mm = None;
    for unit in fields.ids("its units")? {
        // Units of angles have other parts than a unit of length.
        if exchange.fields(unit, &["LENGTH_UNIT"]).is_ok() {
            unit_mm = Some(length_unit(exchange, unit)?);
        }
    }
    let Some(unit_mm) = unit_mm else {
        return Err(fields.defect("it has no unit of length"));
    };
    let mut fields = exchange.fields(id, &["GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT"])?;
    let ids = fields.ids("its uncertainties")?;
    let &[uncertainty] = ids.as_slice() else {
        return Err(fields.defect("it does not have one uncertainty"));
    };
    let mut fields = exchange.fields(uncertainty, &["UNCERTAINTY_MEASURE_WITH_UNIT"])?;
    let uncertainty = fields.measure("LENGTH_MEASURE", "its value")?;
    let unit = length_unit(exchange, fields.id("its unit")?)?;
    Ok(Context {
        unit_mm,
        uncertainty_mm: uncertainty * unit,
    })
}

/// Millimetres of a unit of length.
pub(super) fn length_unit(exchange: &Exchange<'_>, id: u64) -> Result<f64, ReadError> {
    let conversion = exchange.fields(id, &["CONVERSION_BASED_UNIT", "SI_UNIT"])?;
    if conversion.keyword() == "SI_UNIT" {
        return si_length(exchange, id);
    }
    let mut conversion = conversion;
    conversion.skip("its name")?;
    let factor = conversion.id("its factor")?;
    let mut fields = exchange.fields(factor, &["LENGTH_MEASURE_WITH_UNIT"])?;
    let factor = fields.measure("LENGTH_MEASURE", "its value")?;
    let unit_mm = factor * si_length(exchange, fields.id("its unit")?)?;
    if unit_mm.is_finite() && unit_mm > 0.0 {
        Ok(unit_mm)
    } else {
        Err(fields.defect("a unit of this length is not read"))
    }
}

fn si_length(exchange: &Exchange<'_>, id: u64) -> Result<f64, ReadError> {
    let mut fields = exchange.fields(id, &["SI_UNIT"])?;
    let prefix = fields.word("its prefix")?;
    match (prefix, fields.word("its name")?) {
        ("MILLI", "METRE") => Ok(1.0),
        ("CENTI", "METRE") => Ok(10.0),
        ("", "METRE") => Ok(1000.0),
        _ => Err(fields.defect("lengths are read in metres, centimetres and millimetres")),
    }
}

/// Colours of faces by the number of the instance.
pub(super) fn colours(exchange: &Exchange<'_>) -> Result<BTreeMap<u64, [u8; 3]>, ReadError> {
    let mut colours = BTreeMap::new();
    for id in exchange.all("STYLED_ITEM") {
        let mut fields = exchange.fields(id, &["STYLED_ITEM"])?;
        fields.skip("its name")?;
        let styles = fields.ids("its styles")?;
        let &[style] = styles.as_slice() else {
            return Err(fields.defect("it does not have one style"));
        };
        colours.insert(fields.id("its item")?, colour(exchange, style)?);
    }
    Ok(colours)
}

/// Follows the chain from a style to red, green and blue.
fn colour(exchange: &Exchange<'_>, style: u64) -> Result<[u8; 3], ReadError> {
    let first = |id: u64, keyword: &'static str, named: bool| {
        let mut fields = exchange.fields(id, &[keyword])?;
        if named {
            fields.skip("its name")?;
        }
        let ids = fields.ids("its styles")?;
        let first = ids.first().copied();
        first.ok_or_else(|| fields.defect("it has no style"))
    };
    let usage = first(style, "PRESENTATION_STYLE_ASSIGNMENT", false)?;
    let mut fields = exchange.fields(usage, &["SURFACE_STYLE_USAGE"])?;
    fields.skip("its side")?;
    let side = fields.id("its style")?;
    let fill = first(side, "SURFACE_SIDE_STYLE", true)?;
    let mut fields = exchange.fields(fill, &["SURFACE_STYLE_FILL_AREA"])?;
    let area = fields.id("its style")?;
    let colour = first(area, "FILL_AREA_STYLE", true)?;
    let mut fields = exchange.fields(colour, &["FILL_AREA_STYLE_COLOUR"])?;
    fields.skip("its name")?;
    let rgb = fields.id("its colour")?;
    let mut fields = exchange.fields(rgb, &["COLOUR_RGB"])?;
    fields.skip("its name")?;
    let mut channels = [0; 3];
    for channel in &mut channels {
        let share = fields.real("a share of a colour")?;
        if !(0.0..=1.0).contains(&share) {
            return Err(fields.defect("a share of a colour is not within 0 and 1"));
        }
        *channel = libm::round(share * 255.0) as u8;
    }
    Ok(channels)
}

/// Area and centroid that the writer found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Validation {
    pub(super) area_mm2: Option<f64>,
    pub(super) centroid_mm: Option<[f64; 3]>,
}

pub(super) fn validation(shapes: &Shapes<'_, '_>) -> Result<Validation, ReadError> {
    let exchange = shapes.exchange;
    let mut found = Validation::default();
    for id in exchange.all("PROPERTY_DEFINITION_REPRESENTATION") {
        let mut fields = exchange.fields(id, &["PROPERTY_DEFINITION_REPRESENTATION"])?;
        let property = fields.id("its property")?;
        let representation = fields.id("its representation")?;
        let mut property = exchange.fields(property, &["PROPERTY_DEFINITION"])?;
        if property.text("its name")? != "geometric validation property" {
            continue;
        }
        let mut representation = exchange.fields(representation, &["REPRESENTATION"])?;
        representation.skip("its name")?;
        let items = representation.ids("its items")?;
        let &[item] = items.as_slice() else {
            return Err(representation.defect("it does not have one item"));
        };
        let known = ["MEASURE_REPRESENTATION_ITEM", "CARTESIAN_POINT"];
        let mut fields = exchange.fields(item, &known)?;
        if fields.keyword() == "CARTESIAN_POINT" {
            found.centroid_mm = Some(shapes.point(item)?);
        } else {
            fields.skip("its name")?;
            let area = fields.measure("AREA_MEASURE", "its value")?;
            found.area_mm2 = Some(area * shapes.unit_mm * shapes.unit_mm);
        }
    }
    Ok(found)
}
