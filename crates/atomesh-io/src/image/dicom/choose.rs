//! Which of several series is read.

use std::collections::BTreeMap;

use super::super::error::ReadReason;
use super::super::series_error::SeriesError;
use super::header::{Found, Header, SeriesName};

/// The most series in a message.
const NAMED: usize = 12;

/// The files of one series, each with its name.
pub(super) struct Chosen {
    pub files: Vec<(String, Header)>,
    pub name: SeriesName,
    /// How many series there are.
    pub count: usize,
}

/// The one series that there is, or the one that is wanted: by its identifier, its number or its description. `others` are
/// files without an image.
pub(super) fn choose(
    files: Vec<(String, Found)>,
    wanted: Option<&str>,
    others: usize,
) -> Result<Chosen, ReadReason> {
    // some write the number and the description of a series otherwise in each file
    let mut all: BTreeMap<&str, (&SeriesName, usize, &str)> = BTreeMap::new();
    for (file, found) in &files {
        let first = (&found.series, 0, file.as_str());
        all.entry(&found.series.uid).or_insert(first).1 += 1;
    }
    if all.is_empty() {
        return Err(SeriesError::NoImages { others }.into());
    }
    let is_wanted = |name: &&SeriesName| wanted.is_none_or(|wanted| name.is(wanted));
    let found: Vec<_> = all.values().map(|(name, ..)| *name).filter(is_wanted).collect();
    let (count, series) = (all.len(), list(&all));
    let [name] = found[..] else {
        return Err(match wanted {
            Some(wanted) if found.is_empty() => {
                SeriesError::NoSuchSeries { wanted: wanted.into(), series }.into()
            }
            _ => SeriesError::SeveralSeries { series }.into(),
        });
    };
    let name = name.clone();
    let own = files.into_iter().filter(|(_, found)| found.series.uid == name.uid);
    let header = |(file, found): (String, Found)| match found.header {
        Ok(header) => Ok((file, header)),
        Err(reason) => Err(in_file(&file, reason)),
    };
    let files = own.map(header).collect::<Result<_, _>>()?;
    Ok(Chosen { files, name, count })
}

/// The error of one of several files, which have names.
pub(super) fn in_file(file: &str, reason: ReadReason) -> ReadReason {
    match reason {
        ReadReason::Cancelled(_) => reason,
        _ if file.is_empty() => reason,
        _ => ReadReason::Slice { file: file.into(), reason: Box::new(reason) },
    }
}

impl SeriesName {
    /// Whether a user means this series.
    fn is(&self, wanted: &str) -> bool {
        let wanted = wanted.trim();
        let number = |text: &str| text.parse::<i64>().ok();
        wanted == self.uid
            || number(wanted).is_some() && number(wanted) == number(&self.number)
            || !self.description.is_empty()
                && wanted.to_lowercase() == self.description.to_lowercase()
    }

    /// Its number and description as far as they are known, for messages.
    pub fn text(&self) -> String {
        let number = if self.number.is_empty() { "" } else { &format!(", number {}", self.number) };
        let description = match self.description.as_str() {
            "" => String::new(),
            text => format!(", {text:?}"),
        };
        format!("{}{number}{description}", self.uid)
    }
}

/// The series with their files, for messages.
fn list(all: &BTreeMap<&str, (&SeriesName, usize, &str)>) -> String {
    let text = |(name, count, file): &(&SeriesName, usize, &str)| {
        format!("{} ({count} files, such as {file})", name.text())
    };
    let mut texts: Vec<_> = all.values().take(NAMED).map(text).collect();
    if all.len() > texts.len() {
        texts.push(format!("{} more", all.len() - texts.len()));
    }
    texts.join("; ")
}
