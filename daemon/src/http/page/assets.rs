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
pub(super) const ASSETS: &[Asset] = &[
    asset!("api.js"),
    asset!("app.js"),
    asset!("axes.js"),
    asset!("colour.js"),
    asset!("dialogs.js"),
    asset!("dom.js"),
    asset!("facts.js"),
    asset!("feed.js"),
    asset!("fleet.js"),
    asset!("format.js"),
    asset!("glb.js"),
    asset!("i18n.js"),
    asset!("icon.svg"),
    asset!("jobs.js"),
    asset!("laser.js"),
    asset!("lattice.js"),
    asset!("machine.js"),
    asset!("main.js"),
    asset!("manifest.webmanifest"),
    asset!("model.js"),
    asset!("orbit.js"),
    asset!("paged.js"),
    asset!("parts.js"),
    asset!("patience.js"),
    asset!("picture.js"),
    asset!("preview.js"),
    asset!("profile.js"),
    asset!("result.js"),
    asset!("room.js"),
    asset!("route.js"),
    asset!("scans.js"),
    asset!("scene.js"),
    asset!("settings.js"),
    asset!("shell.js"),
    asset!("signin.js"),
    asset!("solid.js"),
    asset!("sse.js"),
    asset!("start.js"),
    asset!("strings/en.json"),
    asset!("strings/ko.json"),
    asset!("style.css"),
    asset!("summary.js"),
    asset!("theme.js"),
    asset!("views.css"),
];

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
            } else if name != "package.json" {
                // That one tells Node.js, which runs the tests, that these are modules.
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
