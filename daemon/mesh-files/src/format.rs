//! The formats by their names.

/// A format of triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MeshFormat {
    /// Stereolithography, binary: bare triangles, millimetres.
    Stl,
    /// Polygon file format, binary: millimetres, colour and region of each triangle.
    Ply,
    /// 3D Manufacturing Format: millimetres, a named and coloured material for each face.
    ThreeMf,
    /// Binary glTF 2.0: metres, a named node for each face.
    Glb,
}

/// A format of points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PointFormat {
    /// Polygon file format, binary: millimetres.
    Ply,
    /// ASTM E2807: metres.
    E57,
}

/// A format of bare triangles, which are read and written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TriangleFormat {
    /// Stereolithography.
    Stl,
    /// Polygon file format.
    Ply,
    /// Wavefront OBJ.
    Obj,
}

impl TriangleFormat {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Stl, Self::Ply, Self::Obj];

    /// The ending of its files.
    #[must_use]
    pub fn ending(self) -> &'static str {
        match self {
            Self::Stl => "stl",
            Self::Ply => "ply",
            Self::Obj => "obj",
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Stl => "STL",
            Self::Ply => "PLY",
            Self::Obj => "OBJ",
        }
    }

    /// The format that an ending means, in either case.
    #[must_use]
    pub fn of_ending(ending: &str) -> Option<Self> {
        let of = |format: &Self| ending.eq_ignore_ascii_case(format.ending());
        Self::ALL.into_iter().find(of)
    }
}

impl MeshFormat {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Stl, Self::Ply, Self::ThreeMf, Self::Glb];

    /// The ending of its files, which is its name in settings, too.
    #[must_use]
    pub fn ending(self) -> &'static str {
        match self {
            Self::Stl => "stl",
            Self::Ply => "ply",
            Self::ThreeMf => "3mf",
            Self::Glb => "glb",
        }
    }

    /// The format that an ending means, in either case.
    #[must_use]
    pub fn of_ending(ending: &str) -> Option<Self> {
        let of = |format: &Self| ending.eq_ignore_ascii_case(format.ending());
        Self::ALL.into_iter().find(of)
    }
}

impl PointFormat {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Ply, Self::E57];

    /// The ending of its files, which is its name in settings, too.
    #[must_use]
    pub fn ending(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::E57 => "e57",
        }
    }

    /// The format that an ending means, in either case.
    #[must_use]
    pub fn of_ending(ending: &str) -> Option<Self> {
        let of = |format: &Self| ending.eq_ignore_ascii_case(format.ending());
        Self::ALL.into_iter().find(of)
    }
}
