//! What a scan's owner should know: one shape for every warning and every error, so that the page, the command
//! line and the doctor can all show them alike.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

/// How much a [`Finding`] matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Something was assumed or chosen; the result does not suffer.
    Info,
    /// The result may suffer, or a part of the scan is not used.
    Warning,
    /// A part of the scan is broken and is not used.
    Error,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Severity::Info => "info",
            Severity::Warning => "warning",
            Severity::Error => "error",
        })
    }
}

/// One observation about a scan: where, what was expected, what was found, what to do.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// How much it matters.
    pub severity: Severity,
    /// A stable word for programs, such as `pose-not-finite`.
    pub code: &'static str,
    /// The file it is about, as a path inside the scan.
    pub file: Option<String>,
    /// The line in that file, counted from 1.
    pub line: Option<u32>,
    /// What was expected.
    pub expected: String,
    /// What was found instead.
    pub found: String,
    /// What the user can do.
    pub advice: String,
    /// How many frames it touches.
    pub frames_affected: usize,
}

impl Finding {
    pub(crate) fn new(severity: Severity, code: &'static str) -> Self {
        Finding {
            severity,
            code,
            file: None,
            line: None,
            expected: String::new(),
            found: String::new(),
            advice: String::new(),
            frames_affected: 0,
        }
    }

    pub(crate) fn at(mut self, file: impl Into<String>) -> Self {
        self.file = Some(file.into());
        self
    }

    pub(crate) fn line(mut self, line: u32) -> Self {
        self.line = Some(line);
        self
    }

    pub(crate) fn expected(mut self, text: impl Into<String>) -> Self {
        self.expected = text.into();
        self
    }

    pub(crate) fn found(mut self, text: impl Into<String>) -> Self {
        self.found = text.into();
        self
    }

    pub(crate) fn advice(mut self, text: impl Into<String>) -> Self {
        self.advice = text.into();
        self
    }

    pub(crate) fn frames(mut self, count: usize) -> Self {
        self.frames_affected = count;
        self
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.file, self.line) {
            (Some(file), Some(line)) => write!(f, "{file}:{line}: ")?,
            (Some(file), None) => write!(f, "{file}: ")?,
            _ => {}
        }
        write!(
            f,
            "expected {}, found {}. {}",
            self.expected, self.found, self.advice
        )
    }
}

/// Collects findings and keeps the list readable: the first few of a kind stand alone, the rest become one line.
#[derive(Debug, Default)]
pub(crate) struct FindingLog {
    listed: Vec<Finding>,
    per_code: BTreeMap<&'static str, Repeats>,
}

#[derive(Debug, Default)]
struct Repeats {
    seen: usize,
    folded: usize,
    frames_folded: usize,
}

impl FindingLog {
    const LISTED_PER_CODE: usize = 8;

    pub(crate) fn add(&mut self, finding: Finding) {
        let repeats = self.per_code.entry(finding.code).or_default();
        repeats.seen += 1;
        if repeats.seen <= Self::LISTED_PER_CODE {
            self.listed.push(finding);
        } else {
            repeats.folded += 1;
            repeats.frames_folded += finding.frames_affected;
        }
    }

    pub(crate) fn extend(&mut self, findings: impl IntoIterator<Item = Finding>) {
        findings.into_iter().for_each(|finding| self.add(finding));
    }

    pub(crate) fn first_error_in(&self, file: &str) -> Option<&Finding> {
        self.listed.iter().find(|finding| {
            finding.severity == Severity::Error && finding.file.as_deref() == Some(file)
        })
    }

    /// The list, worst first.
    pub(crate) fn finish(self) -> Vec<Finding> {
        let mut list = self.listed;
        for (code, repeats) in self.per_code.iter().filter(|(_, r)| r.folded > 0) {
            if let Some(like) = list.iter().find(|finding| finding.code == *code).cloned() {
                let file = like.file.as_deref().unwrap_or("this scan").to_owned();
                list.push(Finding {
                    file: None,
                    line: None,
                    found: format!("{} more like that of {file}", repeats.folded),
                    frames_affected: repeats.frames_folded,
                    ..like
                });
            }
        }
        list.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
        list
    }
}
