//! Binary glTF 2.0: metres, y up, a node for each face.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Write;

use gltf::binary::{Glb, Header};
use gltf::json::accessor::{ComponentType, GenericComponentType, Type};
use gltf::json::buffer::{Target, View};
use gltf::json::material::{PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked::Valid;
use gltf::json::validation::USize64;
use gltf::json::{
    Accessor, Asset, Buffer, Index, Material, Mesh as Shape, Node, Root, Scene, Value,
};
use tessellate::{Mesh, MeshFace};

use crate::MeshDetails;
use crate::error::MeshFileError;

/// Metres in a millimetre.
const M: f64 = 1e-3;

pub(crate) fn write(
    mesh: &Mesh,
    details: &MeshDetails<'_>,
    sink: &mut dyn Write,
) -> Result<(), MeshFileError> {
    let mut file = File::new(details);
    let materials: BTreeMap<[u8; 3], Index<Material>> = mesh
        .faces
        .iter()
        .map(|face| details.colour(face.region))
        .collect::<std::collections::BTreeSet<_>>()
        .into_iter()
        .map(|colour| (colour, file.material(colour)))
        .collect();
    let mut nodes = Vec::new();
    for face in &mesh.faces {
        let material = materials.get(&details.colour(face.region)).copied();
        nodes.push(file.face(mesh, face, material));
    }
    let bytes = file.finish(details.name, nodes);
    sink.write_all(&container(&bytes.root, bytes.binary)?)?;
    Ok(())
}

/// The file that holds a description and the bytes that it speaks of.
pub(crate) fn container(root: &Root, binary: Vec<u8>) -> Result<Vec<u8>, MeshFileError> {
    let refused = |reason: String| MeshFileError::Format {
        format: "glTF",
        reason,
    };
    let json = root.to_vec().map_err(|error| refused(error.to_string()))?;
    // All lengths in the container have 32 bits; both pieces are padded.
    if u32::try_from(binary.len() + json.len() + 64).is_err() {
        return Err(refused("it would be longer than 4 GiB".to_owned()));
    }
    let glb = Glb {
        header: Header {
            magic: *b"glTF",
            version: 2,
            length: 0,
        },
        json: Cow::Owned(json),
        bin: Some(Cow::Owned(binary)),
    };
    glb.to_vec().map_err(|error| refused(error.to_string()))
}

/// What the container holds.
struct Content {
    root: Root,
    binary: Vec<u8>,
}

struct File {
    root: Root,
    binary: Vec<u8>,
    buffer: Index<Buffer>,
}

impl File {
    fn new(details: &MeshDetails<'_>) -> Self {
        let mut root = Root {
            asset: Asset {
                generator: Some(details.generator.to_owned()),
                ..Asset::default()
            },
            ..Root::default()
        };
        let buffer = root.push(Buffer {
            byte_length: USize64(0),
            name: None,
            uri: None,
            extensions: None,
            extras: Default::default(),
        });
        Self {
            root,
            binary: Vec::new(),
            buffer,
        }
    }

    fn material(&mut self, colour: [u8; 3]) -> Index<Material> {
        self.root.push(material(colour))
    }

    fn face(
        &mut self,
        mesh: &Mesh,
        face: &MeshFace,
        material: Option<Index<Material>>,
    ) -> Index<Node> {
        let places: Vec<[f32; 3]> = face
            .corners
            .iter()
            .map(|corner| mesh.vertices_mm[corner.vertex as usize].map(|mm| (mm * M) as f32))
            .collect();
        let normals = face
            .corners
            .iter()
            .map(|corner| corner.normal.map(|c| c as f32));
        let normals: Vec<[f32; 3]> = normals.collect();
        let mut low = [f32::INFINITY; 3];
        let mut high = [f32::NEG_INFINITY; 3];
        for place in &places {
            for d in 0..3 {
                low[d] = low[d].min(place[d]);
                high[d] = high[d].max(place[d]);
            }
        }
        let bytes = |vectors: &[[f32; 3]]| -> Vec<u8> {
            vectors
                .iter()
                .flatten()
                .flat_map(|c| c.to_le_bytes())
                .collect()
        };
        let limits = |limits: [f32; 3]| Some(Value::from(limits.to_vec()));
        let position = self.accessor(&bytes(&places), places.len(), Some(Target::ArrayBuffer));
        if let Some(accessor) = self.root.accessors.get_mut(position.value()) {
            (accessor.min, accessor.max) = (limits(low), limits(high));
        }
        let normal = self.accessor(&bytes(&normals), normals.len(), Some(Target::ArrayBuffer));
        let indices: Vec<u8> = face
            .triangles
            .iter()
            .flatten()
            .flat_map(|k| k.to_le_bytes())
            .collect();
        let count = 3 * face.triangles.len();
        let index = self.accessor(&indices, count, Some(Target::ElementArrayBuffer));
        if let Some(accessor) = self.root.accessors.get_mut(index.value()) {
            accessor.component_type = Valid(GenericComponentType(ComponentType::U32));
            accessor.type_ = Valid(Type::Scalar);
        }
        let shape = self.root.push(Shape {
            name: Some(face.name.clone()),
            primitives: vec![Primitive {
                attributes: [
                    (Valid(Semantic::Positions), position),
                    (Valid(Semantic::Normals), normal),
                ]
                .into(),
                indices: Some(index),
                material,
                mode: Valid(Mode::Triangles),
                targets: None,
                extensions: None,
                extras: Default::default(),
            }],
            weights: None,
            extensions: None,
            extras: Default::default(),
        });
        self.root.push(Node {
            name: Some(face.name.clone()),
            mesh: Some(shape),
            ..Node::default()
        })
    }

    /// Vectors of three floats, unless the caller says otherwise.
    fn accessor(&mut self, bytes: &[u8], count: usize, target: Option<Target>) -> Index<Accessor> {
        let view = self.root.push(View {
            buffer: self.buffer,
            byte_length: USize64::from(bytes.len()),
            byte_offset: Some(USize64::from(self.binary.len())),
            byte_stride: None,
            name: None,
            target: target.map(Valid),
            extensions: None,
            extras: Default::default(),
        });
        // All that is written has four bytes, so everything stays aligned.
        self.binary.extend_from_slice(bytes);
        self.root.push(Accessor {
            buffer_view: Some(view),
            byte_offset: Some(USize64(0)),
            count: USize64::from(count),
            component_type: Valid(GenericComponentType(ComponentType::F32)),
            type_: Valid(Type::Vec3),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: None,
            extensions: None,
            extras: Default::default(),
        })
    }

    fn finish(mut self, name: &str, nodes: Vec<Index<Node>>) -> Content {
        let part = self.root.push(Node {
            name: Some(name.to_owned()),
            children: Some(nodes),
            ..Node::default()
        });
        let scene = self.root.push(Scene {
            name: Some(name.to_owned()),
            nodes: vec![part],
            extensions: None,
            extras: Default::default(),
        });
        self.root.scene = Some(scene);
        if let Some(buffer) = self.root.buffers.get_mut(self.buffer.value()) {
            buffer.byte_length = USize64::from(self.binary.len());
        }
        Content {
            root: self.root,
            binary: self.binary,
        }
    }
}

/// A dull surface, seen from behind, too, since a sheet has no inside.
pub(crate) fn material(colour: [u8; 3]) -> Material {
    let [red, green, blue] = colour.map(linear);
    let [r, g, b] = colour;
    Material {
        name: Some(format!("#{r:02x}{g:02x}{b:02x}")),
        double_sided: true,
        pbr_metallic_roughness: PbrMetallicRoughness {
            base_color_factor: PbrBaseColorFactor([red, green, blue, 1.0]),
            metallic_factor: StrengthFactor(0.0),
            roughness_factor: StrengthFactor(0.8),
            ..PbrMetallicRoughness::default()
        },
        ..Material::default()
    }
}

/// A channel of sRGB as the linear share that glTF asks for.
fn linear(channel: u8) -> f32 {
    let c = f64::from(channel) / 255.0;
    let linear = if c <= 0.040_45 {
        c / 12.92
    } else {
        libm::pow((c + 0.055) / 1.055, 2.4)
    };
    linear as f32
}
