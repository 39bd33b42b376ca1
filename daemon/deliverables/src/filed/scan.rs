//! The page of a scan.

use jiff::Timestamp;
use page::{Block, Chart, Column, Fact, Level, Line, Page, Section, Table, Verdict, number};

use super::parameters::parameters;
use super::{date, figure, of_a_kind, origin, per_cent, picture, producer, signed, triple};
use crate::manifest::ManifestFile;
use crate::report::{DeviationsReport, FillReport, RegionReport, Report};
use crate::write::{
    INLIERS_PICTURE_NAME, RANGE_PICTURE_NAME, REGIONS_PICTURE_NAME, RESIDUALS_PICTURE_NAME,
};

/// The page of a scan: its report, the pictures that there are, by name, and the files beside it.
/// Every number on it is one of the report's.
#[must_use]
pub fn scan_page(report: &Report, pictures: &[(&str, Vec<u8>)], files: &[ManifestFile]) -> Page {
    let drawn = |name: &str| {
        let found = pictures.iter().find(|(drawn, _)| *drawn == name);
        found.map(|(_, png)| png.clone())
    };
    let mut sections = Vec::new();
    if !report.warnings.is_empty() {
        sections.push(Section {
            id: "warnings",
            heading: "Warnings".into(),
            blocks: vec![Block::Warnings(report.warnings.clone())],
        });
    }
    sections.push(range(report, drawn(RANGE_PICTURE_NAME)));
    sections.push(surfaces(report, drawn(REGIONS_PICTURE_NAME)));
    sections.extend(parameters(report));
    sections.push(freedom(report));
    if let Some(told) = &report.deviations {
        sections.push(deviations(told, drawn(RESIDUALS_PICTURE_NAME)));
    }
    sections.push(edges(report));
    sections.extend(left_out(report));
    if let Some(png) = drawn(INLIERS_PICTURE_NAME) {
        sections.push(inliers(report, png));
    }
    sections.extend(super::further::sections(report));
    sections.push(super::settings::section(report));
    sections.push(times(report));
    if !files.is_empty() {
        sections.push(listed(files));
    }
    let time: Timestamp = report.timestamp.parse().unwrap_or(Timestamp::UNIX_EPOCH);
    Page {
        title: report.name.clone(),
        kind: "Scan report".into(),
        verdict: verdict(report),
        facts: facts(report),
        sections,
        producer: producer(),
        date: date(time),
    }
}

fn verdict(report: &Report) -> Verdict {
    let faces = report.model.faces;
    let mut line = of_a_kind(faces, "face", "faces").text(" from ");
    line = line.line(of_a_kind(report.regions.count, "region", "regions"));
    if let Some(rms_mm) = report.deviations.as_ref().and_then(|told| told.rms_mm) {
        line = line.text("; nodes lie ").line(figure(Some(rms_mm), 4));
        line = line.text(" mm rms off them");
    }
    line = line
        .text("; ")
        .line(per_cent(report.model.edge_lengths.assumed_share, 1));
    line = line.text(" of the length of edges is assumed; ");
    line = match report.warnings.len() {
        0 => line.text("no warnings"),
        count => line.line(of_a_kind(count, "warning", "warnings")),
    };
    Verdict {
        level: match (faces, report.warnings.len()) {
            (0, _) => Level::Bad,
            (_, 0) => Level::Good,
            _ => Level::Watch,
        },
        line,
    }
}

fn facts(report: &Report) -> Vec<Fact> {
    let mut facts = vec![Fact::new("Taken", report.timestamp.clone())];
    facts.extend(origin(&report.scan));
    let versions = report.versions.iter();
    let versions: Vec<String> = versions
        .map(|(name, version)| format!("{name} {version}"))
        .collect();
    facts.push(Fact::new(
        "Made with",
        Line::new().foreign(versions.join(", ")),
    ));
    facts
}

