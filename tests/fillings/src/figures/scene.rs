//! Triangles drawn as pictures: depths compared in each pixel, so that what is in front is in front.

use std::collections::HashMap;

use anyhow::Result;
use fill::TriangleMesh;
use glam::{DVec2, DVec3};

/// Pixels to a side of a written one, which is their mean.
const FINER: usize = 4;
/// The light, as the viewer has it: to the right, up, towards the viewer.
const LIGHT: DVec3 = DVec3::new(-0.5, 0.5, 0.71);
const AMBIENT: f64 = 0.3;
/// Depth of colours: steps of this make smaller files, and nobody sees them.
const STEP: f64 = 6.0;
const LINE: DVec3 = DVec3::new(38.0, 50.0, 62.0);
/// What is seen from behind.
const BEHIND: DVec3 = DVec3::new(128.0, 74.0, 66.0);

/// Triangles that look alike.
pub(crate) struct Part<'a> {
    pub(crate) mesh: &'a TriangleMesh,
    /// Those of its triangles that are drawn.
    pub(crate) triangles: std::ops::Range<usize>,
    pub(crate) colour: [u8; 3],
    /// Width of the lines along edges, pixels; none for 0.
    pub(crate) line: f64,
    /// How far it is drawn before where it is.
    pub(crate) lift_mm: f64,
    /// Whether it looks round, by normals at vertices.
    pub(crate) is_round: bool,
}

/// From where a panel is seen.
#[derive(Debug, Clone, Copy)]
pub(crate) struct View {
    /// Around the upright axis z, from the axis -y to x, and up from level; degrees.
    pub(crate) azimuth_deg: f64,
    pub(crate) elevation_deg: f64,
    /// What is in the middle of the panel, and how much is seen across it, millimetres.
    pub(crate) middle_mm: DVec3,
    pub(crate) across_mm: f64,
}

impl View {
    /// To the right, up, towards the viewer.
    fn axes(&self) -> [DVec3; 3] {
        let (sa, ca) = libm::sincos(self.azimuth_deg.to_radians());
        let (se, ce) = libm::sincos(self.elevation_deg.to_radians());
        let towards = DVec3::new(sa * ce, -ca * ce, se);
        let right = DVec3::new(ca, sa, 0.0);
        [right, towards.cross(right), towards]
    }
}

