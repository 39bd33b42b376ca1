//! A feed-forward network of one hidden layer.

use crate::chance::Chance;

/// Why weights are no network.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NetError {
    /// A layer without neurons.
    #[error("a network needs inputs, hidden neurons and outputs; {0:?} of them were given")]
    Empty([usize; 3]),
    /// Fewer weights, or more, than its layers have.
    #[error(
        "the {layer} layer needs {expected} weights, one for each input and a bias for each of its neurons; {found} were given"
    )]
    Shape {
        /// Which.
        layer: &'static str,
        /// After its neurons.
        expected: usize,
        /// In the file.
        found: usize,
    },
    /// A weight that is no number.
    #[error("weight {index} of the {layer} layer is not finite")]
    NotFinite {
        /// Which.
        layer: &'static str,
        /// From 0.
        index: usize,
    },
}

/// Weights of a network with one hidden layer and sigmoid neurons.
#[derive(Debug, Clone, PartialEq)]
pub struct Net {
    sizes: [usize; 3],
    /// Of each hidden neuron in turn: a weight for each input, then that of the bias, 1.
    pub(super) hidden: Vec<f64>,
    /// Of each output in turn: a weight for each hidden neuron, then that of the bias.
    pub(super) output: Vec<f64>,
}

/// What the neurons give, kept between calls.
#[derive(Debug, Clone, Default)]
pub(super) struct Signals {
    pub(super) hidden: Vec<f64>,
    pub(super) output: Vec<f64>,
}

/// The logistic function.
pub(super) fn sigmoid(sum: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-sum))
}

impl Net {
    /// Numbers of inputs, hidden neurons and outputs.
    #[must_use]
    pub fn sizes(&self) -> [usize; 3] {
        self.sizes
    }

    /// Of given weights, neuron after neuron, with that of its bias last.
    ///
    /// # Errors
    /// Where there are not as many as there must be, or one is not finite.
    pub fn new(sizes: [usize; 3], hidden: Vec<f64>, output: Vec<f64>) -> Result<Self, NetError> {
        if sizes.contains(&0) {
            return Err(NetError::Empty(sizes));
        }
        for (layer, weights, inputs, neurons) in [
            ("hidden", &hidden, sizes[0], sizes[1]),
            ("output", &output, sizes[1], sizes[2]),
        ] {
            let expected = inputs.saturating_add(1).saturating_mul(neurons);
            if weights.len() != expected {
                return Err(NetError::Shape {
                    layer,
                    expected,
                    found: weights.len(),
                });
            }
            if let Some(index) = weights.iter().position(|own| !own.is_finite()) {
                return Err(NetError::NotFinite { layer, index });
            }
        }
        Ok(Self {
            sizes,
            hidden,
            output,
        })
    }

    /// Of weights drawn uniformly from -`initial` to `initial`.
    pub(super) fn drawn(
        sizes: [usize; 3],
        initial: f64,
        chance: &mut Chance,
    ) -> Result<Self, NetError> {
        if sizes.contains(&0) {
            return Err(NetError::Empty(sizes));
        }
        let mut draw = |inputs: usize, neurons: usize| -> Vec<f64> {
            let count = (inputs + 1) * neurons;
            (0..count)
                .map(|_| chance.between(-initial, initial))
                .collect()
        };
        let (hidden, output) = (draw(sizes[0], sizes[1]), draw(sizes[1], sizes[2]));
        Self::new(sizes, hidden, output)
    }

    /// Weights of the hidden layer: of each neuron in turn those of the inputs, then its bias.
    #[must_use]
    pub fn hidden(&self) -> &[f64] {
        &self.hidden
    }

    /// Weights of the output layer: of each neuron in turn those of hidden ones, then its bias.
    #[must_use]
    pub fn output(&self) -> &[f64] {
        &self.output
    }

    /// Its outputs, each 0 to 1. Inputs that are missing count 0, those too many nothing.
    #[must_use]
    pub fn outputs(&self, input: &[f64]) -> Vec<f64> {
        let mut signals = Signals::default();
        self.run(input, &mut signals);
        signals.output
    }

    pub(super) fn run(&self, input: &[f64], signals: &mut Signals) {
        layer(&self.hidden, self.sizes[0], input, &mut signals.hidden);
        let Signals { hidden, output } = signals;
        layer(&self.output, self.sizes[1], hidden, output);
    }
}

fn layer(weights: &[f64], inputs: usize, input: &[f64], output: &mut Vec<f64>) {
    output.clear();
    output.extend(weights.chunks_exact(inputs + 1).map(|own| {
        let sum = own.iter().zip(input).fold(0.0, |sum, (w, x)| sum + w * x);
        sigmoid(sum + own[inputs])
    }));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_network_gives_what_is_reckoned_by_hand() {
        // One input, one hidden neuron, one output: w x + b.
        let net = Net::new([1, 1, 1], vec![2.0, -1.0], vec![3.0, 0.5]).unwrap();
        let hidden = 1.0 / (1.0 + libm::exp(-(2.0 * 0.7 - 1.0)));
        let output = 1.0 / (1.0 + libm::exp(-(3.0 * hidden + 0.5)));
        assert_eq!(net.outputs(&[0.7]), [output]);
    }

    #[test]
    fn weights_that_are_no_network_are_refused() {
        let short = Net::new([2, 1, 1], vec![0.0; 2], vec![0.0; 2]).unwrap_err();
        assert!(short.to_string().contains("hidden layer needs 3 weights"));
        let wild = Net::new([1, 1, 1], vec![0.0; 2], vec![0.0, f64::NAN]).unwrap_err();
        assert!(wild.to_string().contains("weight 1 of the output layer"));
        assert!(Net::new([1, 0, 1], vec![], vec![]).is_err());
    }
}