fn range(report: &Report, png: Option<Vec<u8>>) -> Section {
    let image = &report.range_image;
    let grid = Line::new()
        .count(image.columns)
        .text(" x ")
        .count(image.rows);
    let grid = grid
        .text(" nodes at ")
        .number(image.pitch_mm.to_string(), image.pitch_mm);
    let extent = figure(image.z_min_mm, 3)
        .text(" to ")
        .line(figure(image.z_max_mm, 3));
    let mut facts = vec![
        Fact::new("Grid", grid.text(" mm")),
        Fact::new(
            "Nodes",
            Line::new().count(image.nodes).text(" with a value"),
        ),
        Fact::new("z", extent.text(" mm")),
        Fact::new(
            "Noise",
            figure(image.noise_mm, 4).text(" mm, median of the nodes"),
        ),
        Fact::new(
            "Settled",
            Line::new()
                .count(image.dropped_nodes)
                .text(" nodes dropped and ")
                .count(image.filled_nodes)
                .text(" filled beside outlines, ")
                .count(image.claimed_nodes)
                .text(" given to another face beside borders"),
        ),
    ];
    if let Some(share) = image.inlier_share {
        facts.insert(
            4,
            Fact::new(
                "Agreement",
                per_cent(share, 1).text(" of the samples around a node, median"),
            ),
        );
    }
    let drawn = png.map(|png| {
        let seen = format!(
            "Range image in colours: {} nodes with a value on a grid of {} by {}.",
            image.nodes, image.columns, image.rows
        );
        Block::Picture(picture(
            "Range image: z by colour, grey where nothing was seen.",
            seen,
            png,
        ))
    });
    Section {
        id: "range-image",
        heading: "Range image".into(),
        blocks: std::iter::once(Block::Facts(facts)).chain(drawn).collect(),
    }
}

/// What a face is, in words.
pub(super) fn surface(region: &RegionReport) -> String {
    match (region.kind.as_str(), &region.shape) {
        ("bicubic patches", _) => "free form".into(),
        ("none", _) => "no face".into(),
        (kind, Some(shape)) if shape.hollow == Some(true) => format!("hollow {kind}"),
        (kind, _) => kind.to_owned(),
    }
}

fn surfaces(report: &Report, png: Option<Vec<u8>>) -> Section {
    let mut blocks = Vec::new();
    if let Some(png) = png {
        let seen = format!(
            "Map of the {} regions with their borders and numbers.",
            report.regions.count
        );
        blocks.push(Block::Picture(picture(
            "Regions with their numbers, borders as drawn; background grey, crumbs magenta, closed \
             holes chequered.",
            seen,
            png,
        )));
    }
    if report.regions.list.is_empty() {
        blocks.push(Block::Text("No surface was found.".into()));
    } else {
        blocks.push(Block::Table(Table {
            caption: "Surfaces. Distances of the nodes along z.".into(),
            columns: vec![
                Column::words("Region"),
                Column::words("Surface"),
                Column::words("Name in CAD"),
                Column::numbers("Nodes"),
                Column::numbers("Area, mm\u{b2}"),
                Column::numbers("rms, mm"),
                Column::numbers("Largest, mm"),
                Column::numbers("Parameters"),
                Column::numbers("Samples"),
            ],
            rows: report.regions.list.iter().map(surface_row).collect(),
        }));
    }
    Section {
        id: "surfaces",
        heading: "Surfaces".into(),
        blocks,
    }
}

fn surface_row(region: &RegionReport) -> Vec<Line> {
    let freedom = region.freedom;
    let count = |of: Option<usize>| of.map_or_else(|| "-".into(), |count| Line::new().count(count));
    vec![
        Line::new().count(region.label.into()),
        surface(region).into(),
        region.faces.join(", ").into(),
        Line::new().count(region.nodes),
        figure(region.area_mm2, 1),
        figure(region.rms_mm, 4),
        figure(region.max_mm, 4),
        count(freedom.map(|freedom| freedom.parameters)),
        count(freedom.map(|freedom| freedom.independent)),
    ]
}

