//! Candidates of parts by formula.
mod common;

use common::{Bench, scan};
use features::candidate::{candidates, frame_of, top};
use features::outline::witnesses::Sight;
use range_image::Unmonitored;

fn published(x: f64, y: f64) -> f64 {
    let (sin, cos) = libm::sincos(5f64.to_radians());
    let (u, v) = (cos * x + sin * y, cos * y - sin * x);
    let within =
        |cu: f64, cv: f64, l: f64, w: f64| (u - cu).abs() <= l / 2.0 && (v - cv).abs() <= w / 2.0;
    if !within(0.0, 0.0, 100.871, 50.16) {
        return -23.762;
    }
    let disc = |cu: f64, cv: f64, d: f64| (u - cu).powi(2) + (v - cv).powi(2) <= d * d / 4.0;
    if disc(-30.1, 0.0, 8.026) {
        return -2.0;
    }
    if disc(29.55, 0.2, 8.019) {
        return -40.0;
    }
    if within(0.0, 5.1, 18.36, 20.211) {
        return -14.436;
    }
    if within(-20.0, -9.0, 12.0, 6.0) {
        return -12.0 + 0.5 * libm::sin(u / 3.0) + 0.05 * (v + 9.0).powi(2);
    }
    if within(0.0, 0.0, 79.811, 28.557) {
        return -7.85;
    }
    0.0
}

#[test]
fn measures() {
    let mut off: std::collections::BTreeMap<&str, Vec<(f64, f64)>> = Default::default();
    for seed in 101..113 {
        let bench = Bench {
            seed,
            x_mm: (-60.0 + 0.03 * (seed as f64 - 100.0), 60.0),
            ..Bench::default()
        };
        let columns = scan(&bench, &published);
        let field = features::field::field(&columns, Some(bench.camera_mm), &Unmonitored).unwrap();
        let step = features::regions::least_step_mm(&field);
        let regions = features::regions::regions(&field, &columns, &Unmonitored).unwrap();
        let levels = features::levels::levels(&field.image, &regions, step);
        let top = top(&regions, &levels, step).unwrap();
        let frame = frame_of(&top);
        let sight = Sight {
            columns: &columns,
            camera_mm: Some(bench.camera_mm),
            field: &field,
            regions: &regions,
            levels: &levels,
            frame: &frame,
        };
        let found = candidates(&sight, &top, step, 0, 30, &Unmonitored).unwrap();
        for c in &found {
            let cov = |a: usize, b: usize| c.outline.covariance[a][b];
            match c.outline.shape {
                features::outline::Shape::Circle(k) => {
                    let d = 2.0 * k.radius_mm;
                    let name = if c.lie == features::candidate::Lie::Hollow {
                        "hole"
                    } else {
                        "boss"
                    };
                    let t = if name == "hole" { 8.019 } else { 8.026 };
                    off.entry(name)
                        .or_default()
                        .push((d - t, 2.0 * cov(2, 2).sqrt()));
                }
                features::outline::Shape::Rectangle(r) => {
                    let [a, b] = r.sizes_mm();
                    let sa = (cov(1, 1) + cov(2, 2) - 2.0 * cov(1, 2)).sqrt();
                    let sb = (cov(3, 3) + cov(4, 4) - 2.0 * cov(3, 4)).sqrt();
                    for (n, l, w) in [
                        ("block", 100.871, 50.16),
                        ("pocket", 79.811, 28.557),
                        ("slot", 18.36, 20.211),
                        ("p2", 12.0, 6.0),
                    ] {
                        if (a - l).abs() < 1.0 && (b - w).abs() < 1.0 {
                            off.entry(match n {
                                "block" => "block L",
                                "pocket" => "pocket L",
                                "slot" => "slot L",
                                _ => "p2 L",
                            })
                            .or_default()
                            .push((a - l, sa));
                            off.entry(match n {
                                "block" => "block W",
                                "pocket" => "pocket W",
                                "slot" => "slot W",
                                _ => "p2 W",
                            })
                            .or_default()
                            .push((b - w, sb));
                        }
                    }
                }
            }
        }
    }
    for (name, offs) in off {
        let n = offs.len() as f64;
        let bias = offs.iter().map(|o| o.0).sum::<f64>() / n;
        let rms = (offs.iter().map(|o| o.0 * o.0).sum::<f64>() / n).sqrt();
        let sig = (offs.iter().map(|o| o.1 * o.1).sum::<f64>() / n).sqrt();
        let cover = offs.iter().filter(|o| o.0.abs() <= 1.96 * o.1).count();
        println!("{name:10} n {n} bias {bias:+.4} rms {rms:.4} sigma {sig:.4} cover {cover}");
    }
}
#[test]
fn debug_wrong() {
    let bench = Bench {
        seed: 101,
        outliers: 0.0,
        dropouts: 0.02,
        ..Bench::default()
    };
    let columns = scan(&bench, &published);
    let field = features::field::field(&columns, Some(bench.camera_mm), &Unmonitored).unwrap();
    let step = features::regions::least_step_mm(&field);
    let regions = features::regions::regions(&field, &columns, &Unmonitored).unwrap();
    let levels = features::levels::levels(&field.image, &regions, step);
    let top = top(&regions, &levels, step).unwrap();
    let frame = frame_of(&top);
    let sight = Sight {
        columns: &columns,
        camera_mm: Some(bench.camera_mm),
        field: &field,
        regions: &regions,
        levels: &levels,
        frame: &frame,
    };
    let own = features::border::border(&field.image, &regions, &levels, step, &|l| l == 2);
    let pairs: Vec<_> = own
        .pairs
        .iter()
        .copied()
        .filter(|p| p.outermost && p.sense == features::levels::Sense::Rises)
        .collect();
    let w = features::outline::witnesses::witnesses(&sight, &pairs);
    let o = frame.origin_mm;
    let (sin, cos) = libm::sincos(5f64.to_radians());
    let mut hist = std::collections::BTreeMap::new();
    for w in &w {
        let p = frame.world([w.place[0], w.place[1], 0.0]);
        let (u, v) = (cos * p.x + sin * p.y, cos * p.y - sin * p.x);
        if u.abs() < 35.0 && (v.abs() - 14.2785).abs() < 0.15 && u.abs() > 12.0 {
            let d = v.abs() - 14.2785;
            *hist
                .entry((
                    (d / 0.01).floor() as i64,
                    w.inside,
                    (w.doubt * 100.0) as i64,
                ))
                .or_insert(0) += 1;
        }
    }
    println!("{o:?} {hist:#?}");
}
