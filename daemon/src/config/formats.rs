//! Formats by their names: a list, or a text with commas, which is easier on the command line.

use std::collections::BTreeSet;
use std::fmt;

use deliverables::{MeshFormat, PointFormat};
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserializer, Serializer};

struct Names<T> {
    what: &'static str,
    known: &'static str,
    of: fn(&str) -> Option<T>,
}

impl<T: Ord> Names<T> {
    fn one<E: Error>(&self, name: &str) -> Result<T, E> {
        (self.of)(name.trim()).ok_or_else(|| {
            E::custom(format!(
                "`{name}` is no format of {} that can be written: known are {}",
                self.what, self.known
            ))
        })
    }
}

impl<'de, T: Ord> Visitor<'de> for Names<T> {
    type Value = BTreeSet<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a list of formats of {}: {}", self.what, self.known)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
        let names = text.split(',').filter(|name| !name.trim().is_empty());
        names.map(|name| self.one(name)).collect()
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
        let mut formats = BTreeSet::new();
        while let Some(name) = list.next_element::<String>()? {
            formats.insert(self.one(&name)?);
        }
        Ok(formats)
    }
}

pub(super) fn meshes<'de, D: Deserializer<'de>>(from: D) -> Result<BTreeSet<MeshFormat>, D::Error> {
    from.deserialize_any(Names {
        what: "triangles",
        known: "stl, ply, 3mf and glb",
        of: MeshFormat::of_ending,
    })
}

pub(super) fn points<'de, D: Deserializer<'de>>(
    from: D,
) -> Result<BTreeSet<PointFormat>, D::Error> {
    from.deserialize_any(Names {
        what: "points",
        known: "ply and e57",
        of: PointFormat::of_ending,
    })
}

pub(super) fn meshes_told<S: Serializer>(
    formats: &BTreeSet<MeshFormat>,
    to: S,
) -> Result<S::Ok, S::Error> {
    to.collect_seq(formats.iter().map(|format| format.ending()))
}

pub(super) fn points_told<S: Serializer>(
    formats: &BTreeSet<PointFormat>,
    to: S,
) -> Result<S::Ok, S::Error> {
    to.collect_seq(formats.iter().map(|format| format.ending()))
}
