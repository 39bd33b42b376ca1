//! The whole road from regions to the model.

use nurbs::{Observation, PatchSurface};
use range_image::{Monitor, RangeImage, RegionMap};
use rayon::prelude::*;
use shapes::Form;

use crate::accept::is_as_good;
use crate::account::{Freedom, residuals, tally};
use crate::assemble::{Carrier, Placement, domains, kinds, model, steps};
use crate::border::closeness::levels;
use crate::border::cracks::trace;
use crate::border::intersection::intersections;
use crate::border::map::{BorderSettings, PlanarMap, build};
use crate::border::settle::{Outlines, Placed};
use crate::border::split::split;
use crate::evidence::{Evidence, Known};
use crate::fit::{Demand, Domain, FitError, patches_from_spline, patches_through_nodes};
use crate::known;
use crate::meeting::part;
use crate::metrics::{Metrics, compare, psnr_db};
use crate::model::{EdgeOrigin, Model, Surface};
use crate::noise::ImageNoise;
use crate::origins::met;
use crate::pieces::{PieceLimits, PieceMap, names};
use crate::settings::{Method, ReconstructError, ReconstructSettings};
use crate::trim::Trim;

/// A model and how well it agrees with what was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Reconstruction {
    /// The trimmed faces.
    pub model: Model,
    /// z of the trimmed faces at the nodes of the range image; masked outside all faces.
    pub restored: RangeImage,
    /// Which face that is, counted from 1, column by column as [`RangeImage::raw_z_mm`]; 0
    /// outside all faces.
    pub face_at: Vec<u32>,
    /// How each region that gave a face was met, in the order of labels.
    pub regions: Vec<RegionFit>,
    /// The restored image against the range image.
    pub metrics: Metrics,
    /// Holes filled, and the nodes in them.
    pub filled_holes: (usize, usize),
    /// Borders that had to be drawn with less smoothing than the others.
    pub unsmoothed_borders: usize,
    /// What a user should know.
    pub warnings: Vec<String>,
}

/// How the surfaces of a region agree with its nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct RegionFit {
    /// The region.
    pub label: u16,
    /// Nodes the surfaces were fitted to.
    pub nodes: usize,
    /// Faces made of it.
    pub faces: usize,
    /// Patches of its surfaces, in all.
    pub patches: usize,
    /// Numbers that its surfaces were given by what was measured: those of the shape, or the
    /// coefficients of the splines that were free to follow the nodes.
    pub parameters: usize,
    /// Independent values among the nodes, about.
    pub independent: usize,
    /// Area of its trimmed faces on the surface, square millimetres.
    pub area_mm2: f64,
    /// Root mean square residual in z, millimetres.
    pub rms_mm: f64,
    /// Greatest residual in z, millimetres.
    pub max_mm: f64,
    /// Peak signal-to-noise ratio as in Table 1 of the paper, decibels.
    pub psnr_db: f64,
}

/// Margin of a surface around the nodes of its region, pitches: half of one to the
/// border, and what smoothing may do.
pub(crate) const SURFACE_MARGIN: f64 = 3.0;

/// How far from the nodes of its region a surface is what the nodes make of it, pitches; beyond that
/// it keeps near the part as well. Borders and their vertices seldom go farther.
pub(crate) const FAR: f64 = 2.0;

/// Narrowest span of a fitted spline, pitches: halving brings spans as near to two pitches as it
/// can.
const LEAST_SPAN: f64 = core::f64::consts::SQRT_2;

/// A node with its place and height in millimetres.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Node {
    pub(crate) column: usize,
    pub(crate) row: usize,
    pub(crate) z_mm: f64,
}

