//! Irregular scanner columns to a uniform range image, by local consensus or by moving least
//! median of squares (MLMS), after Shim & Lee 1995, section II.1.
//!
//! At each node the M nearest samples are taken, nearest in x and y and within a hard reach
//! in columns; where samples are more than four times as dense one way as the other, distances
//! that way count the more. The paper's estimator ([`Estimator::LeastMedian`]) draws N_s times three of
//! them, which give a plane `z = a x + b y + c`; the plane whose median of squared residuals
//! over the M samples is least gives z at the node (equation 2). Up to half of the samples
//! may be wrong (outliers, the other side of a step edge) without harm.
//!
//! Where outliers and edges meet, more than half are wrong.
//! [`Estimator::Consensus`], the default, takes the noise from the scan itself, rates planes by the
//! samples that lie within it, tells the surfaces at an edge apart and decides by the places
//! of their samples on which of them the node is.
//!
//! The paper leaves open where the object ends. Here a node gets a value only with
//! support: samples that agree with its plane, near the node and around it
//! ([`SupportSettings`]). All other nodes are masked.
//!
//! [`Regridder`] works while the scan runs and needs memory for a window of columns only;
//! [`regrid`](fn@regrid) takes all columns at once and may use several threads. Both give
//! the same bits, whatever the direction of the scan and the number of threads: nothing a
//! node's value depends on is older than the reach, samples are ordered by position before
//! any is drawn, and draws are keyed by the seed and the node.

mod batch;
mod consensus;
mod draws;
mod error;
mod exhaustive;
mod grid;
mod least_median;
mod neighbours;
mod plane;
mod regridder;
mod settings;
mod solve;
mod strip;
mod support;
#[cfg(test)]
mod textbook;
mod window;

pub use batch::{regrid, with_threads};
pub use error::RegridError;
pub use least_median::{GREATEST_WINDOW, LeastMedian};
pub use regridder::Regridder;
pub use settings::{Estimator, RegridSettings, Roi, SettingsError, SupportSettings};
