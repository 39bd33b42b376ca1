//! How near fillings come to the surfaces that holes were cut from.
#![allow(missing_docs, clippy::unwrap_used)]

#[path = "../tests/common/mod.rs"]
mod common;

use std::time::Instant;

use common::{Shape, noisy, with_hole};
use fill::{Kernel, Outcome, Settings, fill};
use glam::DVec3;
use range_image::Unmonitored;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let sigma: f64 = arguments.first().map_or(0.0, |own| own.parse().unwrap());
    let kernels: Vec<Option<Kernel>> = if arguments.len() > 1 {
        vec![Some(Kernel::ThinPlate), Some(Kernel::Biharmonic), Some(Kernel::Triharmonic), None]
    } else {
        vec![None]
    };
    for shape in Shape::ALL { if std::env::var("ONLY").is_ok_and(|o| !format!("{shape:?}").contains(&o)) { continue; }
        for share in [0.01_f64, 0.05, 0.15, 0.25, 0.03, 0.1, 0.2, 0.3, 0.4] {
            for &kernel in &kernels {
                let edge = (share * 100.0 / 20.0).clamp(0.5, 1.5);
                let (mut mesh, across) = with_hole(shape, edge, share);
                if sigma > 0.0 { noisy(&mut mesh, shape, sigma, 7); }
                let old = mesh.triangles.len();
                let settings = Settings { kernel, ..Settings::default() };
                let begun = Instant::now();
                let filled = fill(mesh, &settings, &Unmonitored).unwrap();
                let time = begun.elapsed().as_secs_f64();
                let at = |v: u32| DVec3::from_array(filled.mesh.vertices_mm[v as usize]);
                let new = &filled.mesh.triangles[old..];
                let is_old: std::collections::HashSet<u32> = filled.mesh.triangles[..old].iter().flatten().copied().collect();
                let mut vertices: Vec<u32> = new.iter().flatten().copied().filter(|v| !is_old.contains(v)).collect();
                vertices.sort(); vertices.dedup();
                let offs: Vec<f64> = vertices.iter().map(|&v| shape.off(at(v)).0).collect();
                let rms = (offs.iter().map(|o| o*o).sum::<f64>() / offs.len().max(1) as f64).sqrt();
                let max = offs.iter().fold(0.0_f64, |m, o| m.max(o.abs()));
                let mut angle = 0.0_f64;
                for t in new {
                    if t.iter().filter(|v| is_old.contains(v)).count() < 2 { continue; }
                    let [a,b,c] = t.map(at);
                    let n = (b-a).cross(c-a).normalize();
                    let own = shape.off((a+b+c)/3.0).1;
                    angle = angle.max(n.dot(own).clamp(-1.0,1.0).acos().to_degrees());
                }
                let told = filled.holes.iter().find(|h| !matches!(h.outcome, Outcome::Border)).map(|h| match &h.outcome {
                    Outcome::Filled { kernel, points, centres, noise_mm, .. } => format!("{kernel:?} {points} {centres} noise {noise_mm:.5}"),
                    other => format!("{other:?}"),
                });
                println!("{shape:?} {share} new {} rms {:.5} % ({:.5} mm) max {:.5} % angle {angle:.2} time {time:.2} open {:?} {}", vertices.len(), 100.0*rms/across, rms, 100.0*max/across, filled.open(), told.unwrap_or_default());
            }
        }
    }
}
