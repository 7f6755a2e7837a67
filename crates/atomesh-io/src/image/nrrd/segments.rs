//! The segments of 3D Slicer's segmentations: names, and which value in which layer each has.
//!
//! Definition: <https://slicer.readthedocs.io/en/latest/developer_guide/modules/segmentations.html>. A segment has keys
//! `Segment0_Name`, `Segment0_LabelValue`, `Segment0_Layer` and others. A file before layers had one for each segment.

use std::collections::BTreeMap;

use atomesh::image::Samples;

use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::super::note::ReadNote;

/// The segments that a message lists.
const LISTED: usize = 50;

/// A segment.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Segment {
    pub name: String,
    id: Option<String>,
    /// The value of its samples; 1 if the header does not say it.
    value: Option<f64>,
    layer: Option<usize>,
}

/// The segments that keys of a header name, in the order of their numbers.
pub(super) fn of_keys(keys: &[(String, String)]) -> Vec<Segment> {
    let mut segments = BTreeMap::<usize, Segment>::new();
    for (key, value) in keys {
        let Some((number, field)) = key.strip_prefix("Segment").and_then(|k| k.split_once('_'))
        else {
            continue;
        };
        let Ok(number) = number.parse() else { continue };
        let named = || Segment { name: format!("Segment{number}"), ..Segment::default() };
        let segment = segments.entry(number).or_insert_with(named);
        let value = value.trim();
        match field {
            "Name" => segment.name = value.into(),
            "ID" => segment.id = Some(value.into()),
            "LabelValue" => segment.value = value.parse().ok(),
            "Layer" => segment.layer = value.parse().ok(),
            _ => {}
        }
    }
    // without layers each segment is one
    let at = |(place, segment): (usize, Segment)| Segment {
        layer: segment.layer.or(Some(place)),
        ..segment
    };
    segments.into_values().enumerate().map(at).collect()
}

/// The segment that is wanted.
#[derive(Debug)]
pub(super) struct Chosen<'a> {
    pub segment: &'a Segment,
    /// Its number, from 1, and how many there are.
    number: usize,
    count: usize,
}

/// The segment of a name or a number from 1; none if all of them are wanted, as labels, or the file has none.
///
/// # Errors
/// [`ReadReason::Segments`] if it is not there, or there are several layers and none is wanted.
pub(super) fn chosen<'a>(
    segments: &'a [Segment],
    layers: usize,
    wanted: Option<&str>,
) -> Result<Option<Chosen<'a>>, ReadReason> {
    let count = segments.len();
    let refusal = || {
        let listed = segments.iter().take(LISTED).zip(1..);
        let listed: Vec<_> = listed.map(|(segment, n)| format!("{n} {}", segment.name)).collect();
        let mut found = listed.join(", ");
        if count > LISTED {
            found += &format!(" and {} more", count - LISTED);
        }
        ReadReason::Segments { found, layers, wanted: wanted.map(str::to_owned) }
    };
    let Some(name) = wanted.filter(|_| count > 0) else {
        return if layers > 1 { Err(refusal()) } else { Ok(None) };
    };
    let named = |s: &Segment| s.name == name || s.id.as_deref() == Some(name);
    let numbered =
        || name.parse::<usize>().ok().and_then(|n| n.checked_sub(1)).filter(|&n| n < count);
    let at = segments.iter().position(named).or_else(numbered).ok_or_else(refusal)?;
    let segment = &segments[at];
    match segment.layer {
        Some(layer) if layers > 1 && layer >= layers => Err(refusal()),
        _ => Ok(Some(Chosen { segment, number: at + 1, count })),
    }
}

impl Chosen<'_> {
    /// What there is to note.
    pub fn note(&self) -> ReadNote {
        let Self { segment, number, count } = *self;
        ReadNote::Segment { name: segment.name.clone(), number, count }
    }
}

impl Segment {
    /// 1 in the segment and 0 elsewhere, of samples of so many layers each.
    pub fn inside(
        &self,
        stored: &Samples,
        layers: usize,
        memory: Memory,
    ) -> Result<Samples, ReadReason> {
        let layer = if layers > 1 { self.layer.unwrap_or(0) } else { 0 };
        let value = self.value.unwrap_or(1.0);
        let mut inside: Vec<u8> = memory.zeros(stored.len() / layers)?;
        for (k, flag) in inside.iter_mut().enumerate() {
            *flag = u8::from(stored.get(k * layers + layer) == value);
        }
        Ok(Samples::U8(inside.into()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{ReadOptions, load_bytes};
    use super::super::FORMAT;
    use super::*;
    use crate::image::LoadedImage;
    use atomesh::watch::Silent;

    const TWO: &str = "Segment0_Name:=bone\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n\
                       Segment1_ID:=skin_1\nSegment1_LabelValue:=7\nSegment1_Layer:=1\n";

    fn load(
        layers: usize,
        keys: &str,
        bytes: &[u8],
        segment: Option<&str>,
    ) -> Result<LoadedImage, ReadReason> {
        let list = if layers > 1 { "list " } else { "" };
        let none = if layers > 1 { "none " } else { "" };
        let sizes = if layers > 1 { format!("{layers} ") } else { String::new() };
        let dimension = if layers > 1 { 3 } else { 2 };
        let file = format!(
            "NRRD0005\ntype: uchar\ndimension: {dimension}\nspace dimension: 2\nsizes: {sizes}2 2\n\
             space directions: {none}(1,0) (0,1)\nkinds: {list}domain domain\nencoding: raw\n{keys}\n"
        );
        let options = ReadOptions { segment: segment.map(str::to_owned), ..ReadOptions::default() };
        load_bytes(&[file.as_bytes(), bytes].concat(), FORMAT, &options, &mut Silent)
    }

    #[test]
    fn one_of_segments_that_overlap_is_chosen() {
        let bytes = [1, 0, 1, 7, 0, 7, 0, 0];
        let text = load(2, TWO, &bytes, None).unwrap_err().to_string();
        assert_eq!(text, "holds the segments 1 bone, 2 Segment1, which overlap; expected one");
        for (name, expected) in [
            ("bone", [1, 1, 0, 0]),
            ("1", [1, 1, 0, 0]),
            ("2", [0, 1, 1, 0]),
            ("skin_1", [0, 1, 1, 0]),
        ] {
            let loaded = load(2, TWO, &bytes, Some(name)).unwrap();
            assert_eq!(*loaded.image.samples(), Samples::U8(expected.to_vec().into()), "{name}");
            assert!(loaded.notes[0].to_string().starts_with("segment "), "{:?}", loaded.notes);
        }
        for odd in ["0", "3", "brain", ""] {
            assert!(
                load(2, TWO, &bytes, Some(odd))
                    .unwrap_err()
                    .to_string()
                    .contains("expected one, not")
            );
        }
        assert!(matches!(load(2, TWO, &bytes[..7], Some("1")), Err(ReadReason::Truncated { .. })));
    }

    #[test]
    fn segments_that_do_not_overlap_are_labels_or_one_of_them() {
        let bytes = [1, 7, 7, 0];
        let all = load(1, TWO, &bytes, None).unwrap();
        assert_eq!(*all.image.samples(), Samples::U8(bytes.to_vec().into()));
        let one = load(1, TWO, &bytes, Some("skin_1")).unwrap();
        assert_eq!(*one.image.samples(), Samples::U8(vec![0, 1, 1, 0].into()));
        let none = load(1, "key:=value\n", &bytes, Some("bone")).unwrap();
        assert!(
            none.notes.contains(&ReadNote::NoSegments { wanted: "bone".into() }),
            "{:?}",
            none.notes
        );
    }
}
