//! What a processed scan leaves behind: CAD file, pictures, report, manifest.
