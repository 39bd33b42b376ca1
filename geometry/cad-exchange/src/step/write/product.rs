//! The product that has the shape (ISO 10303-41), units and uncertainty.

use super::data::{Data, Id};
use super::measure::Moments;
use super::options::{LengthUnit, Schema, WriteOptions};
use super::shapes::Shapes;

/// Application context, protocol and year of a schema.
fn protocol(schema: Schema) -> (&'static str, &'static str, usize) {
    match schema {
        Schema::Ap242 => (
            "managed model based 3d engineering",
            "ap242_managed_model_based_3d_engineering",
            2014,
        ),
        Schema::Ap214 => (
            "core data for automotive mechanical design processes",
            "automotive_design",
            2010,
        ),
    }
}

/// The definition of a product's shape, `PRODUCT_DEFINITION_SHAPE`, and all that it needs.
pub(super) fn product(data: &mut Data, options: &WriteOptions) -> Id {
    let (context, name, year) = protocol(options.schema);
    let application = data.add("APPLICATION_CONTEXT", |v| v.text(context));
    data.add("APPLICATION_PROTOCOL_DEFINITION", |v| {
        v.text("international standard");
        v.text(name);
        v.integer(year);
        v.id(application);
    });
    let context = data.add("PRODUCT_CONTEXT", |v| {
        v.text("");
        v.id(application);
        v.text("mechanical");
    });
    let product = data.add("PRODUCT", |v| {
        v.text(&options.product);
        v.text(&options.product);
        v.text("");
        v.ids(&[context]);
    });
    data.add("PRODUCT_RELATED_PRODUCT_CATEGORY", |v| {
        v.text("part");
        v.word("$");
        v.ids(&[product]);
    });
    let formation = data.add("PRODUCT_DEFINITION_FORMATION", |v| {
        v.text("");
        v.text("");
        v.id(product);
    });
    let stage = data.add("PRODUCT_DEFINITION_CONTEXT", |v| {
        v.text("part definition");
        v.id(application);
        v.text("design");
    });
    let definition = data.add("PRODUCT_DEFINITION", |v| {
        v.text("design");
        v.text("");
        v.id(formation);
        v.id(stage);
    });
    data.add("PRODUCT_DEFINITION_SHAPE", |v| {
        v.text("");
        v.text("");
        v.id(definition);
    })
}

/// The units that shapes and properties refer to.
pub(super) struct Units {
    /// Of lengths.
    length: Id,
    /// The context of all representations, with units and uncertainty.
    pub(super) context: Id,
}

/// Units of length, plane angle and solid angle; the uncertainty in millimetres.
pub(super) fn units(data: &mut Data, unit: LengthUnit, uncertainty_mm: f64) -> Units {
    let millimetre = data.complex("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))");
    let length = match unit {
        LengthUnit::Millimetre => millimetre,
        LengthUnit::Inch => {
            let factor = data.add("LENGTH_MEASURE_WITH_UNIT", |v| {
                v.typed("LENGTH_MEASURE", unit.mm());
                v.id(millimetre);
            });
            let dimensions = data.add("DIMENSIONAL_EXPONENTS", |v| {
                [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
                    .iter()
                    .for_each(|&exponent| v.real(exponent));
            });
            data.complex(&format!(
                "(CONVERSION_BASED_UNIT('INCH',{factor})LENGTH_UNIT()NAMED_UNIT({dimensions}))"
            ))
        }
    };
    let angle = data.complex("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
    let solid = data.complex("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
    let uncertainty = data.add("UNCERTAINTY_MEASURE_WITH_UNIT", |v| {
        v.typed("LENGTH_MEASURE", uncertainty_mm / unit.mm());
        v.id(length);
        v.text("distance_accuracy_value");
        v.text("largest gap between what should meet");
    });
    let context = data.complex(&format!(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)\n\
         GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({uncertainty}))\n\
         GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid}))\n\
         REPRESENTATION_CONTEXT('',''))"
    ));
    Units { length, context }
}

/// Geometric validation properties: what a reader should find when it measures the faces
/// that it made of the file.
pub(super) fn properties(
    data: &mut Data,
    shapes: &Shapes,
    units: &Units,
    shape: Id,
    moments: &Moments,
) {
    let unit_mm2 = shapes.unit.mm() * shapes.unit.mm();
    let area = moments.area_mm2 / unit_mm2;
    let area = measure(
        data,
        units,
        2.0,
        ("surface area measure", "AREA_MEASURE"),
        area,
    );
    let centroid = shapes.point(data, "centre point", moments.centroid_mm());
    for (name, item) in [("surface area", area), ("centroid", centroid)] {
        property(data, units, shape, name, item);
    }
}

/// The volume of a solid, as a validation property.
pub(super) fn volume(data: &mut Data, shapes: &Shapes, units: &Units, shape: Id, volume_mm3: f64) {
    let unit = shapes.unit.mm();
    let volume = volume_mm3 / (unit * unit * unit);
    let item = measure(
        data,
        units,
        3.0,
        ("volume measure", "VOLUME_MEASURE"),
        volume,
    );
    property(data, units, shape, "volume", item);
}

/// A measure in a power of the unit of length.
fn measure(
    data: &mut Data,
    units: &Units,
    power: f64,
    (name, keyword): (&str, &str),
    value: f64,
) -> Id {
    let element = data.add("DERIVED_UNIT_ELEMENT", |v| {
        v.id(units.length);
        v.real(power);
    });
    let unit = data.add("DERIVED_UNIT", |v| v.ids(&[element]));
    data.add("MEASURE_REPRESENTATION_ITEM", |v| {
        v.text(name);
        v.typed(keyword, value);
        v.id(unit);
    })
}

fn property(data: &mut Data, units: &Units, shape: Id, name: &str, item: Id) {
    let property = data.add("PROPERTY_DEFINITION", |v| {
        v.text("geometric validation property");
        v.text(name);
        v.id(shape);
    });
    let representation = data.add("REPRESENTATION", |v| {
        v.text(name);
        v.ids(&[item]);
        v.id(units.context);
    });
    data.add("PROPERTY_DEFINITION_REPRESENTATION", |v| {
        v.id(property);
        v.id(representation);
    });
}
