//! A face for every cell and every step between cells.

use std::collections::BTreeMap;

use super::{Edge, Face, Key, MEET_MM, Path, Shell, Use, Vertex};
use crate::arrange::Torn;
use crate::field::Field;
use crate::height::Height;

/// Places along an edge at which both sides are compared.
const ALONG: usize = 16;

struct Raising<'a> {
    field: &'a Field,
    heights: &'a [Height],
    shell: Shell,
    /// By vertex of the plan: heights at which something meets, ascending, and their vertices.
    levels: Vec<Vec<(f64, Option<usize>)>>,
    uprights: BTreeMap<(usize, usize), usize>,
    /// By edge of the plan: edges at the heights of its left and right, and at the bottom.
    over: Vec<[Option<usize>; 3]>,
}

/// Faces that share their edges; none is joined yet.
pub(super) fn raise(field: &Field, heights: &[Height]) -> Result<Shell, Torn> {
    let plan = &field.plan;
    let mut raising = Raising {
        field,
        heights,
        shell: Shell::default(),
        levels: levels(field, heights),
        uprights: BTreeMap::new(),
        over: vec![[None; 3]; plan.edges.len()],
    };
    for edge in 0..plan.edges.len() {
        raising.step(edge)?;
    }
    for cell in 1..plan.cells.len() {
        if field.surface[cell] != 0 {
            raising.cover(cell);
        }
    }
    let mut shell = raising.shell;
    shell.parent = (0..shell.faces.len()).collect();
    shell.of_edge = vec![Vec::new(); shell.edges.len()];
    for (index, of) in shell.uses.iter().enumerate() {
        shell.of_edge[of.edge].push(index);
    }
    for (edge, uses) in shell.of_edge.iter().enumerate() {
        let senses: Vec<bool> = uses.iter().map(|&of| shell.uses[of].forward).collect();
        if senses.len() != 2 || senses[0] == senses[1] {
            let vertex = shell.vertices[shell.edges[edge].ends[0]].plan;
            return Err(Torn {
                at: plan.vertices[vertex],
            });
        }
    }
    Ok(shell)
}

/// The heights at which something meets at each vertex.
fn levels(field: &Field, heights: &[Height]) -> Vec<Vec<(f64, Option<usize>)>> {
    let plan = &field.plan;
    let of = |vertex: usize| {
        let at = plan.vertices[vertex];
        let mut surfaces: Vec<usize> = plan.around[vertex]
            .iter()
            .map(|&half| field.surface[plan.left(half)])
            .chain([0])
            .collect();
        surfaces.sort_unstable();
        surfaces.dedup();
        // Levels first: they are exact.
        let (flat, others): (Vec<usize>, Vec<usize>) = surfaces
            .into_iter()
            .partition(|&s| matches!(heights[s], Height::Level { .. }));
        let mut zs: Vec<f64> = Vec::new();
        for surface in flat.into_iter().chain(others) {
            let z = heights[surface].at(at);
            if zs.iter().all(|other| (other - z).abs() > MEET_MM) {
                zs.push(z);
            }
        }
        zs.sort_by(f64::total_cmp);
        zs.into_iter().map(|z| (z, None)).collect()
    };
    (0..plan.vertices.len()).map(of).collect()
}

