//! Faces, lines and points to be shown, as binary glTF 2.0.
//!
//! glTF asks for metres. Places stand in millimetres all the same, under a node that scales them, so
//! that a viewer of parts can take them as they are and one of glTF has them in its unit.

use std::collections::BTreeMap;
use std::io::Write;

use gltf::json::accessor::{ComponentType, GenericComponentType, Type};
use gltf::json::buffer::{Target, View};
use gltf::json::extras::RawValue;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked::Valid;
use gltf::json::validation::USize64;
use gltf::json::{
    Accessor, Asset, Buffer, Extras, Index, Material, Mesh as Shape, Node, Root, Scene as Stage,
};
use serde_json::Value;

use crate::error::MeshFileError;
use crate::glb::{container, material};

/// Metres in a millimetre.
const M: f32 = 1e-3;

/// What is shown.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Name of the part.
    pub name: String,
    /// Name and version of the program that made it.
    pub generator: String,
    /// About the whole.
    pub extras: Value,
    /// Each becomes a node with one mesh; those without primitives are left out.
    pub groups: Vec<SceneGroup>,
}

/// Things of one sort.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneGroup {
    /// Name of node and mesh.
    pub name: &'static str,
    /// What it consists of; those without places are left out.
    pub primitives: Vec<ScenePrimitive>,
}

/// How places are joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drawn {
    /// Three indices to a triangle.
    Triangles,
    /// Two indices to a line.
    Lines,
    /// Each for itself.
    Points,
}

/// Places, and what is known of each.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenePrimitive {
    /// How they are joined.
    pub drawn: Drawn,
    /// Millimetres, part frame; all finite.
    pub places_mm: Vec<[f32; 3]>,
    /// A unit normal for each, or none at all.
    pub normals: Vec<[f32; 3]>,
    /// A number for each, by names that begin with an underscore; all finite.
    pub numbers: Vec<(&'static str, Vec<f32>)>,
    /// Which places are joined; empty for points.
    pub indices: Vec<u32>,
    /// Red, green and blue.
    pub colour: [u8; 3],
    /// About this primitive.
    pub extras: Value,
}

impl Scene {
    /// Writes it. The bytes follow from its content.
    ///
    /// # Errors
    /// [`MeshFileError`] where it is too large for the format, or `sink` fails.
    pub fn write(&self, sink: &mut dyn Write) -> Result<(), MeshFileError> {
        let mut file = File::default();
        let extras = extras(&self.extras)?;
        file.root.asset = Asset {
            generator: Some(self.generator.clone()),
            extras: extras.clone(),
            ..Asset::default()
        };
        let mut nodes = Vec::new();
        for group in &self.groups {
            nodes.extend(file.group(group)?);
        }
        let root = file.root.push(Node {
            name: Some(self.name.clone()),
            children: (!nodes.is_empty()).then_some(nodes),
            scale: Some([M; 3]),
            ..Node::default()
        });
        let stage = file.root.push(Stage {
            name: Some(self.name.clone()),
            nodes: vec![root],
            extensions: None,
            extras: None,
        });
        file.root.scene = Some(stage);
        sink.write_all(&file.finish()?)?;
        Ok(())
    }
}

fn extras(value: &Value) -> Result<Extras, MeshFileError> {
    let raw = RawValue::from_string(value.to_string());
    raw.map(Some).map_err(|error| MeshFileError::Format {
        format: "glTF",
        reason: error.to_string(),
    })
}

/// One view of the buffer for each sort of content keeps the description short.
#[derive(Default)]
struct File {
    root: Root,
    vectors: Vec<u8>,
    numbers: Vec<u8>,
    indices: Vec<u8>,
    materials: BTreeMap<[u8; 3], Index<Material>>,
}

/// Views of the buffer, in the order in which they stand there. None may be empty, so those that
/// nothing was put into are not written, and the others move up.
#[derive(Clone, Copy)]
enum Part {
    Vectors,
    Numbers,
    Indices,
}

impl File {
    fn group(&mut self, group: &SceneGroup) -> Result<Option<Index<Node>>, MeshFileError> {
        let mut primitives = Vec::new();
        for primitive in &group.primitives {
            if !primitive.places_mm.is_empty() {
                primitives.push(self.primitive(primitive)?);
            }
        }
        if primitives.is_empty() {
            return Ok(None);
        }
        let name = || Some(group.name.to_owned());
        let shape = self.root.push(Shape {
            name: name(),
            primitives,
            weights: None,
            extensions: None,
            extras: None,
        });
        Ok(Some(self.root.push(Node {
            name: name(),
            mesh: Some(shape),
            ..Node::default()
        })))
    }

