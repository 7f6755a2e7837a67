//! Which of several series is read.

use std::collections::BTreeMap;

use super::super::series_error::SeriesError;
use super::header::{Header, SeriesName};

/// The most series in a message.
const NAMED: usize = 12;

/// The files of the one series that there is, or of the one that is wanted: by its identifier, its number or its
/// description. Also how many series there are.
pub(super) fn choose(
    files: Vec<(String, Header)>,
    wanted: Option<&str>,
    others: usize,
) -> Result<(Vec<(String, Header)>, usize), SeriesError> {
    let mut all: BTreeMap<SeriesName, (usize, &str)> = BTreeMap::new();
    for (file, header) in &files {
        // some write the name of a series otherwise in each file
        let known = all.keys().find(|name| name.uid == header.series.uid).cloned();
        let name = known.unwrap_or_else(|| header.series.clone());
        all.entry(name).or_insert((0, file.as_str())).0 += 1;
    }
    if all.is_empty() {
        return Err(SeriesError::NoImages { others });
    }
    let is_wanted = |name: &&SeriesName| wanted.is_none_or(|wanted| name.is(wanted));
    let found: Vec<_> = all.keys().filter(is_wanted).map(|name| name.uid.clone()).collect();
    let (count, list) = (all.len(), list(&all));
    let [uid] = &found[..] else {
        return Err(match wanted {
            Some(wanted) if found.is_empty() => {
                SeriesError::NoSuchSeries { wanted: wanted.into(), series: list }
            }
            _ => SeriesError::SeveralSeries { series: list },
        });
    };
    let uid = uid.clone();
    Ok((files.into_iter().filter(|(_, header)| header.series.uid == uid).collect(), count))
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
fn list(all: &BTreeMap<SeriesName, (usize, &str)>) -> String {
    let text = |(name, (count, file)): (&SeriesName, &(usize, &str))| {
        format!("{} ({count} files, such as {file})", name.text())
    };
    let mut texts: Vec<_> = all.iter().take(NAMED).map(text).collect();
    if all.len() > texts.len() {
        texts.push(format!("{} more", all.len() - texts.len()));
    }
    texts.join("; ")
}
