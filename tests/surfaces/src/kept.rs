//! Pages that a program writes, with pictures beside them, and checks against what it has now.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};

/// Where the pictures lie, from the page.
pub const PICTURES: &str = "pictures/reproduction";

/// A page, and its pictures by name.
pub type Page = (String, Vec<(&'static str, Vec<u8>)>);

/// Writes a page and its pictures.
///
/// # Errors
/// A file that cannot be written, by its name.
pub fn write(path: &Path, (page, pictures): Page) -> Result<()> {
    let folder = path.parent().unwrap_or(path).join(PICTURES);
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    for (name, picture) in pictures {
        let path = folder.join(name);
        fs::write(&path, picture).with_context(|| format!("cannot write {}", path.display()))?;
    }
    fs::write(path, page).with_context(|| format!("cannot write {}", path.display()))?;
    println!("written to {}", path.display());
    Ok(())
}

/// Compares a page that is there with what it would be now.
///
/// # Errors
/// The first line that differs, or a page that cannot be read.
pub fn check(path: &Path, page: &str) -> Result<()> {
    let kept =
        fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    for (kept, now) in kept.lines().zip(page.lines()) {
        if kept != now {
            bail!(
                "{} differs; `cargo xtask reproduce` writes it anew:\n  there: {kept}\n  now:   {now}",
                path.display()
            );
        }
    }
    if kept.lines().count() != page.lines().count() {
        bail!("{} has another number of lines", path.display());
    }
    println!("{}: every figure holds", path.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_checked_line_by_line_and_to_its_end() {
        let folder = std::env::temp_dir().join(format!("kept-{}", std::process::id()));
        let path = folder.join("page.md");
        let page = || ("one\ntwo\n".to_owned(), vec![("a.svg", b"<svg/>".to_vec())]);
        write(&path, page()).unwrap();
        assert_eq!(
            fs::read(folder.join(PICTURES).join("a.svg")).unwrap(),
            b"<svg/>"
        );
        check(&path, "one\ntwo\n").unwrap();
        let told = |page| check(&path, page).unwrap_err().to_string();
        assert!(told("one\n2\n").contains("there: two"));
        assert!(told("one\n").contains("another number of lines"));
        fs::remove_dir_all(folder).unwrap();
    }
}
