//! What is told of the holes of a range image, closed or kept.

use pipeline::{FillDecision, FillEvidence, Filling, Gap, RayCounts};
use serde::{Deserialize, Serialize};

/// What became of the holes of the range image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FillReport {
    /// `auto` or `all`.
    pub mode: String,
    /// Diameter of the largest circle that fits into a hole up to which it is closed.
    pub max_size_mm: f64,
    /// Places of holes that were to be kept, x and y.
    pub keep_mm: Vec<[f64; 2]>,
    /// Places of holes that were to be closed.
    pub close_mm: Vec<[f64; 2]>,
    /// Nodes that were given a value without having been measured.
    pub filled_nodes: usize,
    /// Every hole: first what is hidden behind something, then the others, each by place.
    pub holes: Vec<HoleReport>,
}

/// A hole of the range image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HoleReport {
    /// Its middle, on the surface that is carried on into it.
    pub centre_mm: [f64; 3],
    /// Diameter of the largest circle that fits into it.
    pub size_mm: f64,
    /// Its nodes.
    pub nodes: usize,
    /// Regions of the range image, as first divided, that it lies in or was given to.
    pub regions: Vec<u16>,
    /// `closed` or `kept`.
    pub decision: String,
    /// Why: `hidden`, `surface`, `chance`, `no-ray`, `below`, `no-return`, `step`, `size`,
    /// `no-surface` or `asked`.
    pub why: String,
    /// What the rays that went there tell; `null` where they were not asked.
    pub evidence: Option<EvidenceReport>,
}

/// What rays tell of a hole.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EvidenceReport {
    /// Those that went into it.
    pub inside: RaysReport,
    /// Those that went to the surface around it.
    pub around: RaysReport,
    /// Natural logarithm of the odds of an opening against a surface.
    pub log_odds: f64,
}

/// What became of rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct RaysReport {
    /// They came back from the surface that is carried on.
    pub on_surface: u32,
    /// From below it.
    pub below: u32,
    /// From above it.
    pub above: u32,
    /// Not at all.
    pub lost: u32,
}

impl From<RayCounts> for RaysReport {
    fn from(own: RayCounts) -> Self {
        Self {
            on_surface: own.on_surface,
            below: own.below,
            above: own.above,
            lost: own.lost,
        }
    }
}

impl From<&FillEvidence> for EvidenceReport {
    fn from(own: &FillEvidence) -> Self {
        Self {
            inside: own.inside.into(),
            around: own.around.into(),
            log_odds: own.log_odds,
        }
    }
}

impl From<&Gap> for HoleReport {
    fn from(own: &Gap) -> Self {
        Self {
            centre_mm: own.centre_mm,
            size_mm: own.size_mm,
            nodes: own.nodes,
            regions: own.regions.clone(),
            decision: match own.decision {
                FillDecision::Closed => "closed",
                FillDecision::Kept => "kept",
            }
            .to_owned(),
            why: own.cause.as_str().to_owned(),
            evidence: own.evidence.as_ref().map(Into::into),
        }
    }
}

impl From<&Filling> for FillReport {
    fn from(own: &Filling) -> Self {
        Self {
            mode: own.settings.mode.as_str().to_owned(),
            max_size_mm: own.settings.max_size_mm,
            keep_mm: own.settings.keep_mm.clone(),
            close_mm: own.settings.close_mm.clone(),
            filled_nodes: own.filled.len(),
            holes: own.gaps.iter().map(Into::into).collect(),
        }
    }
}
