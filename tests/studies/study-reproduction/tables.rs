//! The tables of the page. Numbers have their unit in the head of their column, after a
//! comma, or behind them: [`crate::check`] looks for it there.

use pipeline::Method;

use crate::conditions::{SEEDS, Subject};
use crate::experiment::Figures;
use crate::regions::{Reference, RegionFigures};
use crate::results::{ROADS, Results, Worst, of_region};

/// A table in Markdown.
pub(crate) fn table(heads: &[&str], rows: &[Vec<String>]) -> String {
    let line = |cells: Vec<&str>| format!("| {} |\n", cells.join(" | "));
    let mut text = line(heads.to_vec());
    text += &line(vec!["---"; heads.len()]);
    for row in rows {
        text += &line(row.iter().map(String::as_str).collect());
    }
    text.trim_end().to_owned()
}

/// A number, or what stands for one that does not exist.
pub(crate) fn number(value: f64, digits: usize) -> String {
    if value.is_nan() {
        "none".to_owned()
    } else if value.is_infinite() {
        "exact".to_owned()
    } else {
        format!("{value:.digits$}")
    }
}

fn pair([worst, median]: [f64; 2], digits: usize) -> String {
    format!("{} / {}", number(worst, digits), number(median, digits))
}

/// A figure of a region, by its name in the table.
type Way = (&'static str, Method, fn(&RegionFigures) -> [f64; 2]);

/// Both roads' range images and regions, fitted in three ways.
const WAYS: [Way; 6] = [
    ("S: Naik & Jain, dB", Method::ShimLee, |r| r.naik_db),
    ("S: extension, dB", Method::ShimLee, |r| r.extension_db),
    ("S: model, dB", Method::ShimLee, |r| r.face_db),
    ("R: Naik & Jain, dB", Method::Relief, |r| r.naik_db),
    ("R: extension, dB", Method::Relief, |r| r.extension_db),
    ("R: model, dB", Method::Relief, |r| r.face_db),
];

fn for_regions(row: impl Fn(Subject, usize) -> Vec<String>) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    for subject in Subject::ALL {
        for (k, region) in subject.regions().iter().enumerate() {
            let mut cells = vec![format!("{} {}, {}", subject.title(), k + 1, region.name)];
            cells.extend(row(subject, k));
            rows.push(cells);
        }
    }
    rows
}

/// Table 1, of the first seed. The paper's own columns stand beside its own reference.
pub(crate) fn regions(results: &Results, reference: Reference) -> String {
    let with_paper = reference == Reference::RangeImage;
    let mut heads = vec!["region"];
    if with_paper {
        heads.extend(["paper: Naik & Jain, dB", "paper: extension, dB"]);
    }
    heads.extend(WAYS.map(|way| way.0));
    let rows = for_regions(|subject, k| {
        let mut cells = Vec::new();
        if with_paper {
            let region = subject.regions()[k];
            cells.push(number(region.paper_naik_db, 2));
            cells.push(number(region.paper_extension_db, 2));
        }
        for (_, method, figure) in WAYS {
            let first = results.first(subject, method);
            let db = first.map_or(f64::NAN, |f| {
                of_region(f, k, |r| figure(r)[reference as usize])
            });
            cells.push(number(db, 2));
        }
        cells
    });
    table(&heads, &rows)
}

/// Table 1, the worst and the median over all seeds.
pub(crate) fn regions_over_seeds(results: &Results, reference: Reference) -> String {
    let heads: Vec<&str> = core::iter::once("region")
        .chain(WAYS.map(|way| way.0))
        .collect();
    let rows = for_regions(|subject, k| {
        let figure = |(_, method, figure): Way| {
            let of = |f: &Figures| of_region(f, k, |r| figure(r)[reference as usize]);
            pair(results.over_seeds(subject, method, Worst::Least, of), 1)
        };
        WAYS.map(figure).to_vec()
    });
    table(&heads, &rows)
}

/// How many nodes the figures of Table 1 are taken over, and how many of them are wrong.
pub(crate) fn nodes(results: &Results) -> String {
    let heads = [
        "region",
        "S: region, nodes",
        "S: astray, nodes",
        "S: missing, nodes",
        "R: region, nodes",
        "R: astray, nodes",
        "R: missing, nodes",
    ];
    let counts: [fn(&RegionFigures) -> usize; 3] = [|r| r.nodes, |r| r.astray, |r| r.missing];
    let rows = for_regions(|subject, k| {
        let mut cells = Vec::new();
        for method in ROADS {
            for count in counts {
                let first = results.first(subject, method);
                let nodes =
                    first.map_or(f64::NAN, |f| of_region(f, k, |region| count(region) as f64));
                cells.push(number(nodes, 0));
            }
        }
        cells
    });
    table(&heads, &rows)
}

