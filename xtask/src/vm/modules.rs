//! The kernel's modules and what they need.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use super::archive::Archive;

/// Puts these modules and all that they need into an archive, named so that their order is that
/// of loading.
pub(super) fn add_in_order(archive: &mut Archive, folder: &Path, wanted: &[&str]) -> Result<()> {
    for (number, module) in in_order(folder, wanted)?.iter().enumerate() {
        let name = module
            .file_name()
            .context("a module without a name")?
            .to_string_lossy();
        archive.file(&format!("modules/{number:02}-{name}"), module)?;
    }
    Ok(())
}

/// Puts these modules and all that they need into an archive, where an installed system has them.
pub(super) fn add_as_installed(
    archive: &mut Archive,
    folder: &Path,
    wanted: &[&str],
) -> Result<()> {
    let version = folder
        .parent()
        .and_then(Path::file_name)
        .context("modules without a kernel's version")?;
    let place = Path::new("inject/usr/lib/modules")
        .join(version)
        .join("kernel");
    for module in in_order(folder, wanted)? {
        let name = place.join(module.strip_prefix(folder)?);
        archive.file(&name.display().to_string(), &module)?;
    }
    Ok(())
}

/// The files of these modules and of all that they need, each after what it needs.
pub(super) fn in_order(folder: &Path, wanted: &[&str]) -> Result<Vec<PathBuf>> {
    let mut files = BTreeMap::new();
    collect(folder, &mut files)?;
    let mut order = Vec::new();
    for name in wanted {
        add(&plain(name), &files, &mut order)?;
    }
    Ok(order)
}

/// Names are written with dashes or underscores as it comes.
fn plain(name: &str) -> String {
    name.replace('-', "_")
}

fn collect(folder: &Path, files: &mut BTreeMap<String, PathBuf>) -> Result<()> {
    let entries =
        fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    for entry in entries {
        let entry = entry?;
        let path = entry.path();
        if entry.file_type()?.is_dir() {
            collect(&path, files)?;
        } else if let Some(name) = entry.file_name().to_string_lossy().strip_suffix(".ko") {
            files.insert(plain(name), path);
        }
    }
    Ok(())
}

fn add(name: &str, files: &BTreeMap<String, PathBuf>, order: &mut Vec<PathBuf>) -> Result<()> {
    let Some(file) = files.get(name) else {
        bail!("the kernel has no module {name} (or it is compressed, which is not understood)");
    };
    if order.contains(file) {
        return Ok(());
    }
    let image = fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
    for needed in needs(&image) {
        add(&plain(&needed), files, order)?;
    }
    order.push(file.clone());
    Ok(())
}

/// The modules that a module names as those it needs.
fn needs(image: &[u8]) -> Vec<String> {
    const KEY: &[u8] = b"\0depends=";
    let Some(at) = image.windows(KEY.len()).position(|window| window == KEY) else {
        return Vec::new();
    };
    let list = image.get(at + KEY.len()..).unwrap_or_default();
    let end = list.iter().position(|byte| *byte == 0).unwrap_or(0);
    String::from_utf8_lossy(list.get(..end).unwrap_or_default())
        .split(',')
        .filter(|name| !name.is_empty())
        .map(str::to_owned)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_module_needs_is_read_from_it() {
        let image = b"\x7fELF..\0license=GPL\0depends=usbcore,udc-core\0name=x\0";
        assert_eq!(needs(image), ["usbcore", "udc-core"]);
        assert_eq!(needs(b"..\0depends=\0name=x\0"), [""; 0]);
        assert_eq!(needs(b"nothing"), [""; 0]);
    }
}
