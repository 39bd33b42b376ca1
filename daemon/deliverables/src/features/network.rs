//! The network that tells features, as a job is given it.

use std::sync::Arc;

use features::network::Classifier;

/// A network: one that is built in, or the content of a file that `relief features train` wrote.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureNetwork(Choice);

#[derive(Debug, Clone, PartialEq)]
enum Choice {
    BuiltIn(&'static Classifier),
    Own(Arc<Classifier>),
}

impl Default for FeatureNetwork {
    /// The one that is built in.
    fn default() -> Self {
        Self(Choice::BuiltIn(Classifier::shipped()))
    }
}

impl FeatureNetwork {
    /// A network that is built in, by name: `default`, or `published`, the one of Jun & Park.
    #[must_use]
    pub fn built_in(name: &str) -> Option<Self> {
        match name {
            "default" => Some(Self::default()),
            "published" => Some(Self(Choice::BuiltIn(Classifier::published()))),
            _ => None,
        }
    }

    /// The network of a file with this content.
    ///
    /// # Errors
    /// What is wrong with it, with its line.
    pub fn read(text: &str) -> Result<Self, String> {
        let network = Classifier::read(text).map_err(|error| error.to_string())?;
        Ok(Self(Choice::Own(Arc::new(network))))
    }

    pub(crate) fn classifier(&self) -> &Classifier {
        match &self.0 {
            Choice::BuiltIn(network) => network,
            Choice::Own(network) => network,
        }
    }
}
