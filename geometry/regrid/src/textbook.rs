//! The method as the paper tells it, slow and plain, to compare with.

use range_image::{Column, Lattice, Sample, Unmonitored};

use crate::draws::Draws;
use crate::{Estimator, RegridSettings, regrid};

/// z at the node by sorting everything.
fn z_mm(columns: &[Column], (i, j): (i64, i64), settings: &RegridSettings) -> f64 {
    let lattice = Lattice {
        pitch_mm: settings.pitch_mm,
    };
    let (x, y) = (lattice.line_mm(i), lattice.line_mm(j));
    let mut left: Vec<&Column> = columns.iter().filter(|c| c.x_mm() < x).collect();
    let mut right: Vec<&Column> = columns.iter().filter(|c| c.x_mm() > x).collect();
    left.sort_by(|a, b| b.x_mm().total_cmp(&a.x_mm()));
    right.sort_by(|a, b| a.x_mm().total_cmp(&b.x_mm()));
    let mut window: Vec<[f64; 4]> = Vec::new();
    let reach = settings.reach_columns;
    let exact = columns.iter().filter(|c| c.x_mm() == x);
    for column in left
        .into_iter()
        .take(reach)
        .chain(right.into_iter().take(reach))
        .chain(exact)
    {
        let mut own: Vec<[f64; 4]> = Vec::new();
        for sample in column.samples() {
            let (dx, dy) = (column.x_mm() - x, sample.y_mm - y);
            own.push([dx * dx + dy * dy, dy, sample.z_mm, dx]);
        }
        own.sort_by(|a, b| a.partial_cmp(b).unwrap());
        window.extend(own.into_iter().take(settings.neighbours.div_ceil(2)));
    }
    window.sort_by(|a, b| a.partial_cmp(b).unwrap());
    window.truncate(settings.neighbours);

    let mut draws = Draws::new(settings.seed, i, j);
    let (mut best, mut tried) = ((f64::INFINITY, f64::NAN), 0);
    while tried < settings.draws {
        let matrix = draws.triple(window.len()).map(|k| {
            let [_, dy, z, dx] = window[k];
            [dx, dy, 1.0, z]
        });
        // Nearly collinear triples are drawn again: those seen at an angle of 0.02.
        let [p, q, r] = matrix;
        let angle = libm::atan2(q[1] - p[1], q[0] - p[0]) - libm::atan2(r[1] - p[1], r[0] - p[0]);
        if libm::sin(angle).abs() <= 0.02 {
            continue;
        }
        tried += 1;
        let [a, b, c] = solve(matrix);
        let mut squares: Vec<f64> = window
            .iter()
            .map(|[_, dy, z, dx]| {
                let residual = a * dx + b * dy + c - z;
                residual * residual
            })
            .collect();
        squares.sort_by(f64::total_cmp);
        let median = squares[(squares.len() - 1) / 2];
        if median < best.0 {
            best = (median, c);
        }
    }
    best.1
}

/// Gauss-Jordan elimination with row pivots.
fn solve(mut m: [[f64; 4]; 3]) -> [f64; 3] {
    for k in 0..3 {
        let pivot = (k..3)
            .max_by(|&a, &b| m[a][k].abs().total_cmp(&m[b][k].abs()))
            .unwrap();
        m.swap(k, pivot);
        for row in 0..3 {
            if row != k {
                let factor = m[row][k] / m[k][k];
                let pivot = m[k];
                for (value, above) in m[row].iter_mut().zip(pivot) {
                    *value -= factor * above;
                }
            }
        }
    }
    [0, 1, 2].map(|k| m[k][3] / m[k][k])
}

#[test]
fn the_regridder_agrees_with_the_textbook() {
    let mut state = 77_u64;
    let mut random = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 40) as f64 / f64::from(1 << 24)
    };
    for (neighbours, draws, reach_columns, pitch_mm) in
        [(32, 32, 8, 0.5), (9, 5, 3, 0.31), (48, 20, 6, 0.77)]
    {
        let columns: Vec<Column> = (0..40)
            .map(|k| {
                let x = 0.4 * f64::from(k) + 0.1 * random();
                let samples = (0..60).map(|_| {
                    let y_mm = 15.0 * random();
                    let outlier = if random() < 0.2 { 10.0 * random() } else { 0.0 };
                    Sample {
                        y_mm,
                        z_mm: 0.3 * x - 0.2 * y_mm + 0.1 * random() + outlier,
                        intensity: 0,
                    }
                });
                Column::new(x, samples.collect())
            })
            .collect();
        let settings = RegridSettings {
            neighbours,
            draws,
            reach_columns,
            estimator: Estimator::LeastMedian,
            ..RegridSettings::with_pitch(pitch_mm)
        };
        let image = regrid(columns.clone(), &settings, &Unmonitored).unwrap();
        let (i, j) = image.origin();
        let (mut compared, mut agree) = (0, 0);
        for column in 6..image.columns() - 6 {
            for row in 6..image.rows() - 6 {
                let node = (i + column as i64, j + row as i64);
                if let Some(z) = image.z_mm(column, row) {
                    compared += 1;
                    agree += usize::from((z - z_mm(&columns, node, &settings)).abs() < 1e-9);
                }
            }
        }
        assert!(compared > 60, "{compared}");
        // Where the first plane found no support another is sought.
        assert!(agree * 100 >= compared * 97, "{agree} of {compared}");
    }
}
