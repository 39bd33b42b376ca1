//! Machining features of the scan, where they are asked for.

use features::edit::edit;
use features::recognise::{Recognition, Settings, Teller, recognise};
use pipeline::Observer;
use range_image::Column;

use super::make::{Stop, threaded};
use crate::export::file_stem;
use crate::extras::Extras;
use crate::features::{
    EditEntry, FEATURES_NAME, FeatureNetwork, FeaturesFile, features_solid, write_features_picture,
    write_features_step,
};
use crate::write::{DeliverError, Inputs};

/// Name of the picture.
pub(crate) const FEATURES_PICTURE_NAME: &str = "features.png";
/// Most samples that are held in memory for it.
const MOST_SAMPLES: usize = 1 << 25;

/// Recognises the features of what was scanned.
pub(crate) fn recognised(
    inputs: &Inputs<'_>,
    network: &FeatureNetwork,
    edits: &[EditEntry],
    watch: &dyn Observer,
) -> Result<Recognition, Stop> {
    let Some(points) = inputs.points else {
        return Err(Stop::Refused(
            "there are no samples to recognise features by".to_owned(),
        ));
    };
    let roi = inputs.settings.regrid.roi;
    let within = |value: f64, (low, high): (f64, f64)| low <= value && value <= high;
    let mut columns: Vec<Column> = Vec::new();
    let mut samples = 0;
    let read = points.0.visit(&mut |column| {
        let own = column.samples().iter().filter(|sample| {
            within(column.x_mm(), roi.x_mm)
                && within(sample.y_mm, roi.y_mm)
                && within(sample.z_mm, roi.z_mm)
        });
        let own = Column::new(column.x_mm(), own.copied().collect());
        samples += own.samples().len();
        columns.push(own);
        samples <= MOST_SAMPLES && watch.check().is_ok()
    });
    watch.check()?;
    read.map_err(|error| Stop::Refused(format!("the samples could not be read again: {error}")))?;
    if samples > MOST_SAMPLES {
        return Err(Stop::Refused(format!(
            "the scan has more than {MOST_SAMPLES} samples, the most of which features are \
             recognised; give a region of interest"
        )));
    }
    columns.sort_by(Column::compare_x);
    let network = network.classifier();
    let settings = Settings {
        teller: Teller::Network(network),
        seed: inputs.settings.regrid.seed,
        least_pitches: Settings::USUAL_PITCHES,
    };
    let mut found = threaded(inputs, || {
        Ok(recognise(&columns, points.0.camera_mm(), &settings, watch)?)
    })?;
    let edits: Vec<_> = edits.iter().map(EditEntry::edit).collect();
    edit(&mut found, &edits, network.classes())
        .map_err(|error| Stop::Refused(format!("deliverables.edit: {error}")))?;
    Ok(found)
}

/// Writes them: the file, the solid and the picture.
pub(crate) fn write_recognised(
    extras: &mut Extras<'_>,
    inputs: &Inputs<'_>,
    recognition: &Recognition,
) -> Result<(), DeliverError> {
    let file = FeaturesFile::of(recognition);
    extras.put(FEATURES_NAME, &|sink| Ok(file.write(sink)?))?;
    for feature in &recognition.features {
        for warning in &feature.warnings {
            extras.remarks.push(format!(
                "{FEATURES_NAME}: {} {}: {warning}",
                feature.class, feature.id
            ));
        }
    }
    let name = format!("{}.features.step", file_stem(inputs.name));
    match features_solid(recognition) {
        Ok((solid, notes)) => {
            extras.put(&name, &|sink| {
                write_features_step(&solid, inputs.name, inputs.timestamp, inputs.cad, sink)
            })?;
            let notes = notes.into_iter().map(|note| format!("{name}: {note}"));
            extras.remarks.extend(notes);
        }
        Err(error) => extras.refuse(&name, &error),
    }
    let mut png = Vec::new();
    match write_features_picture(&recognition.image, recognition, inputs.name, &mut png) {
        Ok(()) => {
            extras.put(FEATURES_PICTURE_NAME, &|sink| Ok(sink.write_all(&png)?))?;
        }
        Err(error) => extras.refuse(FEATURES_PICTURE_NAME, &error),
    }
    Ok(())
}