impl Raising<'_> {
    fn rank(&self, vertex: usize, surface: usize) -> usize {
        let z = self.heights[surface].at(self.field.plan.vertices[vertex]);
        let levels = self.levels[vertex].iter().enumerate();
        let nearest = levels.min_by(|a, b| (a.1.0 - z).abs().total_cmp(&(b.1.0 - z).abs()));
        nearest.map_or(0, |(rank, _)| rank)
    }

    fn vertex(&mut self, plan: usize, rank: usize) -> usize {
        let (z, known) = self.levels[plan][rank];
        known.unwrap_or_else(|| {
            self.shell.vertices.push(Vertex { plan, z });
            let index = self.shell.vertices.len() - 1;
            self.levels[plan][rank].1 = Some(index);
            index
        })
    }

    fn edge(&mut self, path: Path, ends: [usize; 2]) -> usize {
        self.shell.edges.push(Edge {
            path,
            ends,
            is_alive: true,
        });
        self.shell.edges.len() - 1
    }

    fn upright(&mut self, plan: usize, rank: usize) -> usize {
        if let Some(&known) = self.uprights.get(&(plan, rank)) {
            return known;
        }
        let ends = [self.vertex(plan, rank), self.vertex(plan, rank + 1)];
        let edge = self.edge(Path::Upright { vertex: plan }, ends);
        self.uprights.insert((plan, rank), edge);
        edge
    }

    /// The edge over an edge of the plan at the height of a surface.
    fn run(&mut self, edge: usize, heights: [usize; 2]) -> usize {
        let of = &self.field.plan.edges[edge];
        let (ends, is_seam) = (of.ends, of.is_seam);
        let path = Path::Over {
            support: of.support,
            from: of.from,
            to: of.to,
            heights,
            is_seam,
        };
        let ends = ends.map(|end| {
            let rank = self.rank(end, heights[0]);
            self.vertex(end, rank)
        });
        self.edge(path, ends)
    }

    fn add(&mut self, face: usize, halves: &[(usize, bool)]) {
        let (first, count) = (self.shell.uses.len(), halves.len());
        for (k, &(edge, forward)) in halves.iter().enumerate() {
            self.shell.uses.push(Use {
                edge,
                forward,
                face,
                next: first + (k + 1) % count,
                before: first + (k + count - 1) % count,
            });
        }
    }

    fn face(&mut self, key: Key, source: usize) -> usize {
        self.shell.faces.push(Face { key, source });
        self.shell.faces.len() - 1
    }

    /// The edges over an edge of the plan, and the wall between them.
    fn step(&mut self, edge: usize) -> Result<(), Torn> {
        let plan = &self.field.plan;
        let of = &plan.edges[edge];
        let [start, end] = of.ends;
        let [a, b] = of.cells.map(|cell| self.field.surface[cell]);
        if a == 0 && b == 0 {
            return Ok(());
        }
        let torn = Torn {
            at: plan.on_edge(edge, 0.5),
        };
        let support = of.support;
        let by = (0..=ALONG).map(|k| {
            let at = plan.on_edge(edge, k as f64 / ALONG as f64);
            self.heights[a].at(at) - self.heights[b].at(at)
        });
        let (mut least, mut most) = (0.0_f64, 0.0_f64);
        by.for_each(|by| {
            least = least.min(by);
            most = most.max(by);
        });
        if a != 0 && b != 0 {
            self.over[edge][2] = Some(self.run(edge, [0, 0]));
        }
        let ranks = [start, end].map(|v| [self.rank(v, a), self.rank(v, b)]);
        if most - least <= 2.0 * MEET_MM {
            if ranks.iter().any(|[a, b]| a != b) {
                return Err(torn);
            }
            let shared = self.run(edge, [a, b]);
            self.over[edge][0] = Some(shared);
            self.over[edge][1] = Some(shared);
            return Ok(());
        }
        let is_left_higher = most > MEET_MM;
        if is_left_higher && least < -MEET_MM {
            return Err(torn);
        }
        let sides = [self.run(edge, [a, a]), self.run(edge, [b, b])];
        self.over[edge][0] = Some(sides[0]);
        self.over[edge][1] = Some(sides[1]);
        let (upper, lower) = if is_left_higher { (0, 1) } else { (1, 0) };
        if ranks.iter().any(|ranks| ranks[lower] > ranks[upper]) {
            return Err(torn);
        }
        // Seen from where there is none, the material behind: counter-clockwise.
        let (near, far) = if is_left_higher { (1, 0) } else { (0, 1) };
        let vertices = [start, end];
        let mut halves = vec![(sides[lower], is_left_higher)];
        for rank in ranks[near][lower]..ranks[near][upper] {
            halves.push((self.upright(vertices[near], rank), true));
        }
        halves.push((sides[upper], !is_left_higher));
        for rank in (ranks[far][lower]..ranks[far][upper]).rev() {
            halves.push((self.upright(vertices[far], rank), false));
        }
        let key = Key::Wall {
            support,
            material_left: is_left_higher,
        };
        let face = self.face(key, edge);
        self.add(face, &halves);
        Ok(())
    }

    /// Top and bottom of a cell.
    fn cover(&mut self, cell: usize) {
        let top = self.face(Key::Top(self.field.surface[cell]), cell);
        let bottom = self.face(Key::Bottom, cell);
        for halves in &self.field.plan.cells[cell].loops {
            let above: Vec<(usize, bool)> = halves
                .iter()
                .filter_map(|half| {
                    let side = usize::from(!half.forward);
                    Some((self.over[half.edge][side]?, half.forward))
                })
                .collect();
            self.add(top, &above);
            let below: Vec<(usize, bool)> = halves
                .iter()
                .rev()
                .filter_map(|half| {
                    let other = usize::from(half.forward);
                    let over = self.over[half.edge];
                    Some((over[2].or(over[other])?, !half.forward))
                })
                .collect();
            self.add(bottom, &below);
        }
    }
}
