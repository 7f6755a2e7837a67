//! DICOM files of all kinds, made here element by element.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::Path;

use atomesh::watch::Silent;
use atomesh_io::image::{
    AnyImage, LoadedImage, ReadError, ReadOptions, ReadReason, decode_image, load_image,
};

mod frames;
mod geometry;
mod hostile;
mod packed;
mod segments;
mod series;

/// An element of explicit representation, least byte first.
fn element(tag: u32, kind: &str, value: &[u8]) -> Vec<u8> {
    let mut bytes = vec![(tag >> 16) as u8, (tag >> 24) as u8, tag as u8, (tag >> 8) as u8];
    bytes.extend(kind.as_bytes());
    let padding = if ["UI", "OB", "OW"].contains(&kind) { 0 } else { b' ' };
    let value = [value, &vec![padding; value.len() % 2]].concat();
    if ["OB", "OW", "SQ", "UN"].contains(&kind) {
        bytes.extend([0, 0]);
        bytes.extend((value.len() as u32).to_le_bytes());
    } else {
        bytes.extend((value.len() as u16).to_le_bytes());
    }
    [bytes, value].concat()
}

/// A sequence of items, each its elements.
fn sequence(tag: u32, items: &[Vec<u8>]) -> Vec<u8> {
    let item = |elements: &Vec<u8>| {
        let length = (elements.len() as u32).to_le_bytes();
        [&b"\xfe\xff\x00\xe0"[..], &length, elements].concat()
    };
    element(tag, "SQ", &items.iter().flat_map(item).collect::<Vec<_>>())
}

/// Numbers as a text.
fn list(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join("\\")
}

/// A file whose elements tests put in place of others.
#[derive(Clone)]
struct File {
    elements: BTreeMap<u32, Vec<u8>>,
}

impl File {
    /// A slice of `shape` samples of 16 bits, 1.2 × 0.8 apart, at a height.
    fn of(shape: [u16; 2], samples: &[u16], height: f64) -> Self {
        let mut file = Self { elements: BTreeMap::new() };
        file.text(0x0002_0010, "UI", "1.2.840.10008.1.2.1");
        file.text(0x0020_000e, "UI", "1.2.3");
        file.text(0x0020_0032, "DS", &list(&[10.0, -20.0, height]));
        file.text(0x0020_0037, "DS", "1\\0\\0\\0\\1\\0");
        file.short(0x0028_0002, 1);
        file.text(0x0028_0004, "CS", "MONOCHROME2");
        file.short(0x0028_0010, shape[1]);
        file.short(0x0028_0011, shape[0]);
        file.text(0x0028_0030, "DS", "0.8\\1.2");
        file.bits(16, 16, false);
        let bytes: Vec<u8> = samples.iter().flat_map(|v| v.to_le_bytes()).collect();
        file.put(element(0x7fe0_0010, "OW", &bytes));
        file
    }

    fn put(&mut self, bytes: Vec<u8>) {
        let tag = [bytes[1], bytes[0], bytes[3], bytes[2]];
        self.elements.insert(u32::from_be_bytes(tag), bytes);
    }

    fn text(&mut self, tag: u32, kind: &str, text: &str) {
        self.put(element(tag, kind, text.as_bytes()));
    }

    fn short(&mut self, tag: u32, value: u16) {
        self.put(element(tag, "US", &value.to_le_bytes()));
    }

    fn without(&mut self, tags: &[u32]) {
        tags.iter().for_each(|tag| drop(self.elements.remove(tag)));
    }

    fn bits(&mut self, allocated: u16, stored: u16, is_signed: bool) {
        self.short(0x0028_0100, allocated);
        self.short(0x0028_0101, stored);
        self.short(0x0028_0102, stored - 1);
        self.short(0x0028_0103, is_signed.into());
    }

    /// Packed frames, each in fragments, with a table of offsets or an empty one.
    fn pack(&mut self, syntax: &str, frames: &[&[&[u8]]], has_table: bool) {
        self.text(0x0002_0010, "UI", &format!("1.2.840.10008.1.2.{syntax}"));
        let mut fragments = Vec::new();
        let mut table: Vec<u8> = Vec::new();
        for frame in frames {
            table.extend((fragments.len() as u32).to_le_bytes());
            for part in *frame {
                fragments.extend(b"\xfe\xff\x00\xe0");
                fragments.extend((part.len().next_multiple_of(2) as u32).to_le_bytes());
                fragments.extend([part, &vec![0; part.len() % 2][..]].concat());
            }
        }
        let table = if has_table { table } else { Vec::new() };
        let length = (table.len() as u32).to_le_bytes();
        let pixels = [
            &b"\xe0\x7f\x10\x00OB\0\0\xff\xff\xff\xff\xfe\xff\x00\xe0"[..],
            &length,
            &table,
            &fragments,
            b"\xfe\xff\xdd\xe0\0\0\0\0",
        ];
        self.put(pixels.concat());
    }

    fn bytes(&self) -> Vec<u8> {
        [vec![0; 128], b"DICM".to_vec(), self.elements.values().flatten().copied().collect()]
            .concat()
    }

    /// The same with all behind the meta elements deflated.
    fn deflated(&self) -> Vec<u8> {
        let mut file = self.clone();
        file.text(0x0002_0010, "UI", "1.2.840.10008.1.2.1.99");
        let meta = file.elements.remove(&0x0002_0010).unwrap();
        let rest: Vec<u8> = file.elements.values().flatten().copied().collect();
        let mut packed = flate2::write::DeflateEncoder::new(Vec::new(), Default::default());
        packed.write_all(&rest).unwrap();
        [vec![0; 128], b"DICM".to_vec(), meta, packed.finish().unwrap()].concat()
    }
}

/// A folder of files with names.
fn folder<'a>(files: impl IntoIterator<Item = (&'a str, Vec<u8>)>) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    folder
}

/// Three slices of 3 × 2 samples that tell every place, 2.5 apart; named against their order.
fn three() -> [(&'static str, File); 3] {
    let slice =
        |k: u16| File::of([3, 2], &[0, 1, 2, 3, 4, 5].map(|v| 10 * k + v), f64::from(k) * 2.5);
    [("c.dcm", slice(0)), ("b", slice(1)), ("a.17", slice(2))]
}

fn whole(files: &[(&'static str, File)]) -> Vec<(&'static str, Vec<u8>)> {
    files.iter().map(|(name, file)| (*name, file.bytes())).collect()
}

fn load_with(path: &Path, options: &ReadOptions) -> Result<LoadedImage, ReadError> {
    load_image(path, options, &mut Silent)
}

fn load(path: &Path) -> Result<LoadedImage, ReadError> {
    load_with(path, &ReadOptions::default())
}

fn decode(bytes: &[u8]) -> Result<AnyImage, ReadReason> {
    let format = atomesh_io::image::ImageFormat::DICOM;
    decode_image(bytes, format, &ReadOptions::default(), &mut Silent)
}

fn numbers(image: &AnyImage) -> Vec<f64> {
    (0..image.samples().len()).map(|k| image.samples().get(k)).collect()
}

fn near(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{found:?}, not {expected:?}");
    let is_near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6);
    assert!(is_near, "{found:?}, not {expected:?}");
}
