//! NIfTI in two files: a header, `.hdr`, and beside it the samples, `.img`.

use std::fs::File;

use super::super::detached::DataFolders;
use super::super::error::ReadReason;
use super::FORMAT;

/// The names of the two files, one of which was named by the caller.
#[derive(Debug, PartialEq)]
pub(super) struct Pair {
    /// The names that the header may have, the likeliest first.
    pub header: Vec<String>,
    /// The same of the samples.
    pub samples: Vec<String>,
    /// Whether the caller named the file of samples.
    pub is_samples: bool,
}

/// The names of a pair, if that of one of its files is `name`. The other may be gzipped where this one is not.
pub(super) fn names(name: &str) -> Option<Pair> {
    let lower = name.to_ascii_lowercase();
    let (stem, gz) = match lower.ends_with(".gz") {
        true => name.split_at(name.len() - 3),
        false => (name, ""),
    };
    let (stem, ending) = stem.split_at_checked(stem.len().checked_sub(4)?)?;
    let is_samples = match ending.to_ascii_lowercase().as_str() {
        ".hdr" => false,
        ".img" => true,
        _ => return None,
    };
    let is_upper = ending.chars().any(|c| c.is_ascii_uppercase());
    let other_gz = if gz.is_empty() { ".gz" } else { "" };
    let both = |ending: &str| {
        let ending = if is_upper { ending.to_ascii_uppercase() } else { ending.to_owned() };
        vec![format!("{stem}{ending}{gz}"), format!("{stem}{ending}{other_gz}")]
    };
    Some(Pair { header: both(".hdr"), samples: both(".img"), is_samples })
}

impl Pair {
    /// Opens one of the two files, which the caller did not name, with its length.
    ///
    /// # Errors
    /// [`ReadReason::DataFile`] if it is not there, by its likeliest name.
    pub fn open(
        &self,
        folders: Option<DataFolders>,
        names: &[String],
    ) -> Result<(File, u64), ReadReason> {
        let Some(folders) = folders else {
            return Err(ReadReason::Unsupported {
                format: FORMAT,
                found: "a header without samples".into(),
                expected: "both in one file where there is no folder",
            });
        };
        let first = folders.open(&names[0]);
        match &first {
            Err(ReadReason::DataFile { .. }) => {
                names[1..].iter().find_map(|name| folders.open(name).ok()).map_or(first, Ok)
            }
            _ => first,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn either_name_tells_the_other() {
        let pair = names("A.b.HDR").unwrap();
        assert_eq!(pair.samples, ["A.b.IMG", "A.b.IMG.gz"]);
        assert!(!pair.is_samples);
        let pair = names("x.img.gz").unwrap();
        assert_eq!(pair.header, ["x.hdr.gz", "x.hdr"]);
        assert!(pair.is_samples);
        for other in ["x.nii", "hdr", "", "µ.gz", "x.nii.gz"] {
            assert_eq!(names(other), None, "{other}");
        }
    }
}
