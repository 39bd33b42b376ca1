//! CAD files: IGES written and read.