/// Makes a model of trimmed faces from the regions of a range image, all of them free-form.
///
/// # Errors
/// As [`Fitted::of`] and [`Fitted::reconstruct`].
pub fn reconstruct(
    image: &RangeImage,
    map: &RegionMap,
    settings: &ReconstructSettings,
    monitor: &dyn Monitor,
) -> Result<Reconstruction, ReconstructError> {
    Fitted::of(image, map, settings, monitor)?.reconstruct(Evidence::default(), monitor)
}

/// Regions with a free-form surface each, the first half of the road: what kinds of surface they
/// are can be found out meanwhile.
pub struct Fitted<'a> {
    image: &'a RangeImage,
    map: &'a RegionMap,
    settings: &'a ReconstructSettings,
    pieces: PieceMap,
    /// Of each piece.
    nodes: Vec<Vec<Node>>,
    noise: ImageNoise,
    /// Of each piece; by the letter of the paper none yet, since there the border comes first,
    /// and the surface covers it.
    surfaces: Vec<PatchSurface>,
    /// Of each of these, as [`RegionFit::parameters`].
    parameters: Vec<usize>,
    /// How closely borders are to follow each node; of none where there are no numbers.
    closeness: Vec<u8>,
}

impl<'a> Fitted<'a> {
    /// Fits a surface to each piece of a region.
    ///
    /// # Errors
    /// [`ReconstructError`] when a setting is out of range, the map does not belong to the
    /// image, no region can become a face, or the caller cancels.
    pub fn of(
        image: &'a RangeImage,
        map: &'a RegionMap,
        settings: &'a ReconstructSettings,
        monitor: &dyn Monitor,
    ) -> Result<Self, ReconstructError> {
        let mut all = Self::unfitted(image, map, settings, monitor)?;
        if settings.method == Method::Relief {
            let fitted = (0..all.nodes.len()).into_par_iter().map(|piece| {
                monitor.check()?;
                let domain = around(image, &all.nodes[piece]);
                all.free_form(piece, domain)
            });
            // Of several errors the first, as without threads.
            let fitted: Vec<Result<_, ReconstructError>> = fitted.collect();
            let fitted: Vec<_> = fitted.into_iter().collect::<Result<_, _>>()?;
            (all.surfaces, all.parameters) = fitted.into_iter().unzip();
        }
        monitor.progress(0.3);
        Ok(all)
    }

    /// Takes surfaces that are there already, of each region by label from 1 on, with the numbers that
    /// each was given. They are to reach three pitches beyond the nodes of their region, so that
    /// borders stay on them; where a border does not, a free-form surface comes in their place.
    ///
    /// # Errors
    /// As [`Self::of`], and [`ReconstructError::Surfaces`] when there are not as many as regions.
    pub fn given(
        image: &'a RangeImage,
        map: &'a RegionMap,
        surfaces: &[(PatchSurface, usize)],
        settings: &'a ReconstructSettings,
        monitor: &dyn Monitor,
    ) -> Result<Self, ReconstructError> {
        if surfaces.len() != usize::from(map.regions()) {
            return Err(ReconstructError::Surfaces {
                regions: usize::from(map.regions()),
                surfaces: surfaces.len(),
            });
        }
        let mut all = Self::unfitted(image, map, settings, monitor)?;
        let of_pieces = all.pieces.regions.iter();
        let own = of_pieces.filter_map(|region| surfaces.get(usize::from(*region) - 1).cloned());
        (all.surfaces, all.parameters) = own.unzip();
        monitor.progress(0.3);
        Ok(all)
    }

    /// The pieces, without surfaces.
    fn unfitted(
        image: &'a RangeImage,
        map: &'a RegionMap,
        settings: &'a ReconstructSettings,
        monitor: &dyn Monitor,
    ) -> Result<Self, ReconstructError> {
        settings.validate()?;
        check_input(image, map)?;
        let limits = PieceLimits {
            min_nodes: settings.min_piece_nodes,
            min_hole_nodes: settings.min_hole_nodes,
        };
        let pieces = PieceMap::new(map, limits);
        if pieces.regions.is_empty() {
            return Err(ReconstructError::NoFaces {
                regions: usize::from(map.regions()),
                min_nodes: settings.min_piece_nodes,
            });
        }
        monitor.check()?;
        Ok(Self {
            nodes: nodes_of(image, map, &pieces),
            noise: ImageNoise::of(image),
            surfaces: Vec::new(),
            parameters: Vec::new(),
            image,
            map,
            settings,
            pieces,
            closeness: Vec::new(),
        })
    }