    fn primitive(&mut self, told: &ScenePrimitive) -> Result<Primitive, MeshFileError> {
        let position = self.vectors(&told.places_mm);
        let range = told.places_mm.iter().fold(
            [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]],
            |[low, high], place| {
                let bound = |bound: [f32; 3], pick: fn(f32, f32) -> f32| {
                    [0, 1, 2].map(|d| pick(bound[d], place[d]))
                };
                [bound(low, f32::min), bound(high, f32::max)]
            },
        );
        if let Some(accessor) = self.root.accessors.get_mut(position.value()) {
            let [low, high] = range.map(|limits| Some(Value::from(limits.to_vec())));
            (accessor.min, accessor.max) = (low, high);
        }
        let mut attributes = BTreeMap::from([(Valid(Semantic::Positions), position)]);
        if !told.normals.is_empty() {
            attributes.insert(Valid(Semantic::Normals), self.vectors(&told.normals));
        }
        for (name, values) in &told.numbers {
            let bytes: Vec<u8> = values
                .iter()
                .flat_map(|value| value.to_le_bytes())
                .collect();
            let form = (Type::Scalar, ComponentType::F32);
            let accessor = self.accessor(Part::Numbers, &bytes, values.len(), form);
            let name = name.trim_start_matches('_').to_owned();
            attributes.insert(Valid(Semantic::Extras(name)), accessor);
        }
        let indices = (!told.indices.is_empty()).then(|| {
            let bytes: Vec<u8> = told.indices.iter().flat_map(|k| k.to_le_bytes()).collect();
            let form = (Type::Scalar, ComponentType::U32);
            self.accessor(Part::Indices, &bytes, told.indices.len(), form)
        });
        let root = &mut self.root;
        let paint = self.materials.entry(told.colour);
        let paint = *paint.or_insert_with(|| root.push(material(told.colour)));
        Ok(Primitive {
            attributes,
            indices,
            material: Some(paint),
            mode: Valid(match told.drawn {
                Drawn::Triangles => Mode::Triangles,
                Drawn::Lines => Mode::Lines,
                Drawn::Points => Mode::Points,
            }),
            targets: None,
            extensions: None,
            extras: extras(&told.extras)?,
        })
    }

    fn vectors(&mut self, vectors: &[[f32; 3]]) -> Index<Accessor> {
        let numbers = vectors.iter().flatten();
        let bytes: Vec<u8> = numbers.flat_map(|number| number.to_le_bytes()).collect();
        let form = (Type::Vec3, ComponentType::F32);
        self.accessor(Part::Vectors, &bytes, vectors.len(), form)
    }

    /// The view's index is that of its part until the file is finished.
    fn accessor(
        &mut self,
        part: Part,
        bytes: &[u8],
        count: usize,
        (type_, component): (Type, ComponentType),
    ) -> Index<Accessor> {
        let store = match part {
            Part::Vectors => &mut self.vectors,
            Part::Numbers => &mut self.numbers,
            Part::Indices => &mut self.indices,
        };
        let offset = store.len();
        store.extend_from_slice(bytes);
        self.root.push(Accessor {
            buffer_view: Some(Index::new(part as u32)),
            byte_offset: Some(USize64::from(offset)),
            count: USize64::from(count),
            component_type: Valid(GenericComponentType(component)),
            type_: Valid(type_),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: None,
            extensions: None,
            extras: None,
        })
    }

    fn finish(mut self) -> Result<Vec<u8>, MeshFileError> {
        let parts = [
            (self.vectors, Some(12), Target::ArrayBuffer),
            (self.numbers, Some(4), Target::ArrayBuffer),
            (self.indices, None, Target::ElementArrayBuffer),
        ];
        let mut binary = Vec::new();
        let mut views = [None; 3];
        for (view, (bytes, stride, target)) in views.iter_mut().zip(parts) {
            if bytes.is_empty() {
                continue;
            }
            *view = Some(self.root.push(View {
                buffer: Index::new(0),
                byte_length: USize64::from(bytes.len()),
                byte_offset: Some(USize64::from(binary.len())),
                byte_stride: stride.map(gltf::json::buffer::Stride),
                name: None,
                target: Some(Valid(target)),
                extensions: None,
                extras: None,
            }));
            // All that is written has four bytes, so everything stays aligned.
            binary.extend_from_slice(&bytes);
        }
        for accessor in &mut self.root.accessors {
            let part = accessor.buffer_view.map(|view| view.value());
            accessor.buffer_view = part.and_then(|part| views.get(part).copied().flatten());
        }
        if !binary.is_empty() {
            self.root.push(Buffer {
                byte_length: USize64::from(binary.len()),
                name: None,
                uri: None,
                extensions: None,
                extras: None,
            });
        }
        container(&self.root, binary)
    }
}
