//! A page as one HTML file that needs nothing else.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::letters::visible;
use crate::model::{
    Align, Block, Chart, Column, Fact, Level, Line, Page, Picture, Run, Section, Table,
};
use crate::number::{grouped, ticks};

const STYLE: &str = include_str!("style.css");
/// Nothing is loaded from anywhere, and nothing runs.
const POLICY: &str = "default-src 'none'; img-src data:; style-src 'unsafe-inline'";

/// The page as HTML, UTF-8.
#[must_use]
pub fn to_html(page: &Page) -> String {
    let title = visible(&page.title);
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta name="generator" content=(page.producer);
                title { (title) ": " (page.kind) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    p.kind { (page.kind) }
                    h1 { bdi { (title) } }
                    p class={ "verdict " (level(page.verdict.level)) } { (line(&page.verdict.line)) }
                    (facts(&page.facts))
                    nav aria-label="Contents" {
                        ul {
                            @for section in &page.sections {
                                li { a href={ "#" (section.id) } { (section.heading) } }
                            }
                        }
                    }
                }
                main {
                    @for part in &page.sections { (section(part)) }
                }
                footer { p { (page.producer) } }
            }
        }
    };
    markup.into_string()
}

fn level(level: Level) -> &'static str {
    match level {
        Level::Good => "good",
        Level::Watch => "watch",
        Level::Bad => "bad",
    }
}

fn section(section: &Section) -> Markup {
    html! {
        section id=(section.id) aria-labelledby={ (section.id) "-heading" } {
            h2 id={ (section.id) "-heading" } { (section.heading) }
            @for part in &section.blocks {
                @match part {
                    Block::Text(text) => p { (line(text)) },
                    Block::Warnings(warnings) => ul.warnings {
                        @for warning in warnings { li { (visible(warning)) } }
                    },
                    Block::Facts(list) => (facts(list)),
                    Block::Table(shown) => (table(shown)),
                    Block::Picture(shown) => (picture(shown)),
                    Block::Chart(shown) => (chart(shown)),
                }
            }
        }
    }
}

fn line(line: &Line) -> Markup {
    html! { @for piece in &line.runs { (run(piece)) } }
}

fn run(run: &Run) -> Markup {
    let text = visible(&run.text);
    html! {
        @if let Some(value) = run.value {
            data value=(value) { (text) }
        } @else if run.is_foreign {
            bdi { (text) }
        } @else if run.is_code {
            code { (text) }
        } @else {
            (text)
        }
    }
}

fn facts(facts: &[Fact]) -> Markup {
    html! {
        dl {
            @for fact in facts {
                div { dt { (fact.label) } dd { (line(&fact.value)) } }
            }
        }
    }
}

fn table(table: &Table) -> Markup {
    let class = |column: &Column| (column.align == Align::Right).then_some("number");
    html! {
        // Wide tables are scrolled by themselves, with the keyboard too.
        div.wide role="region" aria-label=(table.caption) tabindex="0" {
            table {
                caption { (table.caption) }
                thead {
                    tr {
                        @for column in &table.columns {
                            th scope="col" class=[class(column)] { (column.heading) }
                        }
                    }
                }
                tbody {
                    @for row in &table.rows {
                        tr {
                            @for (index, (cell, column)) in row.iter().zip(&table.columns).enumerate() {
                                @if index == 0 {
                                    th scope="row" class=[class(column)] { (line(cell)) }
                                } @else {
                                    td class=[class(column)] { (line(cell)) }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn picture(picture: &Picture) -> Markup {
    let data = BASE64_STANDARD.encode(&picture.png);
    let size = crate::png::rows(&picture.png).ok();
    let side = |of: fn(&crate::png::Rows) -> u32| size.as_ref().map(of);
    html! {
        figure {
            img src={ "data:image/png;base64," (data) } alt=(picture.alternative)
                width=[side(|rows| rows.width)] height=[side(|rows| rows.height)];
            figcaption { (picture.caption) }
        }
    }
}

/// Size of a chart, in units of its own.
const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 170.0;
/// Below the bars, for the scale.
const FOOT: f64 = 38.0;
/// Above them, for what marks mean.
const HEAD: f64 = 16.0;

fn chart(chart: &Chart) -> Markup {
    let (Some(&low), Some(&high)) = (chart.limits.first(), chart.limits.last()) else {
        return html! {};
    };
    let x = |value: f64| {
        let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
        (share * WIDTH * 100.0).round() / 100.0
    };
    let most = chart.counts.iter().copied().max().unwrap_or(0).max(1) as f64;
    let bars: Vec<[f64; 3]> = chart
        .limits
        .windows(2)
        .zip(&chart.counts)
        .filter_map(|(limits, count)| {
            let &[from, to] = limits else { return None };
            let height = (*count as f64 / most * HEIGHT * 100.0).round() / 100.0;
            Some([x(from), (x(to) - x(from)).max(0.0), height])
        })
        .collect();
    let floor = HEAD + HEIGHT;
    html! {
        figure {
            svg viewBox={ "-24 0 " (WIDTH + 48.0) " " (floor + FOOT) } role="img"
                aria-label=(chart.alternative) {
                @for ([left, width, height], count) in bars.into_iter().zip(&chart.counts) {
                    rect.bar x=(left) y=(floor - height) width=(width) height=(height)
                        data-count=(count) {}
                }
                line.axis x1="0" y1=(floor) x2=(WIDTH) y2=(floor) {}
                @for (value, text) in ticks(low, high, 6) {
                    line.axis x1=(x(value)) y1=(floor) x2=(x(value)) y2=(floor + 5.0) {}
                    text x=(x(value)) y=(floor + 18.0) { (text) }
                }
                text x=(WIDTH / 2.0) y=(floor + 34.0) { (chart.scale) }
                text.most x="0" y=(HEAD - 4.0) { "highest bar: " (grouped(most as u64)) }
                @for mark in chart.marks.iter().filter(|mark| (low..=high).contains(&mark.at)) {
                    line.mark x1=(x(mark.at)) y1=(HEAD) x2=(x(mark.at)) y2=(floor) {}
                    text x=(x(mark.at)) y=(HEAD - 4.0) { (mark.label) }
                }
            }
            figcaption { (chart.caption) }
        }
    }
}
