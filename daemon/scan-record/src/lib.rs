//! A kept scan: the append-only journal of raw columns, and its calibration to millimetres.