/// How much of the noise the surfaces follow.
fn freedom(report: &Report) -> Section {
    let told = || {
        report
            .regions
            .list
            .iter()
            .filter_map(|region| Some((region, region.freedom?)))
    };
    let sum = |of: fn(&crate::report::FreedomReport) -> usize| -> usize {
        told().map(|(_, freedom)| of(&freedom)).sum()
    };
    let (parameters, independent) = (sum(|f| f.parameters), sum(|f| f.independent));
    let mut blocks = vec![Block::Text(
        Line::new()
            .count(parameters)
            .text(" parameters follow ")
            .count(independent)
            .text(
                " independent samples. Each parameter takes up the noise of one sample, whatever \
                 the surface: with p parameters and n samples, about the square root of p / n of \
                 the noise of a single sample is in the surface. A face that is a plane, sphere, \
                 cylinder, cone or torus has 3 to 7 parameters, an extrusion or a revolution 2 or \
                 4 and those of its profile; a free form has as many as its \
                 nodes gave reason for.",
            ),
    )];
    let mut freest: Vec<_> = told().collect();
    let share = |freedom: &crate::report::FreedomReport| {
        freedom.parameters as f64 / freedom.independent.max(1) as f64
    };
    freest.sort_by(|(a, x), (b, y)| share(y).total_cmp(&share(x)).then(a.label.cmp(&b.label)));
    let free_forms = freest
        .iter()
        .filter(|(region, _)| region.kind == "bicubic patches");
    let listed: Vec<Vec<Line>> = free_forms
        .take(FREEST)
        .map(|(region, freedom)| {
            vec![
                Line::new().count(region.label.into()),
                Line::new()
                    .count(freedom.parameters)
                    .text(" parameters follow ")
                    .count(freedom.independent)
                    .text(" samples"),
                format!("{:.0} %", 100.0 * share(freedom).sqrt()).into(),
            ]
        })
        .collect();
    if !listed.is_empty() {
        blocks.push(Block::Table(Table {
            caption: format!("Free forms that follow the noise most, {FREEST} at most."),
            columns: vec![
                Column::words("Region"),
                Column::words("Freedom"),
                Column::numbers("Noise of a sample in the surface, about"),
            ],
            rows: listed,
        }));
    }
    Section {
        id: "freedom",
        heading: "Degrees of freedom".into(),
        blocks,
    }
}

/// As many free forms are listed.
const FREEST: usize = 10;

