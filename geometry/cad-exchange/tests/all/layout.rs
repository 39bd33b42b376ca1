//! The text of written files: columns, counts, pointers, and one file to the letter.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::sample;

use cad_exchange::iges::{self, Entities, Summary, WriteOptions};
use nurbs::{PatchSurface, PiecewiseCubic};
use reconstruct::{
    Coedge, Edge, EdgeId, EdgeKind, EdgeOrigin, Face, Loop, Model, Surface, Vertex, VertexId,
};

fn options(entities: Entities) -> WriteOptions {
    WriteOptions {
        entities,
        author: "A. Author".to_owned(),
        organization: "Relief".to_owned(),
        system: "Relief".to_owned(),
        ..WriteOptions::new("sample", "20261121.093000")
    }
}

fn written(model: &Model, options: &WriteOptions) -> (String, Summary) {
    let mut out = Vec::new();
    let summary = iges::write(model, options, &mut out).unwrap();
    assert_eq!(summary.bytes, out.len());
    (String::from_utf8(out).unwrap(), summary)
}

/// A flat square of 10 mm in the plane z = x / 2, one patch, straight sides.
fn square(name: &str) -> Model {
    let corners = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]];
    let surface = PatchSurface::new(
        vec![0.0, 10.0],
        vec![0.0, 10.0],
        vec![[[0.0, 0.5, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]]],
    )
    .unwrap();
    let mut edges = Vec::new();
    let mut coedges = Vec::new();
    for k in 0..4 {
        let (a, b): ([f64; 2], [f64; 2]) = (corners[k], corners[(k + 1) % 4]);
        let path = PiecewiseCubic::line(a, b, 10.0).unwrap();
        let lift = |p: [f64; 2]| [p[0], p[1], p[0] / 2.0];
        coedges.push(Coedge {
            edge: EdgeId(k),
            reversed: false,
            parameter_curve: path.clone(),
            space_curve: PiecewiseCubic::line(lift(a), lift(b), 10.0).unwrap(),
        });
        edges.push(Edge {
            start: VertexId(k),
            end: VertexId((k + 1) % 4),
            kind: EdgeKind::Silhouette,
            origin: EdgeOrigin::Assumed,
            path,
        });
    }
    Model {
        vertices: corners
            .iter()
            .map(|&[x_mm, y_mm]| Vertex { x_mm, y_mm })
            .collect(),
        edges,
        faces: vec![Face {
            name: name.to_owned(),
            region: 3,
            surface: Surface::Patches(surface),
            form: None,
            outer: Loop { coedges },
            inner: Vec::new(),
        }],
    }
}

/// Fixed files: a difference means that files change for everybody who reads them. Run
/// with `UPDATE_GOLDEN=1` once the change is wanted, and judge the new files.
#[test]
fn golden_files() {
    let model = square("Square, \u{fc}; 1");
    for (entities, name) in [
        (Entities::Parametric114, "square_114.igs"),
        (Entities::Rational128, "square_128.igs"),
        (Entities::Analytic, "square_190.igs"),
    ] {
        let path = format!("{}/tests/golden/{name}", env!("CARGO_MANIFEST_DIR"));
        let (text, _) = written(&model, &options(entities));
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            std::fs::write(&path, &text).unwrap();
        }
        let golden = std::fs::read_to_string(&path).unwrap();
        for (number, (line, expected)) in text.lines().zip(golden.lines()).enumerate() {
            assert_eq!(line, expected, "{name}, line {}", number + 1);
        }
        assert_eq!(text, golden);
    }
}

/// Lines of a section without their last eight columns, and the numbers in those.
fn section(text: &str, letter: char) -> Vec<&str> {
    let lines: Vec<&str> = text
        .lines()
        .filter(|line| line.as_bytes()[72] == letter as u8)
        .collect();
    for (index, line) in lines.iter().enumerate() {
        assert_eq!(
            line[73..].trim().parse::<usize>().unwrap(),
            index + 1,
            "{line}"
        );
    }
    lines
}

/// Parameters of the record that begins on a line of the Parameter section.
fn parameters(lines: &[&str], first: usize, count: usize) -> Vec<String> {
    let text: String = lines[first - 1..first - 1 + count]
        .iter()
        .map(|line| &line[..64])
        .collect();
    let text = text.trim_end();
    let text = text
        .strip_suffix(';')
        .unwrap_or_else(|| panic!("{text:?} is not ended"));
    text.split(',')
        .map(|value| value.trim().to_owned())
        .collect()
}

