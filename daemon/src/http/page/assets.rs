//! The files of the page.

/// A file of the page.
pub(super) struct Asset {
    /// Its name below `/assets/`.
    pub(super) name: &'static str,
    pub(super) bytes: &'static [u8],
}

impl Asset {
    /// Its media type, by its ending.
    pub(super) fn media_type(&self) -> &'static str {
        match self.name.rsplit_once('.').map(|(_, ending)| ending) {
            Some("html") => "text/html; charset=utf-8",
            Some("js") => "text/javascript; charset=utf-8",
            Some("css") => "text/css; charset=utf-8",
            Some("svg") => "image/svg+xml",
            Some("json") => "application/json",
            Some("webmanifest") => "application/manifest+json",
            _ => "application/octet-stream",
        }
    }
}

macro_rules! asset {
    ($name:literal) => {
        Asset {
            name: $name,
            bytes: include_bytes!(concat!("../../../web/", $name)),
        }
    };
}

/// What the address of the service itself shows.
pub(super) const INDEX: Asset = asset!("index.html");

/// All others.
pub(super) const ASSETS: &[Asset] = &[];

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn files(folder: &Path, prefix: &str, found: &mut Vec<String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let entry = entry.unwrap();
            let name = format!("{prefix}{}", entry.file_name().to_str().unwrap());
            if entry.path().is_dir() {
                // Tests of the page's own.
                if name != "tests" {
                    files(&entry.path(), &format!("{name}/"), found);
                }
            } else {
                found.push(name);
            }
        }
    }

    #[test]
    fn every_file_of_the_page_is_in_the_program() {
        let mut found = Vec::new();
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("web");
        files(&folder, "", &mut found);
        found.sort();
        let mut built_in: Vec<&str> = ASSETS.iter().chain([&INDEX]).map(|a| a.name).collect();
        built_in.sort_unstable();
        assert_eq!(built_in, found);
        for asset in ASSETS {
            assert_ne!(
                asset.media_type(),
                "application/octet-stream",
                "{}",
                asset.name
            );
        }
    }
}
