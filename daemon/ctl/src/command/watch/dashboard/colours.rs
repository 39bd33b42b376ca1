//! Heights as colours, as many as the terminal has.

use ratatui::style::Color;

/// Colours of a terminal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Depth {
    /// 24 bits.
    True,
    /// The 256 of xterm.
    Indexed,
    /// None: heights are shades of black and white.
    Mono,
}

impl Depth {
    /// What the environment says of the terminal.
    pub(super) fn of(variable: impl Fn(&str) -> Option<String>) -> Self {
        let told = |name| variable(name).unwrap_or_default();
        if !told("NO_COLOR").is_empty() {
            Self::Mono
        } else if matches!(told("COLORTERM").as_str(), "truecolor" | "24bit") {
            Self::True
        } else {
            Self::Indexed
        }
    }

    /// The colour of a share of the heights, 0 to 1.
    pub(super) fn colour(self, share: f64) -> Color {
        let colorous::Color { r, g, b } = colorous::VIRIDIS.eval_continuous(share.clamp(0.0, 1.0));
        match self {
            Self::True => Color::Rgb(r, g, b),
            Self::Indexed => Color::Indexed(indexed([r, g, b])),
            Self::Mono => Color::Reset,
        }
    }
}

/// The nearest of the cube of 6 x 6 x 6 colours that terminals have from number 16.
fn indexed(rgb: [u8; 3]) -> u8 {
    const LEVELS: [u8; 6] = [0, 95, 135, 175, 215, 255];
    let nearest = rgb.map(|channel| {
        let off = |level: &usize| LEVELS.get(*level).map_or(255, |l| l.abs_diff(channel));
        (0..LEVELS.len()).min_by_key(off).unwrap_or(0) as u8
    });
    16 + 36 * nearest[0] + 6 * nearest[1] + nearest[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_environment_tells_the_depth() {
        let depth = |told: &'static [(&'static str, &'static str)]| {
            Depth::of(|name| {
                let found = told.iter().find(|(known, _)| *known == name);
                found.map(|(_, value)| (*value).to_owned())
            })
        };
        assert_eq!(depth(&[]), Depth::Indexed);
        assert_eq!(depth(&[("COLORTERM", "truecolor")]), Depth::True);
        let both = &[("COLORTERM", "24bit"), ("NO_COLOR", "1")];
        assert_eq!(depth(both), Depth::Mono);
        assert_eq!(depth(&[("NO_COLOR", "")]), Depth::Indexed);
    }

    #[test]
    fn colours_are_the_nearest_of_256() {
        assert_eq!(indexed([0, 0, 0]), 16);
        assert_eq!(indexed([255, 255, 255]), 231);
        assert_eq!(indexed([254, 120, 90]), 16 + 36 * 5 + 6 * 2 + 1);
        assert_ne!(Depth::True.colour(0.0), Depth::True.colour(1.0));
        assert_eq!(
            Depth::True.colour(f64::NAN.max(0.0)),
            Depth::True.colour(0.0)
        );
    }
}
