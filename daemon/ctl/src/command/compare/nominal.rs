//! Triangles of a part from its file: the nominal of a comparison, or a model to be milled.

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

use cad_exchange::step;
use compare::{FACETS_MAX, Nominal, NominalError};
use solids::FacetSettings;

use crate::failure::Failure;

/// By so many bytes it is told what a file is.
const HEAD_BYTES: u64 = 84;
/// How a STEP file begins, and how far triangles may lie from its surfaces: a hundredth of what the
/// finest scanners tell.
const STEP: &[u8] = b"ISO-10303-21";
const CHORD_MM: f64 = 0.001;
/// Coarsest that they may be where there would be too many, and how much coarser at a time.
const COARSEST_MM: f64 = 0.02;
const COARSER: f64 = 3.0;
/// Longest file: twice as long as the longest text with the most facets.
const MOST_BYTES: u64 = 1 << 30;

/// Reads the nominal from a STEP file, which has its own unit, or from an STL file, text or binary,
/// whose lengths are of `unit_mm`, millimetres where that is not said.
pub(super) fn read(path: &Path, unit_mm: Option<f64>) -> Result<Nominal, Failure> {
    let name = path.display();
    let (vertices, facets) = triangles(path, unit_mm, ("a nominal", "STEP and STL"))?;
    Nominal::new(&vertices, &facets).map_err(|error| match error {
        NominalError::Empty => Failure::Failed(format!("{name}: holds no facet")),
        other => Failure::Failed(format!("{name}: {other}")),
    })
}

/// Vertices, millimetres, and triangles of such a file; `role` is what it is read as, in messages.
pub(crate) fn triangles(
    path: &Path,
    unit_mm: Option<f64>,
    (role, formats): (&str, &str),
) -> Result<Indexed, Failure> {
    let name = path.display().to_string();
    let failed = |why: &str| Failure::Failed(format!("{name}: {why}"));
    if path.is_dir() {
        return Err(failed("is a directory; name a STEP or STL file in it"));
    }
    let cannot = |error| Failure::at(format!("cannot read {name}"), &error);
    let file = File::open(path).map_err(cannot)?;
    let bytes = file.metadata().map_err(cannot)?.len();
    let mut source = BufReader::new(file);
    let mut head = Vec::new();
    source
        .by_ref()
        .take(HEAD_BYTES)
        .read_to_end(&mut head)
        .map_err(cannot)?;
    if bytes > MOST_BYTES {
        return Err(failed(
            "is longer than 1 GiB, the most that is read: decimate the mesh first",
        ));
    }
    if head.is_empty() {
        return Err(failed("is empty"));
    }
    if head.trim_ascii_start().starts_with(STEP) {
        if unit_mm.is_some() {
            return Err(failed(
                "is a STEP file, which says in what unit it is: leave out --nominal-units",
            ));
        }
        source.rewind().map_err(cannot)?;
        return of_solids(&mut source).map_err(|why| failed(&why));
    }
    if let Some(format) = other_format(&head) {
        return Err(failed(&format!(
            "is {format}, which is not read as {role}; only {formats} are: export the model as \
             STEP, or as STL with a chord error well below the tolerance"
        )));
    }
    let unit_mm = unit_mm.unwrap_or(1.0);
    source.rewind().map_err(cannot)?;
    let read = mesh_files::read_stl(&mut source, bytes, FACETS_MAX)
        .map_err(|error| failed(&error.to_string()))?;
    let vertices = read.vertices.iter().map(|p| p.map(|c| c * unit_mm));
    let facets = read.triangles.iter().map(|t| t.map(|v| v as usize));
    Ok((vertices.collect(), facets.collect()))
}

/// The faces of a STEP file.
fn of_solids(source: &mut impl Read) -> Result<Indexed, String> {
    let body = step::read_body(source).map_err(|error| error.to_string())?;
    of_body(&body)
}

/// Triangles of faces, as fine as their number allows.
pub(crate) fn of_body(body: &solids::Body) -> Result<Indexed, String> {
    let mut tolerance_mm = CHORD_MM;
    let facets = loop {
        let settings = FacetSettings {
            tolerance_mm,
            most: FACETS_MAX,
        };
        match solids::facets(body, &settings) {
            Err(solids::BodyError::TooMany { .. }) if tolerance_mm < COARSEST_MM => {
                tolerance_mm = (COARSER * tolerance_mm).min(COARSEST_MM);
            }
            done => break done.map_err(|error| error.to_string())?,
        }
    };
    let points = facets.points_mm.iter().map(|p| [p.x, p.y, p.z]).collect();
    Ok((points, facets.triangles))
}

/// Vertices, and triangles by their indices.
pub(crate) type Indexed = (Vec<[f64; 3]>, Vec<[usize; 3]>);

