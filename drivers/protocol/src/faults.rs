//! The fault bits of a device.

use core::fmt;

use crate::wire::{MessageError, Reader, Wire, Writer};

/// A set of faults, one bit each. Bits without a name here are kept as they came.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct Faults(pub u32);

impl Faults {
    /// No fault.
    pub const NONE: Self = Self(0);
    /// The laser does not light, or its power is out of bounds.
    pub const LASER: Self = Self(1 << 0);
    /// The head is too hot.
    pub const OVER_TEMPERATURE: Self = Self(1 << 1);
    /// The table ran into a limit switch.
    pub const LIMIT_SWITCH: Self = Self(1 << 2);
    /// The table does not follow its motor.
    pub const TABLE_STALL: Self = Self(1 << 3);
    /// The safety interlock is open.
    pub const INTERLOCK: Self = Self(1 << 4);
    /// The emergency stop is pressed.
    pub const EMERGENCY_STOP: Self = Self(1 << 5);
    /// The camera delivers no picture.
    pub const CAMERA: Self = Self(1 << 6);
    /// The mirror or galvanometer does not reach its angle.
    pub const DEFLECTION: Self = Self(1 << 7);
    /// The supply voltage is out of bounds.
    pub const SUPPLY: Self = Self(1 << 8);
    /// The host was silent for longer than the dead-man time.
    pub const DEAD_MAN: Self = Self(1 << 9);
    /// The device lost measured columns for want of memory.
    pub const OVERRUN: Self = Self(1 << 10);
    /// The stored calibration is damaged.
    pub const CALIBRATION: Self = Self(1 << 11);

    /// Those after which nothing may start again before a person has looked: a device keeps
    /// their bits through `Hello`, and a host clears them on a person's word only.
    pub const ATTENDED: Self =
        Self(Self::LASER.0 | Self::LIMIT_SWITCH.0 | Self::INTERLOCK.0 | Self::EMERGENCY_STOP.0);

    /// Those that keep the device from nothing: they tell of something that is over.
    pub const REPORTED_ONLY: Self = Self(Self::DEAD_MAN.0 | Self::OVERRUN.0);

    /// Each named bit with what it tells the user.
    pub const NAMED: [(Self, &'static str); 12] = [
        (Self::LASER, "laser fault"),
        (Self::OVER_TEMPERATURE, "over-temperature"),
        (Self::LIMIT_SWITCH, "limit switch hit"),
        (Self::TABLE_STALL, "table stalled"),
        (Self::INTERLOCK, "interlock open"),
        (Self::EMERGENCY_STOP, "emergency stop pressed"),
        (Self::CAMERA, "camera fault"),
        (Self::DEFLECTION, "mirror fault"),
        (Self::SUPPLY, "supply voltage out of bounds"),
        (Self::DEAD_MAN, "host was silent (dead-man time)"),
        (Self::OVERRUN, "device buffer overrun"),
        (Self::CALIBRATION, "calibration damaged"),
    ];

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether all faults of `other` are in this set.
    #[must_use]
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether some fault is in both sets.
    #[must_use]
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// What is in both sets.
    #[must_use]
    pub const fn intersection(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Both sets together.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// This set without the faults of `other`.
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// What each set bit tells the user; unnamed bits are left out.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        Self::NAMED
            .into_iter()
            .filter(move |(fault, _)| self.contains(*fault))
            .map(|(_, name)| name)
    }
}

impl core::ops::BitOr for Faults {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        self.union(other)
    }
}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_empty() {
            return f.write_str("none");
        }
        let mut between = "";
        for name in self.names() {
            write!(f, "{between}{name}")?;
            between = ", ";
        }
        let named = Self::NAMED
            .iter()
            .fold(0, |bits, (fault, _)| bits | fault.0);
        if self.0 & !named != 0 {
            write!(f, "{between}unknown fault bits 0x{:x}", self.0 & !named)?;
        }
        Ok(())
    }
}

impl Wire for Faults {
    fn put(&self, out: &mut Writer) {
        self.0.put(out);
    }

    fn get(input: &mut Reader<'_>) -> Result<Self, MessageError> {
        u32::get(input).map(Self)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::ToString;

    #[test]
    fn faults_read_as_words() {
        assert_eq!(Faults::NONE.to_string(), "none");
        assert_eq!(
            (Faults::LASER | Faults::TABLE_STALL).to_string(),
            "laser fault, table stalled"
        );
        assert_eq!(
            Faults(1 << 30 | 2).to_string(),
            "over-temperature, unknown fault bits 0x40000000"
        );
    }

    #[test]
    fn every_named_bit_is_one_bit_and_its_own() {
        let mut seen = 0;
        for (fault, _) in Faults::NAMED {
            assert_eq!(fault.0.count_ones(), 1);
            assert_eq!(seen & fault.0, 0);
            seen |= fault.0;
        }
    }
}
