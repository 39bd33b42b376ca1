//! The page of a scan says what its report says, number by number.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on is a test that has failed"
)]

mod common;

use std::collections::BTreeMap;

use common::{Nobody, columns};
use deliverables::{
    CadOptions, Inputs, PageFormat, PageFormats, Report, ScanReport, draw_pictures, scan_page,
};
use lopdf::Document;
use pipeline::{Settings, process_columns};
use scraper::{ElementRef, Html, Selector};

struct Scan {
    report: Report,
    drawings: deliverables::Drawings,
}

fn scan() -> Scan {
    let mut settings = Settings::new(0.5);
    settings.segment.minimum_nodes = 40;
    let (image, outcome) = process_columns(&columns(), &settings, &Nobody).unwrap();
    let inputs = Inputs {
        name: "A <b> & \u{bd80}\u{d488}",
        timestamp: "2026-11-21T13:17:09.753Z".parse().unwrap(),
        image: &image,
        outcome: &outcome,
        settings: &settings,
        cad: &CadOptions::default(),
        points: None,
        page: PageFormats::BOTH,
        scan: ScanReport {
            source: "test".into(),
            operator: Some("M. Mason".into()),
            samples: 7381,
            columns: 121,
            ..ScanReport::default()
        },
        warnings: vec!["a warning".into()],
        versions: BTreeMap::new(),
    };
    Scan {
        report: Report::new(&inputs, BTreeMap::from([("regrid".to_owned(), 0.5)])),
        drawings: draw_pictures(&inputs).unwrap(),
    }
}

fn html(scan: &Scan) -> Html {
    let page = scan_page(&scan.report, &scan.drawings, &[]);
    let bytes = PageFormat::Html.bytes(&page).unwrap();
    let read = Html::parse_document(&String::from_utf8(bytes).unwrap());
    assert_eq!(read.errors, Vec::<String>::new());
    read
}

fn all<'a>(html: &'a Html, selector: &str) -> Vec<ElementRef<'a>> {
    html.select(&Selector::parse(selector).unwrap()).collect()
}

/// Numbers in an element: in full, and as they are shown.
fn numbers(element: ElementRef<'_>) -> Vec<(f64, String)> {
    let selector = Selector::parse("data").unwrap();
    let found = element.select(&selector);
    found
        .map(|data| {
            let value = data.attr("value").unwrap().parse().unwrap();
            (value, data.text().collect::<String>())
        })
        .collect()
}

/// That what is shown of a number is it, rounded.
fn assert_rounded((value, shown): &(f64, String)) {
    let plain = shown.replace(',', "");
    let decimals = plain.split_once('.').map_or(0, |(_, after)| after.len());
    let read: f64 = plain.parse().unwrap();
    let half = 0.5000001 * 10_f64.powi(-(decimals as i32));
    let is_share = (read - 100.0 * value).abs() <= half;
    assert!(
        (read - value).abs() <= half || is_share,
        "{shown} of {value}"
    );
}

#[test]
fn every_number_of_the_page_is_the_reports() {
    let scan = scan();
    let report = &scan.report;
    let kinds: Vec<&str> = report
        .regions
        .list
        .iter()
        .map(|r| r.kind.as_str())
        .collect();
    assert_eq!(kinds, ["plane", "cylinder", "bicubic patches"]);
    let read = html(&scan);
    for data in all(&read, "body") {
        numbers(data).iter().for_each(assert_rounded);
    }
    let rows = all(&read, "#surfaces tbody tr");
    assert_eq!(rows.len(), 3);
    for (row, region) in rows.into_iter().zip(&report.regions.list) {
        let freedom = region.freedom.unwrap();
        let told: Vec<f64> = numbers(row).into_iter().map(|(value, _)| value).collect();
        let expected = [
            f64::from(region.label),
            region.nodes as f64,
            region.area_mm2.unwrap(),
            region.rms_mm.unwrap(),
            region.max_mm.unwrap(),
            freedom.parameters as f64,
            freedom.independent as f64,
        ];
        assert_eq!(told, expected, "region {}", region.label);
    }
    // A plane has three numbers and a cylinder five; a sheet that bends has more, and far fewer than
    // there are samples.
    let freedom: Vec<usize> = report
        .regions
        .list
        .iter()
        .map(|region| region.freedom.unwrap().parameters)
        .collect();
    assert_eq!(freedom[..2], [3, 5]);
    assert!((16..=400).contains(&freedom[2]), "{freedom:?}");
    let cylinder = report.regions.list[1].shape.as_ref().unwrap();
    let radius = cylinder.numbers.as_ref().unwrap().radius_mm.unwrap();
    let row = all(&read, "#parameters tbody tr")
        .into_iter()
        .find(|row| row.text().collect::<String>().contains("radius"))
        .unwrap();
    let told: Vec<f64> = numbers(row).into_iter().map(|(value, _)| value).collect();
    assert_eq!(told, [2.0, radius.value, radius.uncertainty]);
    // The interval, from its text alone.
    let text: String = row.text().collect();
    let (before, high) = text.trim_end_matches(" mm").rsplit_once(" to ").unwrap();
    let low = before.rsplit("mm").next().unwrap();
    let [low, high] = [low, high].map(|limit| limit.trim().parse::<f64>().unwrap());
    assert!(
        ((high - low) / radius.uncertainty - 2.0 * 1.96).abs() < 0.1,
        "{text}"
    );
    let deviations = report.deviations.as_ref().unwrap();
    let bars: Vec<usize> = all(&read, "#deviations svg rect")
        .iter()
        .map(|bar| bar.attr("data-count").unwrap().parse().unwrap())
        .collect();
    assert_eq!(bars, deviations.histogram.counts);
    let binned = bars.iter().sum::<usize>() + deviations.histogram.below;
    assert_eq!(binned + deviations.histogram.above, deviations.nodes);
    assert_eq!(
        all(&read, "#deviations tbody tr").len(),
        deviations.worst.len()
    );
    let text: String = all(&read, "#freedom")[0].text().collect();
    let parameters: usize = freedom.iter().sum();
    assert!(text.starts_with(&format!(
        "Degrees of freedom{parameters} parameters follow "
    )));
    // Warnings come first, and what was chosen before what was left.
    let headings: Vec<String> = all(&read, "h2")
        .iter()
        .map(|h| h.text().collect())
        .collect();
    assert_eq!(headings[0], "Warnings");
    let chosen: String = all(&read, "#settings tbody tr")[0].text().collect();
    assert_eq!(chosen, "segment.minimum_nodes4025");
    assert_eq!(all(&read, "img").len(), 4);
    assert!(
        all(&read, "img")
            .iter()
            .all(|img| !img.attr("alt").unwrap().is_empty())
    );
}