/// A figure of a whole run: head of its column, decimals, which end is bad, and its value.
type Whole = (&'static str, usize, Worst, fn(&Figures) -> f64);

const AGAINST_IMAGE: [Whole; 3] = [
    ("SNR, dB", 2, Worst::Least, |f| f.whole[0].snr_db),
    ("lost, nodes", 0, Worst::Most, |f| {
        f.whole[0].lost_nodes as f64
    }),
    ("invented, nodes", 0, Worst::Most, |f| {
        f.whole[0].invented_nodes as f64
    }),
];

const AGAINST_TRUTH: [Whole; 6] = [
    ("restored: SNR, dB", 2, Worst::Least, |f| f.whole[1].snr_db),
    ("restored: lost, nodes", 0, Worst::Most, |f| {
        f.whole[1].lost_nodes as f64
    }),
    ("restored: invented, nodes", 0, Worst::Most, |f| {
        f.whole[1].invented_nodes as f64
    }),
    ("range image: SNR, dB", 2, Worst::Least, |f| {
        f.regridded.snr_db
    }),
    ("range image: lost, nodes", 0, Worst::Most, |f| {
        f.regridded.lost_nodes as f64
    }),
    ("range image: invented, nodes", 0, Worst::Most, |f| {
        f.regridded.invented_nodes as f64
    }),
];

const BORDERS: [Whole; 7] = [
    ("faces, number", 0, Worst::Most, |f| f.faces as f64),
    ("farthest, pitches", 2, Worst::Most, |f| {
        f.trimming.most_mm / f.pitch_mm
    }),
    ("rms, pitches", 3, Worst::Most, |f| {
        f.trimming.all.rms_mm() / f.pitch_mm
    }),
    (
        "oblique silhouettes: rms, pitches",
        3,
        Worst::Most,
        oblique_rms_pitches,
    ),
    (
        "oblique silhouettes: mean outward, pitches",
        3,
        Worst::Most,
        |f| f.trimming.oblique_silhouettes.mean_mm() / f.pitch_mm,
    ),
    ("vertices, number", 0, Worst::Most, |f| f.vertices as f64),
    ("corners of the truth, number", 0, Worst::Most, |f| {
        f.corners as f64
    }),
];

/// Of trim loops from the true silhouettes that run off both axes, pitches.
pub(crate) fn oblique_rms_pitches(figures: &Figures) -> f64 {
    figures.trimming.oblique_silhouettes.rms_mm() / figures.pitch_mm
}

/// Which figures of whole runs stand in a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Section VI: restored images against the range images.
    AgainstImage,
    /// Restored and range images against the truth.
    AgainstTruth,
    /// How far trim curves are off.
    Borders,
}

/// One row for each object and road: the first seed, or the worst and the median of all.
pub(crate) fn wholes(results: &Results, kind: Kind, all_seeds: bool) -> String {
    let (columns, with_paper): (&[Whole], bool) = match kind {
        Kind::AgainstImage => (&AGAINST_IMAGE, !all_seeds),
        Kind::AgainstTruth => (&AGAINST_TRUTH, false),
        Kind::Borders => (&BORDERS, false),
    };
    let mut heads = vec!["object", "road"];
    if with_paper {
        heads.push("paper: SNR, dB");
    }
    heads.extend(columns.iter().map(|column| column.0));
    let mut rows = Vec::new();
    for subject in Subject::ALL {
        for method in ROADS {
            let mut cells = vec![subject.title().to_owned(), format!("`{method}`")];
            if with_paper {
                cells.push(number(subject.paper_snr_db(), 2));
            }
            for &(_, digits, worst, figure) in columns {
                cells.push(if all_seeds {
                    pair(results.over_seeds(subject, method, worst, figure), digits)
                } else {
                    let first = results.first(subject, method);
                    number(first.map_or(f64::NAN, figure), digits)
                });
            }
            rows.push(cells);
        }
    }
    table(&heads, &rows)
}

/// Table 3.
pub(crate) fn seconds(results: &Results) -> String {
    let heads = [
        "object",
        "",
        "range image, s",
        "segmentation, s",
        "both: preprocessing, s",
        "boundary, vertices, modelling, s",
        "IGES file, s",
    ];
    let mut rows = Vec::new();
    for subject in Subject::ALL {
        let [preprocessing, boundary, modelling] = subject.paper_seconds();
        let mut row = vec![subject.title().to_owned(), "paper, 486-DX66".to_owned()];
        row.extend(["-".to_owned(), "-".to_owned(), number(preprocessing, 0)]);
        row.extend([number(boundary + modelling, 1), "-".to_owned()]);
        rows.push(row);
        for method in ROADS {
            let first = results.first(subject, method);
            let of = |stage: &str| {
                let seconds = first.and_then(|f| f.seconds.get(stage));
                seconds.copied().unwrap_or(f64::NAN)
            };
            let (regrid, segment) = (of("regrid"), of("segment"));
            let times = [regrid, segment, regrid + segment, of("reconstruct")];
            let mut row = vec![subject.title().to_owned(), format!("`{method}`")];
            row.extend(times.map(|s| number(s, 2)));
            row.push(number(of("export"), 3));
            rows.push(row);
        }
    }
    table(&heads, &rows)
}

/// The seeds in words.
pub(crate) fn seeds() -> String {
    format!("{} to {}", SEEDS.start(), SEEDS.end())
}
