//! What was understood of a file so far, and what was not.

use std::{collections::BTreeMap, ops::Range};

use shm_schema::profile::Profile;

use crate::{
    check,
    diagnostic::{Diagnostic, Position},
    set::AxisSet,
};

/// One axis with values as wide as the file wrote them, so that rules can judge them.
#[derive(Debug)]
pub(crate) struct DraftAxis {
    pub number: u8,
    pub profile: Profile,
    pub serial: String,
    pub values: BTreeMap<u32, i64>,
    pub named: BTreeMap<u32, Position>,
    /// Values outside the range of their parameter, which a rule may take over.
    pub outside: Vec<(u32, Diagnostic)>,
}

/// A whole file.
#[derive(Debug)]
pub(crate) struct Draft {
    pub axes: Vec<DraftAxis>,
    pub diagnostics: Vec<Diagnostic>,
}

impl DraftAxis {
    pub(crate) fn set(&self) -> AxisSet {
        AxisSet {
            number: self.number,
            profile: self.profile,
            serial: self.serial.clone(),
            values: self.values.iter().map(|(key, value)| (*key, *value as i32)).collect(),
            named: self.named.clone(),
        }
    }
}

impl Draft {
    /// Everything that keeps this file from becoming an image, in the order of the file. A value
    /// that a plausibility row of AMK refuses does not: the channels answer it with its code.
    pub(crate) fn refusals(&self) -> Vec<Diagnostic> {
        let mut all = self.diagnostics.clone();
        for axis in &self.axes {
            let fits = |key: &u32| axis.values.get(key).is_some_and(|value| i32::try_from(*value).is_ok());
            let accepted =
                |key: &u32| axis.profile == Profile::AmkKw && fits(key) && check::ruled(axis, *key);
            let outside = axis.outside.iter().filter(|(key, _)| !accepted(key));
            all.extend(outside.map(|(_, diagnostic)| diagnostic.clone()));
        }
        all.sort_by_key(|diagnostic| diagnostic.position);
        all
    }
}

/// Collects diagnostics while a file is read.
pub(crate) struct Reader<'a> {
    text: &'a str,
    file: &'a str,
    diagnostics: Vec<Diagnostic>,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(text: &'a str, file: &'a str) -> Self {
        Self { text, file, diagnostics: Vec::new() }
    }

    pub(crate) fn position(&self, span: Option<Range<usize>>) -> Position {
        Position::of(self.text, span.map_or(0, |span| span.start))
    }

    pub(crate) fn diagnostic(
        &self,
        span: Option<Range<usize>>,
        message: impl Into<String>,
        expected: impl Into<String>,
    ) -> Diagnostic {
        Diagnostic {
            file: self.file.into(),
            position: self.position(span),
            message: message.into(),
            expected: expected.into(),
        }
    }

    pub(crate) fn refuse(
        &mut self,
        span: Option<Range<usize>>,
        message: impl Into<String>,
        expected: impl Into<String>,
    ) {
        let diagnostic = self.diagnostic(span, message, expected);
        self.diagnostics.push(diagnostic);
    }

    pub(crate) fn push(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// Refuses every key of a table that is not one of the known ones.
    pub(crate) fn refuse_others(&mut self, table: &toml_edit::Table, known: &[&str], expected: &str) {
        for (name, _) in table.iter().filter(|(name, _)| !known.contains(name)) {
            let span = table.get_key_value(name).and_then(|(key, _)| key.span());
            let near = crate::text::nearest(name, known.iter().copied());
            let expected = near.map_or(expected.to_string(), |near| format!("{near}?"));
            self.refuse(span, format!("unknown key {name}"), expected);
        }
    }

    pub(crate) fn finish(self) -> Vec<Diagnostic> {
        self.diagnostics
    }
}