fn deviations(told: &DeviationsReport, png: Option<Vec<u8>>) -> Section {
    let facts = vec![
        Fact::new("Nodes", Line::new().count(told.nodes).text(" under a face")),
        Fact::new(
            "Elsewhere",
            Line::new()
                .count(told.elsewhere)
                .text(" nodes under a face of a region that they do not belong to"),
        ),
        Fact::new("Mean", figure(told.mean_mm, 4).text(" mm")),
        Fact::new("rms", figure(told.rms_mm, 4).text(" mm")),
        Fact::new("95 % within", figure(told.percentile_95_mm, 4).text(" mm")),
        Fact::new("Largest", figure(told.max_mm, 4).text(" mm")),
    ];
    let mut blocks = vec![
        Block::Text(
            "Signed distances of the nodes from the trimmed faces along their normals; positive \
             towards the camera."
                .into(),
        ),
        Block::Facts(facts),
    ];
    if let Some(png) = png {
        let seen = format!(
            "Map of the deviations of {} nodes in colours, symmetric around zero: red towards the \
             camera, blue behind the face, grey where there is no face.",
            told.nodes
        );
        let caption = "Deviation map: red lies towards the camera, blue behind the face; grey where \
                       there is none.";
        blocks.push(Block::Picture(picture(caption, seen, png)));
    }
    if told.nodes > 0 {
        let histogram = &told.histogram;
        let (below, above) = (histogram.below, histogram.above);
        let caption = format!(
            "Nodes by deviation; {} below and {} above these.",
            number::grouped(below as u64),
            number::grouped(above as u64)
        );
        blocks.push(Block::Chart(Chart {
            alternative: format!(
                "Histogram of {} deviations in {} bars from {} to {} mm.",
                told.nodes,
                histogram.counts.len(),
                histogram.limits_mm.first().copied().unwrap_or(0.0),
                histogram.limits_mm.last().copied().unwrap_or(0.0)
            ),
            caption,
            scale: "deviation, mm".into(),
            limits: histogram.limits_mm.clone(),
            counts: histogram.counts.clone(),
            marks: Vec::new(),
        }));
    }
    if !told.worst.is_empty() {
        let row = |(rank, worst): (usize, &crate::report::WorstReport)| {
            let [x, y, z] = worst.place_mm.map(|value| figure(Some(value), 2));
            vec![
                Line::new().count(rank),
                x,
                y,
                z,
                Line::new().count(worst.region.into()),
                signed(worst.deviation_mm, 4),
            ]
        };
        blocks.push(Block::Table(Table {
            caption: "The worst places, the largest first.".into(),
            columns: vec![
                Column::words("Place"),
                Column::numbers("x, mm"),
                Column::numbers("y, mm"),
                Column::numbers("z, mm"),
                Column::numbers("Region"),
                Column::numbers("Deviation, mm"),
            ],
            rows: (1..).zip(&told.worst).map(row).collect(),
        }));
    }
    Section {
        id: "deviations",
        heading: "Deviations".into(),
        blocks,
    }
}

fn edges(report: &Report) -> Section {
    let model = &report.model;
    let lengths = &model.edge_lengths;
    let row = |name: Line, [measured, intersected, assumed]: [f64; 3]| {
        let all = measured + intersected + assumed;
        let share = if all > 0.0 { assumed / all } else { 0.0 };
        vec![
            name,
            figure(Some(measured), 1),
            figure(Some(intersected), 1),
            figure(Some(assumed), 1),
            figure(Some(100.0 * share), 1),
        ]
    };
    let kinds = ["silhouette", "step", "crease"]
        .into_iter()
        .filter_map(|kind| {
            let of = model.edge_lengths_by_kind.get(kind)?;
            let name = match kind {
                "silhouette" => "Outline, nothing beyond",
                "step" => "Step to another face",
                _ => "Crease between two faces",
            };
            Some(row(
                name.into(),
                [of.measured_mm, of.intersected_mm, of.assumed_mm],
            ))
        });
    let all = [
        lengths.measured_mm,
        lengths.intersected_mm,
        lengths.assumed_mm,
    ];
    let mut rows: Vec<Vec<Line>> = kinds.collect();
    rows.push(row("All".into(), all));
    let text = of_a_kind(model.edges_shared, "edge is", "edges are").text(" shared by two faces, ");
    let text = text.line(of_a_kind(model.free_edges, "edge bounds", "edges bound")).text(
        " one face only. Measured: the samples beside it tell where it runs. Intersected: its two \
         faces intersect there. Assumed: drawn smoothly between nodes, since nothing tells more.",
    );
    Section {
        id: "edges",
        heading: "Edges".into(),
        blocks: vec![
            Block::Text(text),
            Block::Table(Table {
                caption: "Lengths of edges as the camera sees them.".into(),
                columns: vec![
                    Column::words("Kind"),
                    Column::numbers("Measured, mm"),
                    Column::numbers("Intersected, mm"),
                    Column::numbers("Assumed, mm"),
                    Column::numbers("Assumed, %"),
                ],
                rows,
            }),
        ],
    }
}

/// What was closed without having been measured.
fn closed_holes(fill: &FillReport) -> Block {
    let closed = fill.holes.iter().filter(|hole| hole.decision == "closed");
    let closed = closed.count();
    let text = Line::new()
        .line(of_a_kind(closed, "hole", "holes"))
        .text(" of the range image closed, ")
        .count(fill.filled_nodes)
        .text(" nodes that were not measured; ")
        .line(of_a_kind(fill.holes.len() - closed, "hole", "holes"))
        .text(" kept.");
    Block::Text(text)
}

