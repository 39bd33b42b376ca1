//! Tables of recordings, and the page they stand on.

use crate::Case;

/// The part of a scan's samples for which the model must hold.
const NEAREST: f64 = 0.97;

/// What stands before the table.
const PREFACE: &str = "\
# Recorded scans, measured

`cargo xtask study real-scans --write docs/studies/real-scans.md` makes this page from the
recordings beside the repository, with the service's defaults.
[What is right and wrong about each](../real-scans.md) stands on a page of its own.

Samples, not nodes, are held against the model. A sample lies within a face if it does so as
the camera sees it. Sigma is, for each region, the median over its nodes of the standard
deviation of the samples about the plane fitted there. Distances are along the normal of the
face's surface. Of all samples within faces, a few at edges lie on neither side (mixed pixels,
curled ends of runs), and their distances rule the root mean square; so it is given of the
nearest 97 % of all samples, too, within faces or not: infinite where fewer lie within faces.

";

/// The page.
pub(crate) fn page(cases: &[Case]) -> String {
    format!("{PREFACE}{}", table(cases))
}

/// One line for each recording.
pub(crate) fn table(cases: &[Case]) -> String {
    let mut text = String::from(
        "| recording | pitch, mm | samples | regions | faces | patches | samples within faces \
         | of these within three sigma | rms along the normal, mm | rms of the nearest 97 %, mm |\n\
         | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n",
    );
    for case in cases {
        let reconstruction = &case.outcome.reconstruction;
        let patches: usize = reconstruction.regions.iter().map(|r| r.patches).sum();
        text += &format!(
            "| {} | {} | {} | {} | {} | {} | {:.1} % | {:.1} % | {:.3} | {:.3} |\n",
            case.name,
            case.image.pitch_mm(),
            case.all.samples,
            case.outcome.regions.regions(),
            reconstruction.model.faces.len(),
            patches,
            100.0 * case.all.coverage(),
            100.0 * case.all.near_share(),
            case.all.rms_mm(),
            case.all.rms_of_nearest_mm(NEAREST),
        );
    }
    text
}

/// One line for each face of a recording, and where the samples are that lie within none.
pub(crate) fn of_regions(case: &Case) -> String {
    let mut text = format!(
        "{}\n\n| face | nodes | patches | rms of the nodes, mm | samples | within three sigma \
         | rms along the normal, mm |\n| --- | ---: | ---: | ---: | ---: | ---: | ---: |\n",
        case.name
    );
    let reconstruction = &case.outcome.reconstruction;
    for (face, residuals) in reconstruction.model.faces.iter().zip(&case.each) {
        let mut fits = reconstruction.regions.iter();
        let Some(fit) = fits.find(|fit| fit.label == face.region) else {
            continue;
        };
        let reconstruct::Surface::Patches(surface) = &face.surface;
        text += &format!(
            "| {} | {} | {} | {:.3} | {} | {:.1} % | {:.3} |\n",
            face.name,
            fit.nodes,
            surface.patches.len(),
            fit.rms_mm,
            residuals.samples,
            100.0 * residuals.near_share(),
            residuals.rms_mm(),
        );
    }
    let outside = case.all.outside;
    text += &format!(
        "\nOf the samples within no face {} lie at nodes without a value, {} at crumbs, {} at nodes of \
         regions.\n",
        outside.masked, outside.crumbs, outside.regions
    );
    text
}