/// What a file is that is no STL.
/// Whether a file is an IGES file, by its first line.
pub(crate) fn is_iges(path: &Path) -> bool {
    let mut head = Vec::new();
    let read = File::open(path).and_then(|file| file.take(80).read_to_end(&mut head));
    read.is_ok() && begins_iges(&head)
}

fn begins_iges(head: &[u8]) -> bool {
    head.get(72) == Some(&b'S') && head.get(73..80).is_some_and(is_number)
}

fn other_format(head: &[u8]) -> Option<&'static str> {
    let text = head.trim_ascii_start();
    let is_iges = begins_iges(head);
    let known: [(&[u8], &str); 6] = [
        (b"ply", "a PLY file"),
        (b"PK\x03\x04", "a ZIP archive or 3MF file"),
        (b"\x1f\x8b", "compressed with gzip"),
        (b"v ", "a Wavefront OBJ file"),
        (b"# ", "a text file, perhaps Wavefront OBJ"),
        (b"OFF", "an OFF file"),
    ];
    let found = known.iter().find(|(start, _)| text.starts_with(start));
    found
        .map(|(_, format)| *format)
        .or(is_iges.then_some("an IGES file"))
}

fn is_number(text: &[u8]) -> bool {
    let digits = text.trim_ascii();
    !digits.is_empty() && digits.iter().all(u8::is_ascii_digit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write as _;

    fn told(content: &[u8]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("part.stl");
        std::fs::write(&path, content).unwrap();
        match read(&path, None) {
            Ok(nominal) => format!(
                "{} facets; {}",
                nominal.facets(),
                nominal.remarks().join("; ")
            ),
            Err(failure) => failure.to_string().split_once(": ").unwrap().1.to_owned(),
        }
    }

    fn text(facets: &[[[f64; 3]; 3]]) -> Vec<u8> {
        let mut text = "solid part\n".to_owned();
        for facet in facets {
            text.push_str("facet normal 0 0 0\nouter loop\n");
            for [x, y, z] in facet {
                writeln!(text, "vertex {x} {y} {z}").unwrap();
            }
            text.push_str("endloop\nendfacet\n");
        }
        text.push_str("endsolid part\n");
        text.into_bytes()
    }

    #[test]
    fn what_is_wrong_with_a_nominal_is_told() {
        let [a, b, c, d] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let square = text(&[[a, b, c], [a, c, d]]);
        assert!(
            told(&square).starts_with("2 facets; the mesh is open: 4 edges"),
            "{}",
            told(&square)
        );
        let nameless = String::from_utf8(square.clone()).unwrap();
        let nameless = nameless.replace("solid part", "solid");
        assert!(
            told(nameless.as_bytes()).starts_with("2 facets"),
            "{}",
            told(nameless.as_bytes())
        );
        let mut binary = b"solid by a program that writes binary files".to_vec();
        binary.resize(80, b' ');
        binary.extend(1_u32.to_le_bytes());
        binary.extend([0; 12]);
        for coordinate in [a, b, c].as_flattened() {
            binary.extend((*coordinate as f32).to_le_bytes());
        }
        binary.extend([0; 2]);
        assert!(told(&binary).starts_with("1 facets"), "{}", told(&binary));
        assert_eq!(told(b""), "is empty");
        assert!(told(b"solid x\nendsolid x\n").contains("holds no facet"));
        assert!(told(&text(&[[a, b, b]])).contains("none of its 1 facets has an area"));
        let flat = told(&text(&[[a, b, c], [a, c, d], [a, b, a]]));
        assert!(
            flat.contains("1 of 3 facets have no area and were left out, the first is number 3")
        );
        let turned = told(&text(&[[a, b, c], [a, d, c]]));
        assert!(
            turned.contains("disagree on which side is outside"),
            "{turned}"
        );
        assert!(turned.contains("(0.500, 0.500, 0.000) mm"), "{turned}");
        let endless = told(&text(&[[a, b, [f64::INFINITY; 3]]]));
        assert!(endless.contains("facet 1"), "{endless}");
        let cut = told(b"ISO-10303-21;\nHEADER;");
        assert!(cut.contains("line 2, column 8: "), "{cut}");
        assert!(cut.contains("it was cut off"), "{cut}");
        assert!(told(b"ply\nformat").contains("is a PLY file, which is not read as a nominal"));
        let mut binary = vec![0; 84];
        binary[80] = 3;
        assert!(told(&binary).contains("announces 3 facets, which take 234 bytes; there are 84"));
        assert!(told(b"x y z\n1 2 3\n").contains("is no STL file"));
        let broken = String::from_utf8(square)
            .unwrap()
            .replace("vertex 1 1 0", "vertex 1 one 0");
        assert!(
            told(broken.as_bytes()).contains("facet 1"),
            "{}",
            told(broken.as_bytes())
        );
    }
}