/// What belongs to no face.
fn left_out(report: &Report) -> Option<Section> {
    let (background, crumbs) = (&report.background, &report.crumbs);
    let mut text = Line::new()
        .count(report.lost_nodes)
        .text(" nodes lie outside every face; faces cover ");
    text = text
        .count(report.invented_nodes)
        .text(" nodes that have no value. ");
    text = text
        .line(of_a_kind(crumbs.count, "crumb", "crumbs"))
        .text(" of ");
    text = text.count(crumbs.nodes).text(" nodes in all and ");
    text = text
        .line(of_a_kind(background.count, "region", "regions"))
        .text(" of ");
    text = text
        .count(background.nodes)
        .text(" nodes of background were left out.");
    let mut blocks = vec![Block::Text(text)];
    blocks.extend(report.fill.as_ref().map(closed_holes));
    if !background.list.is_empty() {
        let rows = background.list.iter().map(|region| {
            let normal = region
                .normal
                .map_or_else(|| "-".into(), |normal| triple(normal, 4));
            vec![
                region.kind.clone().into(),
                Line::new().count(region.nodes),
                normal,
                figure(region.offset_mm, 3),
                figure(region.rms_mm, 4),
                region.why.clone().into(),
            ]
        });
        blocks.push(Block::Table(Table {
            caption: "Background.".into(),
            columns: vec![
                Column::words("Kind"),
                Column::numbers("Nodes"),
                Column::words("Normal"),
                Column::numbers("Offset, mm"),
                Column::numbers("rms, mm"),
                Column::words("Evidence"),
            ],
            rows: rows.collect(),
        }));
    }
    Some(Section {
        id: "left-out",
        heading: "Left out".into(),
        blocks,
    })
}

fn inliers(report: &Report, png: Vec<u8>) -> Section {
    let share = report.range_image.inlier_share.unwrap_or(0.0);
    let seen = format!(
        "Map of the share of samples around each node that lie in its surface; median {:.0} per cent.",
        100.0 * share
    );
    let caption = "Share of the samples around each node that lie in its surface: low along edges, \
                   and where outliers are many.";
    Section {
        id: "agreement",
        heading: "Agreement of the samples".into(),
        blocks: vec![Block::Picture(picture(caption, seen, png))],
    }
}

fn times(report: &Report) -> Section {
    let mut stages: Vec<(&String, &f64)> = report.timings_s.iter().collect();
    let order = |name: &str| {
        let stages = pipeline::Stage::ALL;
        stages
            .iter()
            .position(|stage| stage.as_str() == name)
            .unwrap_or(stages.len())
    };
    stages.sort_by_key(|(name, _)| order(name));
    let row =
        |(name, seconds): (&String, &f64)| vec![name.as_str().into(), figure(Some(*seconds), 3)];
    Section {
        id: "times",
        heading: "Time spent".into(),
        blocks: vec![Block::Table(Table {
            caption: "By stage, up to the pictures.".into(),
            columns: vec![Column::words("Stage"), Column::numbers("Seconds")],
            rows: stages.into_iter().map(row).collect(),
        })],
    }
}

fn listed(files: &[ManifestFile]) -> Section {
    let row = |file: &ManifestFile| {
        vec![
            Line::new().foreign(&file.name),
            Line::new().count(file.bytes as usize),
            Line::new().code(&file.sha256),
        ]
    };
    Section {
        id: "files",
        heading: "Files".into(),
        blocks: vec![Block::Table(Table {
            caption: "Files beside this page. The manifest lists the page, too.".into(),
            columns: vec![
                Column::words("Name"),
                Column::numbers("Bytes"),
                Column::words("SHA-256"),
            ],
            rows: files.iter().map(row).collect(),
        })],
    }
}
