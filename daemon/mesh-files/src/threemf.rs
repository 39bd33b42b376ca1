//! 3MF: one object, since faces share their seams, and a material for each of them.
//!
//! By the core specification 1.3: a package of the Open Packaging Conventions, whose model is XML.

use std::fmt::Write as _;
use std::io::{self, Cursor, Write};

use tessellate::Mesh;
use zip::ZipWriter;
use zip::result::ZipError;
use zip::write::SimpleFileOptions;

use crate::MeshDetails;
use crate::error::MeshFileError;

/// Most vertices, and most triangles, by the specification.
const MOST: usize = i32::MAX as usize;

/// Identifiers of the two resources: one space for all kinds.
const MATERIALS: u32 = 1;
const OBJECT: u32 = 2;

const TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
 <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
 <Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"#;

const RELATIONSHIPS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
 <Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"#;

pub(crate) fn write(
    mesh: &Mesh,
    details: &MeshDetails<'_>,
    sink: &mut dyn Write,
) -> Result<(), MeshFileError> {
    if mesh.vertices_mm.len() > MOST || mesh.triangle_count() > MOST {
        return Err(MeshFileError::Format {
            format: "3MF",
            reason: format!("it has more than {MOST} triangles"),
        });
    }
    let bytes = package(mesh, details).map_err(|error| MeshFileError::Format {
        format: "3MF",
        reason: error.to_string(),
    })?;
    sink.write_all(&bytes)?;
    Ok(())
}

/// The whole file, which its index at the end is written into.
fn package(mesh: &Mesh, details: &MeshDetails<'_>) -> Result<Vec<u8>, ZipError> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    // No time of the day: the same mesh gives the same bytes.
    let options = SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Deflated)
        .last_modified_time(zip::DateTime::default())
        .large_file(mesh.triangle_count() > 20_000_000);
    for (name, text) in [
        ("[Content_Types].xml", TYPES),
        ("_rels/.rels", RELATIONSHIPS),
    ] {
        archive.start_file(name, options)?;
        archive.write_all(text.as_bytes())?;
    }
    archive.start_file("3D/3dmodel.model", options)?;
    model(mesh, details, &mut archive)?;
    Ok(archive.finish()?.into_inner())
}

fn model(mesh: &Mesh, details: &MeshDetails<'_>, out: &mut impl Write) -> io::Result<()> {
    let name = escaped(details.name);
    let mut text = String::from(concat!(
        r#"<?xml version="1.0" encoding="UTF-8"?>"#,
        "\n",
        r#"<model unit="millimeter" xml:lang="en-US" "#,
        r#"xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">"#,
        "\n",
    ));
    for (key, value) in [
        ("Title", &name),
        ("Application", &escaped(details.generator)),
    ] {
        let _ = writeln!(text, r#" <metadata name="{key}">{value}</metadata>"#);
    }
    let _ = writeln!(text, " <resources>\n  <basematerials id=\"{MATERIALS}\">");
    for face in &mesh.faces {
        let [red, green, blue] = details.colour(face.region);
        let _ = writeln!(
            text,
            r##"   <base name="{} ({})" displaycolor="#{red:02X}{green:02X}{blue:02X}"/>"##,
            escaped(&face.name),
            face.form
        );
    }
    // A surface is no solid, which would have to be closed.
    let _ = writeln!(
        text,
        "  </basematerials>\n  <object id=\"{OBJECT}\" type=\"surface\" name=\"{name}\" \
         pid=\"{MATERIALS}\" pindex=\"0\">\n   <mesh>\n    <vertices>"
    );
    for [x, y, z] in &mesh.vertices_mm {
        let _ = writeln!(text, r#"     <vertex x="{x}" y="{y}" z="{z}"/>"#);
        spill(&mut text, out)?;
    }
    text.push_str("    </vertices>\n    <triangles>\n");
    for (k, face) in mesh.faces.iter().enumerate() {
        for [a, b, c] in face.triangles() {
            let _ = writeln!(
                text,
                r#"     <triangle v1="{a}" v2="{b}" v3="{c}" pid="{MATERIALS}" p1="{k}"/>"#
            );
            spill(&mut text, out)?;
        }
    }
    let _ = writeln!(
        text,
        "    </triangles>\n   </mesh>\n  </object>\n </resources>\n <build>\n  \
         <item objectid=\"{OBJECT}\"/>\n </build>\n</model>"
    );
    out.write_all(text.as_bytes())
}

/// Hands on what has gathered, once it is worth it.
fn spill(text: &mut String, out: &mut impl Write) -> io::Result<()> {
    if text.len() > 1 << 16 {
        out.write_all(text.as_bytes())?;
        text.clear();
    }
    Ok(())
}

/// Text between tags or quotation marks.
fn escaped(of: &str) -> String {
    let mut escaped = String::with_capacity(of.len());
    for c in text(of).chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            other => escaped.push(other),
        }
    }
    escaped
}

/// Without the characters that XML cannot hold.
pub(crate) fn text(of: &str) -> String {
    let plain = |c: char| {
        let is_none = c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}');
        if is_none { '_' } else { c }
    };
    of.chars().map(plain).collect()
}
