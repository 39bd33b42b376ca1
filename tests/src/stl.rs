//! Binary STL files, triangle by triangle: faces of generated parts are told by ranges of these.

use anyhow::{Context, Result, ensure};
use sim_scanner::Vec3;

/// Corners of the triangles of a binary STL file, in the order of the file.
///
/// # Errors
/// Not as long as it says.
pub fn triangles(bytes: &[u8]) -> Result<Vec<[Vec3; 3]>> {
    const HEADER: usize = 84;
    const EACH: usize = 50;
    let count = bytes.get(80..HEADER).context("it is cut short")?;
    let count = u32::from_le_bytes(count.try_into()?) as usize;
    let body = bytes.get(HEADER..).unwrap_or_default();
    ensure!(
        body.len() == count * EACH,
        "it is cut short, or no binary STL"
    );
    let number = |of: &[u8], k: usize| {
        let bytes = [of[4 * k], of[4 * k + 1], of[4 * k + 2], of[4 * k + 3]];
        f64::from(f32::from_le_bytes(bytes))
    };
    let corner =
        |of: &[u8], k: usize| Vec3::new(number(of, k), number(of, k + 1), number(of, k + 2));
    // The normal comes first.
    let each = body.chunks_exact(EACH);
    Ok(each
        .map(|t| [corner(t, 3), corner(t, 6), corner(t, 9)])
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_read_in_their_order() {
        let mut bytes = vec![0; 80];
        bytes.extend(2_u32.to_le_bytes());
        for triangle in 0..2_u8 {
            for k in 0..12_u8 {
                bytes.extend(f32::from(triangle * 100 + k).to_le_bytes());
            }
            bytes.extend([0, 0]);
        }
        let read = triangles(&bytes).unwrap();
        assert_eq!(read.len(), 2);
        assert_eq!(read[1][0], Vec3::new(103.0, 104.0, 105.0));
        assert_eq!(read[1][2], Vec3::new(109.0, 110.0, 111.0));
        assert!(triangles(&bytes[..100]).is_err());
        assert!(triangles(&bytes[..10]).is_err());
    }
}
