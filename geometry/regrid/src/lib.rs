//! Irregular scanner columns to a uniform range image by moving least median of squares (MLMS).
