//! Back-propagation, one pattern after another, with momentum.

use range_image::{Cancelled, Monitor};

use super::net::{Net, Signals};

/// How fast weights follow errors, and when they have followed them far enough.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// Learning rate, eta.
    pub learning: f64,
    /// Share of the last change that is made again, mu.
    pub momentum: f64,
    /// The error of an epoch below which training ends: half the sum of squares of a pattern's
    /// outputs less what they should be, averaged over the patterns.
    pub tolerance: f64,
    /// Most epochs. In one, every pattern is shown once.
    pub epochs: usize,
    /// The learning rate falls evenly to this share of itself over the epochs; 1 keeps it.
    pub last_share: f64,
}

impl Rates {
    /// Those of Jun & Park, section 6.4; most epochs are ours.
    pub const PAPER: Self = Self {
        learning: 0.9,
        momentum: 0.5,
        tolerance: 0.0001,
        epochs: 70_000,
        last_share: 1.0,
    };
}

/// How training went.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// The error of each epoch.
    pub errors: Vec<f64>,
    /// Whether the last is below the tolerance.
    pub has_converged: bool,
}

/// Cancellation is asked for after so many patterns.
const PATTERNS_PER_CHECK: usize = 4096;

/// Teaches a network: `inputs` and what the outputs should be, in the order in which they are shown.
pub(super) fn descend(
    net: &mut Net,
    inputs: &[Vec<f64>],
    targets: &[usize],
    rates: &Rates,
    monitor: &dyn Monitor,
) -> Result<Run, Cancelled> {
    let mut signals = Signals::default();
    let mut state = State {
        hidden_change: vec![0.0; net.hidden.len()],
        output_change: vec![0.0; net.output.len()],
        output_delta: Vec::new(),
        hidden_delta: Vec::new(),
    };
    let mut run = Run {
        errors: Vec::new(),
        has_converged: false,
    };
    let mut shown = 0_usize;
    for epoch in 0..rates.epochs {
        let passed = epoch as f64 / rates.epochs as f64;
        let rate = rates.learning * (1.0 - passed * (1.0 - rates.last_share));
        let mut error = 0.0;
        for (input, &target) in inputs.iter().zip(targets) {
            net.run(input, &mut signals);
            error += state.step(net, input, target, &signals, rate, rates.momentum);
            shown += 1;
            if shown.is_multiple_of(PATTERNS_PER_CHECK) {
                monitor.check()?;
            }
        }
        error /= inputs.len().max(1) as f64;
        run.errors.push(error);
        monitor.progress((epoch + 1) as f64 / rates.epochs as f64);
        if error < rates.tolerance {
            run.has_converged = true;
            break;
        }
    }
    monitor.progress(1.0);
    Ok(run)
}

struct State {
    hidden_change: Vec<f64>,
    output_change: Vec<f64>,
    output_delta: Vec<f64>,
    hidden_delta: Vec<f64>,
}

impl State {
    /// One pattern; gives its error before the weights change.
    fn step(
        &mut self,
        net: &mut Net,
        input: &[f64],
        target: usize,
        signals: &Signals,
        rate: f64,
        momentum: f64,
    ) -> f64 {
        let mut error = 0.0;
        self.output_delta.clear();
        for (k, &own) in signals.output.iter().enumerate() {
            let missing = f64::from(u8::from(k == target)) - own;
            error += 0.5 * missing * missing;
            self.output_delta.push(missing * own * (1.0 - own));
        }
        let width = signals.hidden.len() + 1;
        self.hidden_delta.clear();
        for (j, &own) in signals.hidden.iter().enumerate() {
            let weights = net.output.iter().skip(j).step_by(width);
            let back = weights
                .zip(&self.output_delta)
                .fold(0.0, |sum, (w, d)| sum + w * d);
            self.hidden_delta.push(back * own * (1.0 - own));
        }
        change(
            &mut net.output,
            &mut self.output_change,
            &self.output_delta,
            &signals.hidden,
            [rate, momentum],
        );
        change(
            &mut net.hidden,
            &mut self.hidden_change,
            &self.hidden_delta,
            input,
            [rate, momentum],
        );
        error
    }
}

