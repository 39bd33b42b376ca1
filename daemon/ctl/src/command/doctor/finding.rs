//! What a check found.

use std::borrow::Cow;
use std::fmt;

use reliefd::config::NamedScanner;
use serde::Serialize;

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Grade {
    /// As it should be.
    Good,
    /// May lead to trouble.
    Doubtful,
    /// Does not work.
    Bad,
}

/// What a check found, and what to do about it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Finding {
    pub(super) check: Cow<'static, str>,
    pub(super) grade: Grade,
    pub(super) found: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) remedy: Option<String>,
}

impl Finding {
    pub(super) fn good(check: &'static str, found: impl Into<String>) -> Self {
        Self {
            check: check.into(),
            grade: Grade::Good,
            found: found.into(),
            remedy: None,
        }
    }

    pub(super) fn doubtful(
        check: &'static str,
        found: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self {
            grade: Grade::Doubtful,
            ..Self::bad(check, found, remedy)
        }
    }

    pub(super) fn bad(
        check: &'static str,
        found: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self {
            check: check.into(),
            grade: Grade::Bad,
            found: found.into(),
            remedy: Some(remedy.into()),
        }
    }

    /// The same of one of several scanners. Keys in the remedy are those of `[scanner]`; this
    /// one has a section of its own.
    pub(super) fn of(mut self, scanner: &NamedScanner<'_>) -> Self {
        if !scanner.is_the_only {
            let section = scanner.section();
            self.check = format!("{} of {}", self.check, scanner.name).into();
            self.remedy = self
                .remedy
                .map(|remedy| remedy.replace(" scanner.", &format!(" {section}.")));
        }
        self
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mark = match self.grade {
            Grade::Good => "ok      ",
            Grade::Doubtful => "doubtful",
            Grade::Bad => "TROUBLE ",
        };
        write!(f, "{mark}  {}: {}", self.check, self.found)?;
        match &self.remedy {
            Some(remedy) => write!(f, "\n          -> {remedy}"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use reliefd::Config;

    use super::*;

    #[test]
    fn what_is_told_of_one_of_several_scanners_names_it_and_its_section() {
        let finding = || {
            Finding::bad(
                "port",
                "there is none",
                "set scanner.port, or copy 60-relief-scanner.rules",
            )
        };
        let mut config = Config::default();
        assert_eq!(finding().of(&config.each_scanner()[0]), finding());
        config
            .scanners
            .insert("left".into(), config.scanner.clone());
        let told = finding().of(&config.each_scanner()[0]);
        assert_eq!(told.check, "port of left");
        assert_eq!(
            told.remedy.as_deref(),
            Some("set scanners.left.port, or copy 60-relief-scanner.rules")
        );
    }
}