/// Panels beside each other, each of the same size in pixels.
pub(crate) fn picture(
    panels: &[(View, Vec<Part<'_>>)],
    [width, height]: [usize; 2],
) -> Result<Vec<u8>> {
    let whole = width * panels.len();
    let mut bytes = vec![0; 3 * whole * height];
    for (number, (view, parts)) in panels.iter().enumerate() {
        let mut canvas = Canvas::new(*view, [width * FINER, height * FINER]);
        parts.iter().for_each(|part| canvas.draw(part));
        for row in 0..height {
            for column in 0..width {
                let at = 3 * (row * whole + number * width + column);
                bytes[at..at + 3].copy_from_slice(&canvas.mean(column, row));
            }
        }
    }
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, whole as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    encoder.write_header()?.write_image_data(&bytes)?;
    Ok(png)
}

struct Canvas {
    view: View,
    size: [usize; 2],
    colours: Vec<DVec3>,
    depths: Vec<f64>,
}

impl Canvas {
    fn new(view: View, size: [usize; 2]) -> Self {
        Self {
            view,
            size,
            colours: vec![DVec3::splat(255.0); size[0] * size[1]],
            depths: vec![f64::NEG_INFINITY; size[0] * size[1]],
        }
    }

    fn draw(&mut self, part: &Part<'_>) {
        let axes = self.view.axes();
        let scale = self.size[0] as f64 / self.view.across_mm;
        let half = self.size.map(|size| 0.5 * size as f64);
        let middle = self.view.middle_mm;
        let seen = |p: DVec3| {
            let arm = scale * (p - middle);
            DVec3::new(
                half[0] + axes[0].dot(arm),
                half[1] - axes[1].dot(arm),
                axes[2].dot(arm) + scale * part.lift_mm,
            )
        };
        let at = |v: u32| DVec3::from_array(part.mesh.vertices_mm[v as usize]);
        let normals = if part.is_round {
            normals(part.mesh)
        } else {
            HashMap::new()
        };
        let light = axes[0] * LIGHT.x + axes[1] * LIGHT.y + axes[2] * LIGHT.z;
        let base = DVec3::from_array(part.colour.map(f64::from));
        for triangle in &part.mesh.triangles[part.triangles.clone()] {
            let corners = triangle.map(at);
            let own = (corners[1] - corners[0])
                .cross(corners[2] - corners[0])
                .normalize_or_zero();
            let shades = triangle.map(|v| {
                let normal = normals.get(&v).copied().unwrap_or(own);
                let facing = if own.dot(axes[2]) < 0.0 { -1.0 } else { 1.0 };
                let lit = (facing * normal.dot(light)).max(0.0);
                AMBIENT + (1.0 - AMBIENT) * lit
            });
            let colour = if own.dot(axes[2]) < 0.0 { BEHIND } else { base };
            let line = part.line * FINER as f64;
            self.triangle(corners.map(seen), shades, colour, line);
        }
    }

    fn triangle(&mut self, corners: [DVec3; 3], shades: [f64; 3], base: DVec3, line: f64) {
        let flat = corners.map(DVec3::truncate);
        let twice = (flat[1] - flat[0]).perp_dot(flat[2] - flat[0]);
        if twice == 0.0 || !twice.is_finite() {
            return;
        }
        let range = |k: usize| {
            let own = flat.map(|p| p[k]);
            let low = own[0].min(own[1]).min(own[2]).floor().max(0.0) as usize;
            let high = own[0].max(own[1]).max(own[2]).ceil().max(0.0) as usize;
            low..high.min(self.size[k])
        };
        let lengths = [0, 1, 2].map(|k| flat[(k + 1) % 3].distance(flat[(k + 2) % 3]));
        for row in range(1) {
            for column in range(0) {
                let p = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
                let shares = [0, 1, 2]
                    .map(|k| (flat[(k + 1) % 3] - p).perp_dot(flat[(k + 2) % 3] - p) / twice);
                if shares.iter().any(|share| *share < 0.0) {
                    continue;
                }
                let sum = |of: [f64; 3]| (0..3).map(|k| shares[k] * of[k]).sum::<f64>();
                let depth = sum(corners.map(|c| c.z));
                let pixel = row * self.size[0] + column;
                if depth <= self.depths[pixel] {
                    continue;
                }
                self.depths[pixel] = depth;
                // Half of a line lies in each of the triangles beside it.
                let to_edge = (0..3)
                    .map(|k| shares[k] * twice.abs() / lengths[k])
                    .fold(f64::INFINITY, f64::min);
                self.colours[pixel] = if to_edge < 0.5 * line {
                    LINE
                } else {
                    base * sum(shades)
                };
            }
        }
    }

    /// The colour of a written pixel.
    fn mean(&self, column: usize, row: usize) -> [u8; 3] {
        let mut sum = DVec3::ZERO;
        for j in 0..FINER {
            for i in 0..FINER {
                sum += self.colours[(row * FINER + j) * self.size[0] + column * FINER + i];
            }
        }
        let mean = sum / (FINER * FINER) as f64;
        // From white down, so that white stays white.
        mean.to_array()
            .map(|own| (255.0 - ((255.0 - own) / STEP).round() * STEP).clamp(0.0, 255.0) as u8)
    }
}

/// Normals at vertices, by the areas of the triangles around.
fn normals(mesh: &TriangleMesh) -> HashMap<u32, DVec3> {
    let mut sums: HashMap<u32, DVec3> = HashMap::new();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| DVec3::from_array(mesh.vertices_mm[v as usize]));
        let own = (b - a).cross(c - a);
        for v in triangle {
            *sums.entry(*v).or_default() += own;
        }
    }
    sums.values_mut()
        .for_each(|own| *own = own.normalize_or_zero());
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_in_front_hides_what_is_behind() {
        let square = |z: f64, side: f64| TriangleMesh {
            vertices_mm: [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .map(|[x, y]| [side * x, side * y, z])
                .to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        let (far, near) = (square(0.0, 4.0), square(1.0, 2.0));
        let part = |mesh, colour| Part {
            mesh,
            triangles: 0..2,
            colour,
            line: 0.0,
            lift_mm: 0.0,
            is_round: false,
        };
        let view = View {
            azimuth_deg: 0.0,
            elevation_deg: 90.0,
            middle_mm: DVec3::ZERO,
            across_mm: 10.0,
        };
        // In whatever order they are drawn.
        for parts in [
            [part(&far, [250, 0, 0]), part(&near, [0, 250, 0])],
            [part(&near, [0, 250, 0]), part(&far, [250, 0, 0])],
        ] {
            let mut canvas = Canvas::new(view, [30 * FINER, 30 * FINER]);
            parts.iter().for_each(|part| canvas.draw(part));
            let [middle, beside, out] = [15, 5, 1].map(|column| canvas.mean(column, 15));
            assert!(middle[1] > 150 && middle[0] == 0, "{middle:?}");
            assert!(beside[0] > 150 && beside[1] == 0, "{beside:?}");
            assert_eq!(out, [255; 3]);
        }
    }
}
