//! Against trying each plane as the definition has it.

use pulp::Scalar;

use super::planes::Planes;
use super::*;
use crate::plane::LEAST_SINE;

/// Numbers from 0 to 1 without an end.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 31)
    }
}

/// Samples of a noisy plane, some of them anywhere, at this height and scale.
fn samples(
    random: &mut Random,
    number: usize,
    height: f64,
    scale: f64,
    noise: f64,
) -> Vec<[f64; 3]> {
    let slopes = [random.next() - 0.5, random.next() - 0.5];
    let outliers = 0.6 * random.next();
    (0..number)
        .map(|_| {
            let [x, y] = [0, 1].map(|_| scale * (random.next() - 0.5));
            let z = if random.next() < outliers {
                scale * (4.0 * random.next() - 2.0)
            } else {
                slopes[0] * x + slopes[1] * y + noise * scale * (random.next() - 0.5)
            };
            [x, y, height + z]
        })
        .collect()
}

/// By the definition.
fn by_sorting(samples: &[[f64; 3]], planes: usize, draws: &mut Draws) -> Option<(Plane, f64)> {
    let mut best: Option<(Plane, f64)> = None;
    let mut tried = 0;
    for _ in 0..planes * DRAWS_PER_PLANE {
        if tried == planes {
            break;
        }
        let [p, q, r] = draws.triple(samples.len()).map(|k| samples[k]);
        let Some(plane) = Plane::through_points(p, q, r, LEAST_SINE) else {
            continue;
        };
        tried += 1;
        let mut squares: Vec<f64> = samples
            .iter()
            .map(|[x, y, z]| (z - plane.at(*x, *y)).powi(2))
            .collect();
        squares.sort_by(f64::total_cmp);
        let median = squares[(squares.len() - 1) / 2];
        if best.is_none_or(|(_, least)| median < least) {
            best = Some((plane, median));
        }
    }
    best
}

type Path = fn(&mut LeastMedian, usize, &mut Draws) -> Option<(Plane, f64)>;

/// As dispatched, with lanes of 256 bits, and without lanes.
const PATHS: [Path; 3] = [find, narrower, |finder, wanted, draws| {
    Arch::Scalar.dispatch(Find {
        finder,
        wanted,
        draws,
    })
}];

/// With lanes of 256 bits, where the processor has them.
fn narrower(finder: &mut LeastMedian, wanted: usize, draws: &mut Draws) -> Option<(Plane, f64)> {
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        let find = Find {
            finder,
            wanted,
            draws,
        };
        return Simd::vectorize(simd, find);
    }
    find(finder, wanted, draws)
}

fn assert_same(finders: &mut [LeastMedian; 3], samples: &[[f64; 3]], planes: usize, node: i64) {
    let truth = by_sorting(samples, planes, &mut Draws::new(9, node, 0));
    for (path, finder) in PATHS.iter().zip(finders) {
        finder.window.fill(samples.iter().copied()).unwrap();
        let mut draws = Draws::new(9, node, 0);
        let found = path(finder, planes, &mut draws);
        let bits = |answer: Option<(Plane, f64)>| {
            answer.map(|(p, median)| [p.a, p.b, p.c, median].map(f64::to_bits))
        };
        assert_eq!(bits(found), bits(truth), "{} of {planes}", samples.len());
        // Whoever draws on gets the next draws.
        let mut others = Draws::new(9, node, 0);
        by_sorting(samples, planes, &mut others);
        assert_eq!(draws.triple(1000), others.triple(1000));
    }
}

#[test]
fn every_path_finds_what_the_definition_does() {
    let mut random = Random(5);
    let mut finders = Default::default();
    for node in 0..400 {
        let number = 3 + (120.0 * random.next().powi(2)) as usize;
        let planes = 1 + (150.0 * random.next().powi(2)) as usize;
        let height = [0.0, 150.0, -25_000.0][node % 3];
        let scale = [2.0, 0.01, 400.0, 1e-9][node % 4];
        let noise = [0.02, 1e-7, 0.0, 0.5][node / 4 % 4];
        let samples = samples(&mut random, number, height, scale, noise);
        assert_same(&mut finders, &samples, planes, node as i64);
    }
}

#[test]
fn of_equal_planes_the_first_is_taken() {
    // Heights in whole steps: many planes have the same median, often 0.
    let mut random = Random(8);
    let mut finders = Default::default();
    for node in 0..200 {
        let samples: Vec<[f64; 3]> = (0..32)
            .map(|k| {
                let step = (3.0 * random.next()).floor();
                [f64::from(k % 6), f64::from(k / 6), step]
            })
            .collect();
        assert_same(&mut finders, &samples, 64, node);
    }
}

#[test]
fn collinear_samples_have_no_plane_and_those_too_many_or_few() {
    let line: Vec<[f64; 3]> = (0..32).map(|k| [f64::from(k), 2.0, 1.0]).collect();
    let mut finder = LeastMedian::default();
    assert_eq!(finder.plane(&line, 32, 1), None);
    assert_eq!(finder.plane(&line[..2], 32, 1), None);
    assert_eq!(finder.plane(&[[0.0; 3]; GREATEST_WINDOW + 1], 32, 1), None);
    // And it works on.
    let mut random = Random(1);
    let samples = samples(&mut random, GREATEST_WINDOW, 5.0, 1.0, 0.1);
    assert!(finder.plane(&samples, 32, 1).is_some());
}

/// What the exactness of the rough look stands on.
#[test]
fn residuals_in_single_precision_are_within_their_slack() {
    let mut random = Random(3);
    let (mut window, mut planes) = (Window::default(), Planes::default());
    let mut greatest_share = 0.0_f64;
    for trial in 0..3000 {
        let height = [0.0, 7.0, -25_000.0][trial % 3];
        let scale = [2.0, 0.003, 1000.0, 1e-6][trial % 4];
        let samples = samples(&mut random, 24, height, scale, 0.05);
        window.fill(samples.iter().copied()).unwrap();
        let extent = window.lay_out(Scalar::new());
        planes.clear();
        let drawn = planes.draw(
            Scalar::new(),
            &window,
            planes.room(),
            &mut Draws::new(2, trial as i64, 0),
        );
        planes.roughen(&extent);
        for k in 0..drawn {
            for (index, [x, y, z]) in samples.iter().enumerate() {
                let exact = z - planes.plane(k).at(*x, *y);
                let (residual, slack) = planes
                    .rough
                    .residual(k, window.rough().map(|numbers| numbers[index]));
                let share = (f64::from(residual) - exact).abs() / f64::from(slack);
                greatest_share = greatest_share.max(share);
            }
        }
    }
    assert!(greatest_share < 0.7, "{greatest_share}");
    // A bound that is never come near would throw out little.
    assert!(greatest_share > 0.1, "{greatest_share}");
}