/// Index of the first directory line of the entity that a pointer names.
fn entry(pointer: &str) -> usize {
    pointer.parse::<usize>().unwrap() - 1
}

/// The parameters of the entity that a pointer names.
fn parameters_of(directory: &[&str], data: &[&str], pointer: &str) -> Vec<String> {
    let field = |line: usize, k: usize| {
        directory[entry(pointer) + line][8 * k..8 * k + 8]
            .trim()
            .parse::<usize>()
            .unwrap()
    };
    parameters(data, field(0, 1), field(1, 3))
}

#[test]
fn columns_counts_and_pointers() {
    for (entities, expected) in [
        (Entities::Parametric114, (2, 3, 4, 18, 2, 2)),
        (Entities::Rational128, (2, 3, 4, 18, 2, 2)),
        // The ramp is a plane, whose curves are in space alone.
        (Entities::Analytic, (2, 3, 3, 14, 2, 2)),
    ] {
        let (text, summary) = written(&sample::model(), &options(entities));
        assert!(text.lines().all(|line| line.len() == 80 && line.is_ascii()));
        let order: String = text
            .lines()
            .map(|line| char::from(line.as_bytes()[72]))
            .collect();
        let sections: Vec<char> = order
            .chars()
            .collect::<Vec<_>>()
            .chunk_by(|a, b| a == b)
            .map(|c| c[0])
            .collect();
        assert_eq!(sections, ['S', 'G', 'D', 'P', 'T']);

        let [start, global, directory, data, last] =
            ['S', 'G', 'D', 'P', 'T'].map(|letter| section(&text, letter));
        assert_eq!(last.len(), 1);
        for (field, (letter, lines)) in [
            ('S', &start),
            ('G', &global),
            ('D', &directory),
            ('P', &data),
        ]
        .iter()
        .enumerate()
        {
            let count = &last[0][8 * field..8 * field + 8];
            assert!(count.starts_with(*letter), "{count}");
            assert_eq!(count[1..].trim().parse::<usize>().unwrap(), lines.len());
        }
        assert_eq!(summary.entities * 2, directory.len());

        let mut next_line = 1;
        let mut types = Vec::new();
        for (index, pair) in directory.chunks(2).enumerate() {
            let field = |line: usize, k: usize| pair[line][8 * k..8 * k + 8].trim();
            let number = |line, k| field(line, k).parse::<i64>().unwrap();
            let own = 2 * index + 1;
            let entity = number(0, 0);
            types.push(entity);
            assert_eq!(entity, number(1, 0));
            assert_eq!(
                number(0, 1),
                next_line,
                "parameters follow each other without gaps"
            );
            let count = number(1, 3);
            for line in &data[next_line as usize - 1..(next_line + count) as usize - 1] {
                assert_eq!(line[65..72].trim().parse::<usize>().unwrap(), own);
                assert_eq!(&line[64..65], " ");
            }
            let values = parameters(&data, next_line as usize, count as usize);
            assert_eq!(values[0], entity.to_string());
            next_line += count;

            // Every pointer points back, to an entity of the right kind and status.
            let pointers: Vec<(i64, &[i64])> = {
                let at = |k: usize| values[k].parse::<i64>().unwrap();
                match entity {
                    102 => (2..values.len())
                        .map(|k| (at(k), &[112, 126][..]))
                        .collect(),
                    142 => {
                        let mut pointers =
                            vec![(at(2), &[114, 128, 190][..]), (at(4), &[102, 112, 126])];
                        if types[(at(2) as usize - 1) / 2] == 190 {
                            assert_eq!(at(3), 0);
                        } else {
                            pointers.push((at(3), &[102, 112, 126]));
                        }
                        pointers
                    }
                    190 => vec![
                        (at(1), &[116][..]),
                        (at(2), &[123][..]),
                        (at(3), &[123][..]),
                    ],
                    144 => {
                        let inner = at(3) as usize;
                        assert_eq!(values.len(), 8 + inner);
                        // The colours come first, in the order of the faces.
                        let face = types.iter().filter(|t| **t == 144).count() as i64;
                        assert_eq!(number(1, 2), -(2 * face - 1));
                        let borders = (4..=4 + inner).map(|k| (at(k), &[142][..]));
                        let name = (at(7 + inner), &[406][..]);
                        borders
                            .chain([(at(1), &[114, 128, 190][..]), name])
                            .collect()
                    }
                    _ => Vec::new(),
                }
            };
            for (pointer, kinds) in pointers {
                assert!(
                    pointer % 2 == 1 && pointer < own as i64,
                    "{pointer} from D{own}"
                );
                let target = types[(pointer as usize - 1) / 2];
                assert!(kinds.contains(&target), "D{own} points to a {target}");
            }
            let status = field(0, 8);
            match entity {
                144 => assert_eq!(status, "00000000"),
                142 => assert_eq!(status, "00010500"),
                114 | 128 | 406 => assert_eq!(status, "00010000"),
                116 | 190 => assert_eq!(status, "00010000"),
                123 => assert_eq!(status, "00010200"),
                314 => assert_eq!(status, "00000200"),
                _ => assert!(["00010000", "00010500"].contains(&status)),
            }
        }
        assert_eq!(next_line as usize, data.len() + 1);
        let of = |kind: &[i64]| types.iter().filter(|t| kind.contains(t)).count();
        assert_eq!(
            (
                of(&[144]),
                of(&[142]),
                of(&[102]),
                of(&[112, 126]),
                of(&[114, 128, 190]),
                of(&[406])
            ),
            expected
        );
    }
}

