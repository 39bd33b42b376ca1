//! The network that tells a feature's class by its attributes (Jun & Park, sections 6.3 and 6.4).
//!
//! One hidden layer, sigmoid neurons, a bias at each, taught by back-propagation pattern after
//! pattern. [`Classifier`] holds the weights, and what was taught, so that it can say of an input
//! that it is like nothing of that.

mod classifier;
mod file;
mod input;
mod judge;
mod known;
mod net;
mod recipe;
mod train;

pub use classifier::{Bounds, Classifier, Doubt, Verdict};
pub use file::{FileError, PUBLISHED, SHIPPED};

pub use input::Scale;
pub use judge::{Judged, foreign_codes, judge, judged};
pub use known::{Known, Taught};
pub use net::{Net, NetError};
pub use recipe::{Epoch, Recipe, Teaching, TrainError, Trained, train};
pub use train::{Rates, Run};