/// Changes a layer's weights: rate times delta times input, and again a share of the last change.
fn change(
    weights: &mut [f64],
    last: &mut [f64],
    deltas: &[f64],
    input: &[f64],
    [rate, momentum]: [f64; 2],
) {
    let width = input.len() + 1;
    let neurons = weights
        .chunks_exact_mut(width)
        .zip(last.chunks_exact_mut(width));
    for ((weights, last), &delta) in neurons.zip(deltas) {
        let step = rate * delta;
        let with_bias = input.iter().chain(core::iter::once(&1.0));
        for ((weight, last), &x) in weights.iter_mut().zip(last).zip(with_bias) {
            *last = step * x + momentum * *last;
            *weight += *last;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::Unmonitored;

    fn net() -> Net {
        let hidden = vec![0.1, -0.2, 0.05, 0.3, 0.2, -0.1];
        Net::new([2, 2, 2], hidden, vec![0.2, -0.1, 0.1, -0.3, 0.25, 0.0]).unwrap()
    }

    fn error(net: &Net, input: &[f64], target: usize) -> f64 {
        let outputs = net.outputs(input);
        let off = |(k, own): (usize, &f64)| 0.5 * (f64::from(u8::from(k == target)) - own).powi(2);
        outputs.iter().enumerate().map(off).sum()
    }

    /// What one step changes is the error's derivative by each weight, by finite differences.
    #[test]
    fn a_step_goes_down_the_gradient() {
        let input = [0.7, -1.3];
        let mut taught = net();
        let rates = Rates {
            epochs: 1,
            momentum: 0.0,
            learning: 1.0,
            ..Rates::PAPER
        };
        descend(&mut taught, &[input.to_vec()], &[1], &rates, &Unmonitored).unwrap();
        let step = 1e-6;
        for k in 0..6 {
            for is_hidden in [true, false] {
                let moved = |by: f64| {
                    let mut own = net();
                    let layer = if is_hidden {
                        &mut own.hidden
                    } else {
                        &mut own.output
                    };
                    layer[k] += by;
                    error(&own, &input, 1)
                };
                let gradient = (moved(step) - moved(-step)) / (2.0 * step);
                let change = if is_hidden {
                    taught.hidden[k] - net().hidden[k]
                } else {
                    taught.output[k] - net().output[k]
                };
                assert!((change + gradient).abs() < 1e-8, "{k} {is_hidden}");
            }
        }
    }

    /// Two epochs on one pattern: the second step has the first in it, times the momentum.
    #[test]
    fn momentum_makes_the_last_change_again() {
        let input = vec![vec![0.4, 0.9]];
        let taught = |epochs: usize, momentum: f64, from: Net| {
            let mut net = from;
            let rates = Rates {
                epochs,
                momentum,
                ..Rates::PAPER
            };
            descend(&mut net, &input, &[0], &rates, &Unmonitored).unwrap();
            net
        };
        let once = taught(1, 0.0, net());
        let twice = taught(1, 0.0, once.clone());
        let with = taught(2, 0.5, net());
        for k in 0..6 {
            let again = 0.5 * (once.output[k] - net().output[k]);
            assert!((with.output[k] - (twice.output[k] + again)).abs() < 1e-15);
        }
        assert_ne!(with, twice);
    }

    #[test]
    fn the_error_falls_to_the_tolerance_and_training_ends_there() {
        let inputs = vec![
            vec![0.0, 0.0],
            vec![0.0, 1.0],
            vec![1.0, 0.0],
            vec![1.0, 1.0],
        ];
        let rates = Rates {
            epochs: 20_000,
            ..Rates::PAPER
        };
        let mut net = net();
        // Exclusive or, which no network without a hidden layer can tell.
        let run = descend(&mut net, &inputs, &[0, 1, 1, 0], &rates, &Unmonitored).unwrap();
        assert!(run.has_converged && run.errors.len() < 20_000);
        assert!(run.errors.last().is_some_and(|&last| last < 0.0001));
        assert!(run.errors.iter().rev().skip(1).all(|&own| own >= 0.0001));
        assert!(net.outputs(&[1.0, 1.0])[0] > 0.95 && net.outputs(&[0.0, 1.0])[1] > 0.95);
    }

    #[test]
    fn whoever_lost_interest_is_not_kept_waiting() {
        struct Gone;
        impl Monitor for Gone {
            fn is_cancelled(&self) -> bool {
                true
            }
            fn progress(&self, _: f64) {}
        }
        let inputs = vec![vec![0.0, 0.0]; 5000];
        let run = descend(&mut net(), &inputs, &[0; 5000], &Rates::PAPER, &Gone);
        assert_eq!(run, Err(Cancelled));
    }
}
