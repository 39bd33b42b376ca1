//! What comes out does not depend on how many threads there are.

use pipeline::{Settings, process_columns};
use range_image::{Column, Sample, Unmonitored};

/// A ball and a ramp on a table, 50 mm square, whose samples stray by a pattern.
fn scan() -> Vec<Column> {
    let z_mm = |x: f64, y: f64| {
        let ball2 = 100.0 - (x + 9.0) * (x + 9.0) - y * y;
        let ball = if ball2 > 0.0 { libm::sqrt(ball2) } else { 0.0 };
        let is_ramp = (4.0..18.0).contains(&x) && y.abs() < 12.0;
        let ramp = if is_ramp { 2.0 + 0.5 * (x - 4.0) } else { 0.0 };
        ball.max(ramp)
    };
    let column = |i: u32| {
        let x = 0.4 * f64::from(i) - 25.0;
        let samples = (0..125_u32).map(|j| {
            let y_mm = 0.4 * f64::from(j) - 25.0;
            let stray = f64::from((i * 7919 + j * 104_729 + i * j * 31) % 101) / 50.0 - 1.0;
            Sample {
                y_mm,
                z_mm: z_mm(x, y_mm) + 0.04 * stray,
                intensity: 200,
            }
        });
        Column::new(x, samples.collect())
    };
    (0..125).map(column).collect()
}

#[test]
fn threads_change_no_bit() {
    let columns = scan();
    let told = |threads: usize| {
        let mut settings = Settings::new(0.4);
        settings.regrid.threads = threads;
        let (_, outcome) = process_columns(&columns, &settings, &Unmonitored).unwrap();
        assert!(outcome.regions.regions() >= 2);
        // Numbers are written so that they can be read back to the last bit.
        format!("{outcome:?}")
    };
    let one = told(1);
    for threads in [2, 5] {
        assert!(told(threads) == one, "{threads} threads");
    }
}
