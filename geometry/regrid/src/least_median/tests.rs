//! Against trying each plane as the definition has it.

use pulp::Scalar;

use super::planes::Planes;
use super::rough::Bounds;
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

type Path = fn(Find<'_, Samples<'_>>) -> Option<(Plane, f64)>;
type Samples<'a> = core::iter::Copied<core::slice::Iter<'a, [f64; 3]>>;

/// As dispatched, with lanes of 256 bits, and without lanes.
const PATHS: [Path; 3] = [
    |find| lanes::dispatch(find),
    narrower,
    |find| lanes::with(Scalar::new(), find),
];

/// With lanes of 256 bits, where the processor has them.
fn narrower(find: Find<'_, Samples<'_>>) -> Option<(Plane, f64)> {
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return lanes::with(simd, find);
    }
    lanes::dispatch(find)
}

fn assert_same(finders: &mut [LeastMedian; 3], samples: &[[f64; 3]], planes: usize, node: i64) {
    let truth = by_sorting(samples, planes, &mut Draws::new(9, node, 0));
    for (path, finder) in PATHS.iter().zip(finders) {
        let mut draws = Draws::new(9, node, 0);
        let found = path(Find {
            finder,
            samples: samples.iter().copied(),
            wanted: planes,
            draws: &mut draws,
        });
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

#[test]
fn samples_of_any_size_in_any_number_are_looked_at_alike() {
    let mut random = Random(21);
    let mut finders = Default::default();
    for node in 0..600 {
        let number = 3 + node % 70;
        let height = [0.0, 1e9, -1e-9][node % 3];
        // Some are too large or too small for single precision.
        let scale = [1.0, 1e-7, 1e7, 1e-30, 1e30, 1e-90, 1e60][node % 7];
        let noise = [0.05, 0.0, 1e-12][node / 7 % 3];
        let samples = samples(&mut random, number, height * scale, scale, noise);
        assert_same(&mut finders, &samples, 1 + node % 50, node as i64);
    }
}

#[test]
fn samples_on_lines_and_on_each_other_are_looked_at_alike() {
    let mut random = Random(34);
    let mut finders = Default::default();
    for node in 0..600 {
        let number = 3 + (60.0 * random.next()) as usize;
        let mut samples = samples(&mut random, number, 100.0, 4.0, 0.01);
        // As near to a line as the least sine, nearer, or on it.
        let width = [0.04, 0.02, 1e-5, 1e-12, 0.0][node % 5];
        for sample in &mut samples {
            sample[1] = 0.3 * sample[0] + width * sample[1];
        }
        // The same sample again, or one next to it.
        let apart = [0.0, 1e-9, 1e-5][node % 3];
        for k in 0..number {
            if random.next() < 0.5 {
                let other = samples[(number as f64 * random.next()) as usize];
                samples[k] = other.map(|coordinate| coordinate + apart * random.next());
            }
        }
        assert_same(&mut finders, &samples, 40, node as i64);
    }
}

#[test]
fn a_guess_from_any_window_finds_the_same() {
    let mut random = Random(55);
    let mut finders: [LeastMedian; 3] = Default::default();
    for node in 0..600 {
        let samples = samples(&mut random, 32, 10.0, 5.0, 0.01);
        let (_, median) = by_sorting(&samples, 64, &mut Draws::new(9, node, 0)).unwrap();
        // Just above and below what is found, and far off.
        let share = [1.0, 1.0 + 1e-7, 1.0 - 1e-7, 1e-3, 1e3, 0.9][node as usize % 6];
        for finder in &mut finders {
            finder.hint = Some(share * median);
        }
        assert_same(&mut finders, &samples, 64, node);
    }
}

/// What the exactness of the rough look stands on.
#[test]
fn residuals_in_single_precision_are_within_their_slack() {
    let mut greatest = [0.0_f64; 3];
    lanes::dispatch(Shares(&mut greatest[0]));
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        lanes::with(simd, Shares(&mut greatest[1]));
    }
    lanes::with(Scalar::new(), Shares(&mut greatest[2]));
    for share in greatest {
        assert!(share < 0.7, "{greatest:?}");
    }
    // Rounding rarely adds up as the bound has to assume; but a bound too far off would throw out
    // little.
    assert!(greatest[0] > 0.05, "{greatest:?}");
}

/// The greatest share of the slack that a residual is off by.
struct Shares<'a>(&'a mut f64);

impl WithLanes for Shares<'_> {
    type Output = ();

    fn with_lanes<L: Lanes>(self, lanes: L) {
        let mut random = Random(3);
        let (mut window, mut planes) = (Window::default(), Planes::default());
        for trial in 0..6000 {
            let height = [0.0, 7.0, -25_000.0][trial % 3];
            let scale = [2.0, 0.003, 1000.0, 1e-6][trial % 4];
            let mut samples = samples(&mut random, 24, height, scale, 0.05);
            // Far from the origin, and nearly on a line.
            for sample in &mut samples {
                sample[0] += [0.0, 5.0][trial / 4 % 2] * scale;
                sample[1] *= [1.0, 0.03, 0.001][trial / 8 % 3];
            }
            let extent = window.fill(lanes, samples.iter().copied()).unwrap();
            if !extent.is_moderate() {
                continue;
            }
            planes.clear();
            let mut draws = Draws::new(2, trial as i64, 0);
            let bounds = Bounds::new(&extent);
            let found = planes.draw(lanes, &window, &bounds, DRAWN, &mut draws);
            let slots: Vec<usize> = (0..DRAWN).filter(|slot| planes.has_plane(*slot)).collect();
            let truly: Vec<usize> = (0..DRAWN)
                .filter(|slot| planes.plane(&window, *slot).is_some())
                .collect();
            assert_eq!((slots.len(), &slots), (found, &truly));
            for slot in slots {
                let plane = planes.plane(&window, slot).unwrap();
                for (index, [x, y, z]) in samples.iter().enumerate() {
                    let exact = z - plane.at(*x, *y);
                    let rough = window.rough().map(|numbers| numbers[index]);
                    let (residual, slack) = planes.residual(slot, rough);
                    *self.0 = self.0.max((residual - exact).abs() / f64::from(slack));
                }
            }
        }
    }
}

#[test]
fn numbers_are_picked_by_their_indices() {
    lanes::dispatch(Picks);
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        lanes::with(simd, Picks);
    }
    lanes::with(Scalar::new(), Picks);
}

struct Picks;

impl WithLanes for Picks {
    type Output = ();

    fn with_lanes<L: Lanes>(self, lanes: L) {
        let mut random = Random(13);
        let numbers: Vec<f32> = (0..GREATEST_WINDOW).map(|k| k as f32).collect();
        for length in (lanes::PICKED..=GREATEST_WINDOW).step_by(lanes::PICKED) {
            let mut indices = [0_u32; 64];
            indices.fill_with(|| (length as f64 * random.next()) as u32);
            for (k, vector) in L::as_simd_u32s(&indices).0.iter().enumerate() {
                let mut picked = [0.0; 64];
                L::as_mut_simd_f32s(&mut picked).0[0] = lanes.pick(&numbers[..length], *vector);
                for lane in 0..L::F32_LANES {
                    assert_eq!(picked[lane], indices[k * L::F32_LANES + lane] as f32);
                }
            }
        }
    }
}
