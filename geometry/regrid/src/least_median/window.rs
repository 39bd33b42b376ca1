//! A window's samples, ready for lanes.

/// Samples in a block.
pub(super) const BLOCK: usize = 8;
const BLOCKS: usize = GREATEST_WINDOW / BLOCK;

/// Most samples of a window.
pub const GREATEST_WINDOW: usize = 1024;

/// Samples next to one another in memory, by coordinate. Where they do not fill the last block,
/// it ends in samples at an infinite height, which no plane comes near.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block<T> {
    pub(super) x: [T; BLOCK],
    pub(super) y: [T; BLOCK],
    pub(super) z: [T; BLOCK],
}

/// What the largest numbers of a window are, rounded up, for what rounding may do.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    pub(super) x: f32,
    pub(super) y: f32,
    /// Of z less the reference.
    pub(super) z: f32,
    /// Samples in single precision are as high above this height.
    pub(super) reference: f64,
}

#[derive(Debug)]
pub(super) struct Window {
    exact: Box<[Block<f64>; BLOCKS]>,
    rough: Box<[Block<f32>; BLOCKS]>,
    squares: Box<[[f64; BLOCK]; BLOCKS]>,
    len: usize,
}

impl Default for Window {
    fn default() -> Self {
        Self {
            exact: Box::new([FAR; BLOCKS]),
            rough: Box::new(
                [Block {
                    x: [0.0; BLOCK],
                    y: [0.0; BLOCK],
                    z: [0.0; BLOCK],
                }; BLOCKS],
            ),
            squares: Box::new([[0.0; BLOCK]; BLOCKS]),
            len: 0,
        }
    }
}

const FAR: Block<f64> = Block {
    x: [0.0; BLOCK],
    y: [0.0; BLOCK],
    z: [f64::INFINITY; BLOCK],
};

/// More than rounding to single precision a few times takes away.
pub(super) const UP: f32 = 1.0 + 4.0 * UNIT;
/// Relative error of rounding to single precision.
pub(super) const UNIT: f32 = 0.5 * f32::EPSILON;

impl Window {
    /// Takes samples (x, y, z) in the order in which they are numbered. `None` if they span no
    /// plane or are too many.
    pub(super) fn fill(&mut self, samples: impl ExactSizeIterator<Item = [f64; 3]>) -> Option<()> {
        self.len = samples.len();
        if !(3..=GREATEST_WINDOW).contains(&self.len) {
            return None;
        }
        if !self.len.is_multiple_of(BLOCK) {
            self.exact[self.len / BLOCK] = FAR;
        }
        for (k, [x, y, z]) in samples.enumerate() {
            let block = &mut self.exact[k / BLOCK % BLOCKS];
            (block.x[k % BLOCK], block.y[k % BLOCK], block.z[k % BLOCK]) = (x, y, z);
        }
        Some(())
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Samples with those that fill the last block.
    pub(super) fn padded_len(&self) -> usize {
        self.len.next_multiple_of(BLOCK)
    }

    /// Squares below the median.
    pub(super) fn middle(&self) -> usize {
        (self.len - 1) / 2
    }

    /// A sample; in single precision comparisons its height is that above the reference.
    #[inline(always)]
    pub(super) fn sample(&self, index: u32) -> [f64; 3] {
        let index = index as usize;
        let block = &self.exact[index / BLOCK % BLOCKS];
        let k = index % BLOCK;
        [block.x[k], block.y[k], block.z[k]]
    }

    #[inline(always)]
    pub(super) fn rough(&self) -> &[Block<f32>] {
        &self.rough[..self.len.div_ceil(BLOCK)]
    }

    /// Samples, and room for the square of each one's residual.
    #[inline(always)]
    pub(super) fn squares(&mut self) -> (&[Block<f64>], &mut [[f64; BLOCK]]) {
        let blocks = self.len.div_ceil(BLOCK);
        (&self.exact[..blocks], &mut self.squares[..blocks])
    }

    /// Makes the samples in single precision. Their heights are taken from the nearest one's, so
    /// that little is lost to rounding.
    #[inline(always)]
    pub(super) fn roughen(&mut self) -> Extent {
        let blocks = self.len.div_ceil(BLOCK);
        let reference = self.exact[0].z[0];
        let (mut x, mut y, mut z) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
        for (rough, exact) in self.rough.iter_mut().zip(self.exact.iter()).take(blocks) {
            for k in 0..BLOCK {
                rough.x[k] = exact.x[k] as f32;
                rough.y[k] = exact.y[k] as f32;
                rough.z[k] = (exact.z[k] - reference) as f32;
                x[k] = greater(rough.x[k].abs(), x[k]);
                y[k] = greater(rough.y[k].abs(), y[k]);
                let height = rough.z[k].abs();
                z[k] = greater(if height < f32::INFINITY { height } else { 0.0 }, z[k]);
            }
        }
        let greatest = |lanes: [f32; BLOCK]| UP * lanes.into_iter().fold(0.0, greater);
        Extent {
            x: greatest(x),
            y: greatest(y),
            z: greatest(z),
            reference,
        }
    }
}

/// One comparison; `f32::max` takes care of what is not a number, too, with several.
#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
