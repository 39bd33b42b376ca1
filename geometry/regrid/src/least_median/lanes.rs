//! What the search needs of lanes beyond what every kind of them has under one name.

use pulp::{Arch, Scalar, Simd, WithSimd};

/// Lanes of one kind.
pub(super) trait Lanes: Simd {
    /// A bit for each lane, the first lane's lowest.
    fn bits_m32s(self, mask: Self::m32s) -> u32;

    /// A bit for each lane, the first lane's lowest.
    fn bits_m64s(self, mask: Self::m64s) -> u32;

    /// Where a number is neither below the first bound nor above the second.
    #[inline(always)]
    fn is_within(self, [lowest, highest]: [Self::f32s; 2], number: Self::f32s) -> Self::m32s {
        self.and_m32s(
            self.less_than_or_equal_f32s(lowest, number),
            self.less_than_or_equal_f32s(number, highest),
        )
    }

    /// The numbers at these indices. There are as many as fill [`PICKED`] times over, and no
    /// index is beyond them.
    fn pick(self, numbers: &[f32], indices: Self::u32s) -> Self::f32s;
}

/// Numbers come in so many at a time, for [`Lanes::pick`].
pub(super) const PICKED: usize = 32;

/// Work for lanes of any kind.
pub(super) trait WithLanes {
    type Output;

    fn with_lanes<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// Does the work with the widest lanes of this processor.
pub(super) fn dispatch<W: WithLanes>(work: W) -> W::Output {
    match Arch::new() {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(lanes) => with(lanes, work),
        #[cfg(target_arch = "x86_64")]
        Arch::V3(lanes) => with(lanes, work),
        #[cfg(target_arch = "aarch64")]
        Arch::Neon(lanes) => with(lanes, work),
        _ => with(Scalar::new(), work),
    }
}

/// Does the work with these lanes, compiled for the processors that have them.
pub(super) fn with<L: Lanes, W: WithLanes>(lanes: L, work: W) -> W::Output {
    lanes.vectorize(Known { lanes, work })
}

/// Work whose lanes are known by more than being some.
struct Known<L, W> {
    lanes: L,
    work: W,
}

impl<L: Lanes, W: WithLanes> WithSimd for Known<L, W> {
    type Output = W::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        self.work.with_lanes(self.lanes)
    }
}

impl Lanes for Scalar {
    #[inline(always)]
    fn bits_m32s(self, mask: bool) -> u32 {
        u32::from(mask)
    }

    #[inline(always)]
    fn bits_m64s(self, mask: bool) -> u32 {
        u32::from(mask)
    }

    #[inline(always)]
    fn pick(self, numbers: &[f32], index: u32) -> f32 {
        numbers[index as usize]
    }
}

#[cfg(target_arch = "aarch64")]
impl Lanes for pulp::aarch64::Neon {
    #[inline(always)]
    fn bits_m32s(self, mask: Self::m32s) -> u32 {
        let ones = self.select_u32s(mask, self.splat_u32s(1), self.splat_u32s(0));
        let ones: [u32; 4] = pulp::cast(ones);
        ones[0] | ones[1] << 1 | ones[2] << 2 | ones[3] << 3
    }

    #[inline(always)]
    fn bits_m64s(self, mask: Self::m64s) -> u32 {
        let ones = self.select_u64s(mask, self.splat_u64s(1), self.splat_u64s(0));
        let ones: [u64; 2] = pulp::cast(ones);
        (ones[0] | ones[1] << 1) as u32
    }

    #[inline(always)]
    fn pick(self, numbers: &[f32], indices: Self::u32s) -> Self::f32s {
        let indices: [u32; 4] = pulp::cast(indices);
        pulp::cast(indices.map(|index| numbers[index as usize]))
    }
}

#[cfg(target_arch = "x86_64")]
impl Lanes for pulp::x86::V3 {
    #[inline(always)]
    fn bits_m32s(self, mask: Self::m32s) -> u32 {
        self.avx
            ._mm256_movemask_ps(pulp::cast(mask))
            .cast_unsigned()
    }

    #[inline(always)]
    fn bits_m64s(self, mask: Self::m64s) -> u32 {
        self.avx
            ._mm256_movemask_pd(pulp::cast(mask))
            .cast_unsigned()
    }

    #[inline(always)]
    fn pick(self, numbers: &[f32], indices: Self::u32s) -> Self::f32s {
        let indices: [u32; 8] = pulp::cast(indices);
        pulp::cast(indices.map(|index| numbers[index as usize]))
    }
}

#[cfg(target_arch = "x86_64")]
impl Lanes for pulp::x86::V4 {
    #[inline(always)]
    fn bits_m32s(self, mask: Self::m32s) -> u32 {
        u32::from(mask.0)
    }

    #[inline(always)]
    fn bits_m64s(self, mask: Self::m64s) -> u32 {
        u32::from(mask.0)
    }

    /// The second comparison is made where the first holds, which saves joining them.
    #[inline(always)]
    fn is_within(self, [lowest, highest]: [Self::f32s; 2], number: Self::f32s) -> Self::m32s {
        let above = self.less_than_or_equal_f32s(lowest, number);
        let (number, highest) = (pulp::cast(number), pulp::cast(highest));
        pulp::b16(
            self.avx512f
                ._mm512_mask_cmple_ps_mask(above.0, number, highest),
        )
    }

    /// One instruction picks from two registers, which is what [`PICKED`] numbers fill.
    #[inline(always)]
    fn pick(self, numbers: &[f32], indices: Self::u32s) -> Self::f32s {
        let registers = Self::as_simd_f32s(numbers).0;
        let (pairs, _) = registers.as_chunks::<2>();
        let mut picked = self.splat_f32s(0.0);
        for (k, [low, high]) in pairs.iter().enumerate() {
            let found = self.avx512f._mm512_permutex2var_ps(
                pulp::cast(*low),
                pulp::cast(indices),
                pulp::cast(*high),
            );
            let before = self.splat_u32s((k * PICKED) as u32);
            let within = self.greater_than_or_equal_u32s(indices, before);
            picked = self.select_f32s(within, pulp::cast(found), picked);
        }
        picked
    }
}