    /// Has the borders near some nodes follow the nodes more closely than they need be smooth:
    /// `closeness` is by node, column by column, 0 where nothing is asked, up to 3 where they run in
    /// the middle between nodes, as a line of short straight pieces. A border is drawn in one way
    /// throughout.
    #[must_use]
    pub fn closely(mut self, closeness: Vec<u8>) -> Self {
        self.closeness = closeness;
        self
    }

    /// Draws the borders, and makes the model. Regions of which a form is known get that in
    /// place of the free-form surface, where their nodes are met by it as well, and outlines run
    /// where the samples beside them say.
    ///
    /// # Errors
    /// [`ReconstructError`] when a surface cannot be fitted, or the caller cancels.
    pub fn reconstruct(
        mut self,
        evidence: Evidence<'_>,
        monitor: &dyn Monitor,
    ) -> Result<Reconstruction, ReconstructError> {
        let (image, settings) = (self.image, self.settings);
        let forms = self.take_over(evidence.forms, monitor)?;
        let borders = BorderSettings {
            literal: settings.method == Method::ShimLee,
            corner_cosine: libm::cos(settings.corner_angle_rad),
            piece_price: settings.piece_price_pitch2,
            bound: settings.border_bound_pitches,
        };
        let placement = Placement::of(image);
        let mut cracks = trace(&self.pieces);
        let fitted = self.surfaces.iter().zip(&self.nodes);
        let sides: Vec<(&PatchSurface, f64)> = fitted
            .map(|(surface, nodes)| (surface, residuals(image, nodes, surface).0))
            .collect();
        if settings.method == Method::Relief {
            split(&mut cracks, &sides, placement);
        }
        let placed = intersections(&cracks, &sides, placement);
        monitor.progress(0.4);
        let outlines = Outlines {
            steps: steps(&cracks, &placed, &sides, placement),
            samples: evidence
                .outline_samples
                .iter()
                .map(|sample| Placed {
                    region: sample.region,
                    place: placement.to_pitches(sample.place_mm),
                    seen: sample.seen,
                })
                .collect(),
            regions: self.pieces.regions.clone(),
            levels: levels(
                &cracks.chains,
                &self.closeness,
                (image.columns(), image.rows()),
            ),
        };
        let mut planar = build(&cracks, &placed, &outlines, &borders, monitor)?;

        let names = names(&self.pieces.regions);
        let mut carriers = Vec::with_capacity(self.nodes.len());
        let mut fits: Vec<RegionFit> = Vec::new();
        for (k, domain) in domains(&planar, placement).into_iter().enumerate() {
            monitor.check()?;
            let (surface, form, parameters) = self.surface(k, domain, forms[k].as_ref())?;
            let region = self.pieces.regions[k];
            let freedom = Freedom {
                parameters,
                // Pieces of one form have its numbers in common.
                is_shared: form.is_some(),
                independent: self.noise.independent(self.nodes[k].len()),
            };
            let rms_mm = tally(
                &mut fits,
                region,
                image,
                &self.nodes[k],
                (&surface, freedom),
            );
            carriers.push(Carrier {
                region,
                name: names[k].clone(),
                surface,
                form,
                rms_mm,
            });
            monitor.progress(0.4 + 0.4 * (k + 1) as f64 / self.nodes.len() as f64);
        }
        for fit in &mut fits {
            fit.psnr_db = psnr_db(fit.rms_mm);
        }
        if settings.method == Method::Relief {
            let surfaces: Vec<&PatchSurface> = carriers.iter().map(|own| &own.surface).collect();
            part(&mut planar, &surfaces, placement);
        }
        let (kinds, origins) = if settings.method == Method::Relief {
            met(&mut planar, &carriers, placement, monitor)?
        } else {
            let kinds = kinds(&planar, &carriers, placement);
            let origins = vec![EdgeOrigin::Assumed; kinds.len()];
            (kinds, origins)
        };
        let model = model(&planar, carriers, (&kinds, &origins), placement);
        monitor.check()?;
        let (restored, face_at) = restore(image, &model, placement, &mut fits);
        monitor.progress(1.0);
        Ok(Reconstruction {
            metrics: compare(image, &restored),
            warnings: warnings(&self.pieces, &planar, self.map),
            model,
            restored,
            face_at,
            regions: fits,
            filled_holes: (self.pieces.filled_holes, self.pieces.filled_nodes),
            unsmoothed_borders: planar.unsmoothed,
        })
    }

