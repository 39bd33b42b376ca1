//! Sections for tests.

use crate::section::Section;
use crate::stack::Course;

/// Points around an ellipse, from its first axis on.
pub(crate) fn ring(a_mm: f64, b_mm: f64, z_mm: f64, count: usize) -> Vec<[f64; 3]> {
    let angle = |k: usize| core::f64::consts::TAU * k as f64 / count as f64;
    let place = |k: usize| [a_mm * libm::cos(angle(k)), b_mm * libm::sin(angle(k)), z_mm];
    (0..count).map(place).collect()
}

pub(crate) fn ellipse(a_mm: f64, b_mm: f64, z_mm: f64, count: usize) -> Course {
    Course {
        name: "ellipse".into(),
        points: ring(a_mm, b_mm, z_mm, count),
        at: (0..count).map(|k| k as f64 / count as f64).collect(),
    }
}

pub(crate) fn section(name: &str, points: Vec<[f64; 3]>) -> Section {
    Section {
        name: name.into(),
        points,
        is_closed: true,
        is_directed: false,
    }
}

/// Sections of a body that is waisted, and elliptic: so many with so many points each.
pub(crate) fn waisted(sections: usize, points: usize) -> Vec<Section> {
    let of = |k: usize| {
        let t = k as f64 / (sections - 1) as f64;
        let wide = 140.0 + 30.0 * libm::cos(core::f64::consts::TAU * t);
        let z = 600.0 * t;
        let ring = ring(wide, 0.7 * wide, z, points);
        section(&format!("section {}", k + 1), ring)
    };
    (0..sections).map(of).collect()
}
