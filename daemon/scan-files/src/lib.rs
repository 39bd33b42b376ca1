//! Scan files of other programs (text and PLY, plain or compressed) read into columns.