    /// Puts forms in the place of free-form surfaces; gives those taken, of each piece. A region
    /// is of its form with all its pieces, or with none.
    fn take_over(
        &mut self,
        forms: &[Option<Known>],
        monitor: &dyn Monitor,
    ) -> Result<Vec<Option<Known>>, ReconstructError> {
        let of_piece = |piece: usize| -> Option<(Known, PatchSurface)> {
            let free = self.surfaces.get(piece)?;
            let label = usize::from(self.pieces.regions[piece]);
            let known = forms.get(label - 1)?.as_ref()?;
            let surface = self.known(piece, &known.form, None)?;
            let nodes = &self.nodes[piece];
            is_as_good(self.image, nodes, &surface, free).then(|| (known.clone(), surface))
        };
        let found = (0..self.nodes.len()).into_par_iter().map(|piece| {
            monitor.check()?;
            Ok(of_piece(piece))
        });
        let found: Vec<Result<_, ReconstructError>> = found.collect();
        let found: Vec<_> = found.into_iter().collect::<Result<_, _>>()?;
        let regions = self.pieces.regions.clone();
        let holds = |piece: usize| {
            let of_region = regions.iter().zip(&found);
            let mut pieces = of_region.filter(|(region, _)| **region == regions[piece]);
            pieces.all(|(_, found)| found.is_some())
        };
        let whole: Vec<bool> = (0..found.len()).map(holds).collect();
        let mut taken = vec![None; found.len()];
        for (piece, found) in found.into_iter().enumerate() {
            if let Some((known, surface)) = found.filter(|_| whole[piece]) {
                self.surfaces[piece] = surface;
                self.parameters[piece] = known.freedom;
                taken[piece] = Some(known);
            }
        }
        Ok(taken)
    }

    /// The surface of a piece over the domain that its border asks for, the form that it is, and
    /// the numbers that it was given.
    fn surface(
        &self,
        piece: usize,
        domain: Option<Domain>,
        known: Option<&Known>,
    ) -> Result<(PatchSurface, Option<Form>, usize), ReconstructError> {
        let form = || known.map(|known| known.form.clone());
        let fits = |surface: &&PatchSurface| domain.is_some_and(|domain| domain.is_within(surface));
        if let Some(surface) = self.surfaces.get(piece).filter(fits) {
            return Ok((surface.clone(), form(), self.parameters[piece]));
        }
        if let Some(known) = known
            && let Some(surface) = self.known(piece, &known.form, domain)
        {
            return Ok((surface, form(), known.freedom));
        }
        let (surface, parameters) = self.free_form(piece, domain)?;
        Ok((surface, None, parameters))
    }