#[test]
fn deviations_are_along_the_normal() {
    let scan = scan();
    let deviations = scan.report.deviations.unwrap();
    // Nodes are better than samples of 0.02 mm, and the mean of many is next to nothing.
    let rms_mm = deviations.rms_mm.unwrap();
    assert!((0.002..0.02).contains(&rms_mm), "{rms_mm}");
    assert!(deviations.mean_mm.unwrap().abs() < 0.1 * rms_mm);
    let sizes: Vec<f64> = deviations
        .worst
        .iter()
        .map(|w| w.deviation_mm.abs())
        .collect();
    assert!(sizes.is_sorted_by(|a, b| a >= b));
    assert_eq!(sizes.first().copied(), deviations.max_mm);
    let limits = &deviations.histogram.limits_mm;
    assert!((limits[0] + limits[limits.len() - 1]).abs() < 1e-12);
    // Steep sides of the bar: along z they are off by more.
    let along_z = scan.report.regions.list[1].max_mm.unwrap();
    let on_bar = deviations.worst.iter().filter(|worst| worst.region == 2);
    assert!(on_bar.map(|w| w.deviation_mm.abs()).fold(0.0, f64::max) < along_z);
}

#[test]
fn the_pdf_holds_the_same_numbers() {
    let mut scan = scan();
    // As many regions as the largest scans have.
    let region = scan.report.regions.list[1].clone();
    scan.report.regions.list = (1..=333)
        .map(|label| {
            let mut region = region.clone();
            region.label = label;
            region.rms_mm = Some(f64::from(label) * 1e-3);
            region
        })
        .collect();
    let page = scan_page(&scan.report, &scan.drawings, &[]);
    let pdf = PageFormat::Pdf.bytes(&page).unwrap();
    assert_eq!(pdf, PageFormat::Pdf.bytes(&page).unwrap());
    let document = Document::load_mem(&pdf).unwrap();
    let sheets: Vec<u32> = document.get_pages().into_keys().collect();
    let text = document.extract_text(&sheets).unwrap();
    let text: String = text.split_whitespace().collect();
    for label in 1..=333 {
        let row = format!("{label}{}Region2", region.kind);
        assert!(text.contains(&row), "{row}");
        assert!(text.contains(&format!("{:.4}", f64::from(label) * 1e-3)));
    }
    for (_, shown) in all(&html(&scan), "body").into_iter().flat_map(numbers) {
        assert!(text.contains(&shown), "{shown}");
    }
    assert!(text.contains("A<b>&\u{bd80}\u{d488}"));
}

#[test]
fn a_report_without_regions_or_pictures_has_a_page_too() {
    let mut scan = scan();
    scan.report.regions.list.clear();
    scan.report.regions.count = 0;
    scan.report.model.faces = 0;
    scan.report.deviations = None;
    scan.drawings.clear();
    let read = html(&scan);
    assert!(all(&read, "img").is_empty());
    assert_eq!(all(&read, ".verdict.bad").len(), 1);
    let text: String = all(&read, "#surfaces")[0].text().collect();
    assert!(text.contains("No surface was found."));
    let page = scan_page(&scan.report, &scan.drawings, &[]);
    assert!(PageFormat::Pdf.bytes(&page).unwrap().starts_with(b"%PDF"));
}