#[test]
fn parameter_and_space_curves_come_in_equal_numbers() {
    let (text, _) = written(&sample::model(), &options(Entities::Parametric114));
    let directory = section(&text, 'D');
    let data = section(&text, 'P');
    let entity = |pointer: &str| {
        let status = directory[entry(pointer)][64..72].to_owned();
        (status, parameters_of(&directory, &data, pointer))
    };
    let mut borders = 0;
    for line in directory
        .iter()
        .step_by(2)
        .filter(|line| line[..8].trim() == "142")
    {
        let (_, values) = entity(line[73..].trim());
        let ((flat_status, flat), (spatial_status, spatial)) =
            (entity(&values[3]), entity(&values[4]));
        assert_eq!(
            (flat_status.as_str(), spatial_status.as_str()),
            ("00010500", "00010000")
        );
        assert_eq!(flat[0], spatial[0]);
        if flat[0] == "102" {
            assert_eq!(flat[1], spatial[1]);
        }
        assert_eq!(values[5], "2");
        borders += 1;
    }
    assert_eq!(borders, 3);
}

/// The end of each curve, as listed, is the start of the next to the last bit.
#[test]
fn curves_of_a_loop_meet_in_the_text() {
    let mut model = sample::model();
    // A gap that rounding might leave.
    let curve = &mut model.faces[0].outer.coedges[1].space_curve;
    curve.pieces[0][0][0] += 3e-12;
    // Breaks follow the number of pieces, coefficients follow the breaks.
    let start = |values: &[String], d: usize| {
        let pieces = values[4].parse::<usize>().unwrap();
        values[6 + pieces + 4 * d].clone()
    };
    let (text, _) = written(&model, &options(Entities::Parametric114));
    let (directory, data) = (section(&text, 'D'), section(&text, 'P'));
    let record = |pointer: &str| parameters_of(&directory, &data, pointer);
    let mut checked = 0;
    for line in directory
        .iter()
        .step_by(2)
        .filter(|line| line[..8].trim() == "102")
    {
        let composite = record(line[73..].trim());
        let curves: Vec<_> = composite[2..]
            .iter()
            .map(|pointer| record(pointer))
            .collect();
        for (k, curve) in curves.iter().enumerate() {
            let next = &curves[(k + 1) % curves.len()];
            for d in 0..3 {
                let end = &curve[curve.len() - 12 + 4 * d];
                assert_eq!(*end, start(next, d), "{}", line);
                checked += 1;
            }
        }
    }
    assert_eq!(checked, 4 * 4 * 3);
}

#[test]
fn long_names_and_strange_characters() {
    let name = "n\u{e4}me, with; delimiters 12H and a great length ".repeat(5);
    let (text, _) = written(&square(&name), &options(Entities::Parametric114));
    assert!(text.lines().all(|line| line.len() == 80 && line.is_ascii()));
    let model = iges::read_model(text.as_bytes()).unwrap();
    assert_eq!(
        model.faces[0].name.as_deref(),
        Some(name.replace('\u{e4}', "_").as_str())
    );
}

#[test]
fn long_global_strings_are_wrapped() {
    let mut options = options(Entities::Parametric114);
    options.author = "An Author, of a name; longer than the line that is to hold it, ".repeat(3);
    let (text, _) = written(&square("s"), &options);
    assert!(text.lines().all(|line| line.len() == 80));
    assert_eq!(
        iges::read_model(text.as_bytes()).unwrap().author,
        options.author
    );
}