    /// Patches of a form over the nodes of a piece, and over a domain besides.
    fn known(&self, piece: usize, form: &Form, besides: Option<Domain>) -> Option<PatchSurface> {
        let (image, nodes) = (self.image, &self.nodes[piece]);
        let own = around(image, nodes)?;
        let domain = besides.map_or(own, |besides| own.with(&besides));
        let most_spans = self.settings.knots_per_side - 1;
        known::patches(form, image, nodes, &domain, most_spans)
    }

    /// A free-form surface of a piece over a domain, and the numbers that it was given.
    fn free_form(
        &self,
        piece: usize,
        domain: Option<Domain>,
    ) -> Result<(PatchSurface, usize), ReconstructError> {
        let fitted = domain.ok_or(FitError::Empty).and_then(|domain| {
            let nodes = &self.nodes[piece];
            surface(self.image, nodes, &domain, &self.noise, self.settings)
        });
        fitted.map_err(|e| ReconstructError::Fit {
            label: self.pieces.regions[piece],
            reason: e.to_string(),
        })
    }
}

fn check_input(image: &RangeImage, map: &RegionMap) -> Result<(), ReconstructError> {
    let (columns, rows) = (image.columns(), image.rows());
    if (map.columns(), map.rows()) != (columns, rows) {
        return Err(ReconstructError::SizeMismatch {
            columns,
            rows,
            map_columns: map.columns(),
            map_rows: map.rows(),
        });
    }
    let masked = map
        .raw_labels()
        .iter()
        .zip(image.raw_z_mm())
        .position(|(&label, z)| label != 0 && !z.is_finite());
    if let Some(k) = masked {
        let (column, row) = (k / rows, k % rows);
        let label = map.label(column, row);
        return Err(ReconstructError::MaskedNode { column, row, label });
    }
    if map.regions() == 0 {
        return Err(ReconstructError::NoRegions);
    }
    Ok(())
}

/// The nodes each piece is fitted to: those that segmentation gave to its region.
fn nodes_of(image: &RangeImage, map: &RegionMap, pieces: &PieceMap) -> Vec<Vec<Node>> {
    let rows = image.rows();
    let mut nodes = vec![Vec::new(); pieces.regions.len()];
    for (k, (&piece, &label)) in pieces.labels().iter().zip(map.raw_labels()).enumerate() {
        let Some(of_piece) = (piece as usize).checked_sub(1) else {
            continue;
        };
        if pieces.regions[of_piece] == label {
            let (column, row, z_mm) = (k / rows, k % rows, image.raw_z_mm()[k]);
            nodes[of_piece].push(Node { column, row, z_mm });
        }
    }
    nodes
}

/// A rectangle that holds the nodes and as good as any border that may be drawn around
/// them. `None` without nodes.
fn around(image: &RangeImage, nodes: &[Node]) -> Option<Domain> {
    let margin_mm = SURFACE_MARGIN * image.pitch_mm();
    let extent = |places: &mut dyn Iterator<Item = f64>| {
        places.fold(None, |extent: Option<(f64, f64)>, p| {
            let (low, high) = extent.unwrap_or((p, p));
            Some((low.min(p), high.max(p)))
        })
    };
    let widened = |(low, high): (f64, f64)| (low - margin_mm, high + margin_mm);
    Some(Domain {
        x_mm: widened(extent(&mut nodes.iter().map(|n| image.x_mm(n.column)))?),
        y_mm: widened(extent(&mut nodes.iter().map(|n| image.y_mm(n.row)))?),
    })
}

fn surface(
    image: &RangeImage,
    nodes: &[Node],
    domain: &Domain,
    noise: &ImageNoise,
    settings: &ReconstructSettings,
) -> Result<(PatchSurface, usize), FitError> {
    match settings.method {
        Method::Relief => {
            let mut observations: Vec<Observation> = nodes
                .iter()
                .map(|n| Observation {
                    u: image.x_mm(n.column),
                    v: image.y_mm(n.row),
                    value: n.z_mm,
                    weight: 1.0,
                })
                .collect();
            let qualities = nodes.iter().filter_map(|n| image.quality(n.column, n.row));
            let demand = Demand {
                tolerance_mm: settings.tolerance_mm,
                noise_density_mm2: noise.density_mm2(qualities),
                least_span_mm: LEAST_SPAN * image.pitch_mm(),
                most_spans: settings.knots_per_side - 1,
                margin_mm: FAR * image.pitch_mm(),
            };
            patches_from_spline(&mut observations, domain, &demand)
        }
        Method::ShimLee => {
            let mut member = vec![false; image.raw_z_mm().len()];
            for n in nodes {
                member[n.column * image.rows() + n.row] = true;
            }
            let member = |column: usize, row: usize| {
                column < image.columns() && member[column * image.rows() + row]
            };
            patches_through_nodes(image, member, domain, settings.patch_third_nodes)
        }
    }
}

/// z of the trimmed faces at the nodes of the image, and which face that is; their areas go to
/// the account.
fn restore(
    image: &RangeImage,
    model: &Model,
    placement: Placement,
    fits: &mut [RegionFit],
) -> (RangeImage, Vec<u32>) {
    let pitch_mm = image.pitch_mm();
    let (x_mm, y_mm) = (image.x_mm(0), image.y_mm(0));
    let mut restored = image.masked_like();
    let mut face_at = vec![0; image.raw_z_mm().len()];
    for (face, number) in model.faces.iter().zip(1..) {
        let Surface::Patches(surface) = &face.surface;
        let loops = core::iter::once(&face.outer).chain(&face.inner);
        let curves = loops.map(|l| l.coedges.iter().map(|c| &c.parameter_curve));
        let trim = Trim::new(curves, image.pitch_mm(), |p| placement.to_pitches(p));
        trim.nodes(image.columns(), image.rows(), |column, row| {
            let z = surface.z(image.x_mm(column), image.y_mm(row));
            restored.set_z_mm(column, row, Some(z));
            face_at[column * image.rows() + row] = number;
        });
        let area = trim.area(image.columns(), |column, row| {
            let at = (x_mm + column * pitch_mm, y_mm + row * pitch_mm);
            let [p, q] = [(1, 0), (0, 1)].map(|(u, v)| surface.z_partial(at.0, at.1, u, v));
            libm::sqrt(1.0 + p * p + q * q)
        });
        if let Some(fit) = fits.iter_mut().find(|fit| fit.label == face.region) {
            fit.area_mm2 += area * pitch_mm * pitch_mm;
        }
    }
    (restored, face_at)
}

fn warnings(pieces: &PieceMap, planar: &PlanarMap, map: &RegionMap) -> Vec<String> {
    let mut warnings = Vec::new();
    let counts = map.node_counts();
    let mut specks = (0, 0);
    for rejected in &pieces.rejected {
        let whole = counts[usize::from(rejected.region) - 1] == rejected.nodes;
        if !whole {
            specks = (specks.0 + 1, specks.1 + rejected.nodes);
        } else if rejected.thin {
            warnings.push(format!(
                "region {} is too thin for a face: its {} nodes are nowhere two wide both ways",
                rejected.region, rejected.nodes
            ));
        } else {
            warnings.push(format!(
                "region {} is too small for a face: {} nodes",
                rejected.region, rejected.nodes
            ));
        }
    }
    if specks.0 > 0 {
        warnings.push(format!(
            "{} specks apart from their regions, {} nodes in all, were left out",
            specks.0, specks.1
        ));
    }
    if pieces.filled_holes > 0 {
        warnings.push(format!(
            "{} small holes were filled, {} nodes in all",
            pieces.filled_holes, pieces.filled_nodes
        ));
    }
    if planar.unsmoothed > 0 {
        warnings.push(format!(
            "{} of {} borders are drawn with less smoothing, because they are too ragged or too \
             close to others",
            planar.unsmoothed, planar.borders
        ));
    }
    warnings
}
