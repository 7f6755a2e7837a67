//! NumPy's archive of arrays, `.npz`: a ZIP file of NPY files, stored or deflated, of which one is an image.
//!
//! Arrays of one axis, of no number or of text are none. Where several could be the image, one must be chosen by its
//! name. The archive of a mesh has the arrays `points` and `cells`.

use std::io::{Read, Seek};
use std::path::Path;

use zip::ZipArchive;
use zip::result::ZipError;

use super::codec::{Begins, Codec, Source};
use super::error::ReadReason;
use super::format::ImageFormat;
use super::note::{LoadedImage, ReadNote};
use super::npy::{Form, Header, read_array};
use super::stream::GZIP_RATIO;

const FORMAT: ImageFormat = ImageFormat::named("NPZ");

pub(super) const CODEC: Codec = Codec {
    endings: &[".npz"],
    begins: Begins::With(&[b"PK\x03\x04", b"PK\x05\x06"]),
    is_no_mesh: Some(is_image),
    ..Codec::reading(FORMAT, read)
};

/// The most arrays that are looked at.
const MOST_ARRAYS: usize = 1 << 12;

/// The names of arrays that a message lists.
const LISTED: usize = 20;

/// Whether the file at a path is an archive without a mesh.
fn is_image(path: &Path) -> bool {
    let archive = std::fs::File::open(path).ok().and_then(|file| ZipArchive::new(file).ok());
    archive.is_some_and(|archive| {
        let has = |name: &str| archive.index_for_name(name).is_some();
        !(has("points.npy") && has("cells.npy"))
    })
}

/// An array of the archive.
struct Array {
    /// Its place in the archive.
    index: usize,
    name: String,
    /// What it could be as an image; none if nothing.
    image: Option<(Header, Form)>,
    /// Its shape as NumPy writes it.
    shape: String,
}

/// Reads the only image, or that of the name that is asked for.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let Source { bytes, length, memory, options, .. } = source;
    let mut archive = ZipArchive::new(bytes).map_err(reason)?;
    let arrays = arrays(&mut archive)?;
    let wanted = options.array.as_deref();
    let mut images = arrays.iter().filter(|array| array.image.is_some());
    let chosen = match wanted {
        Some(wanted) => arrays.iter().find(|array| array.name == wanted),
        None => images.next().filter(|_| images.next().is_none()),
    };
    let Some(array) = chosen else {
        let listed = arrays.iter().take(LISTED).map(|a| format!("{} {}", a.name, a.shape));
        let mut found = listed.collect::<Vec<_>>().join(", ");
        if arrays.len() > LISTED {
            found += &format!(" and {} more", arrays.len() - LISTED);
        }
        return Err(ReadReason::Arrays { found, wanted: wanted.map(str::to_owned) });
    };
    let mut entry = archive.by_index(array.index).map_err(reason)?;
    let packed = entry.compressed_size().min(length);
    let (header, start) = Header::read(&mut entry)?;
    let form = Form::of(&header)?;
    let size = header.sample_type.size() as u64;
    let count = form.count(packed, GZIP_RATIO / size)?;
    let found = entry.size().saturating_sub(start) / size;
    if (count as u64) > found {
        return Err(ReadReason::Truncated { expected: count as u64, found });
    }
    let reserve = (packed / size).saturating_mul(4).min(count as u64) as usize;
    let loaded =
        read_array(&mut entry, &header, &form, [count, reserve], (memory, options.meaning))?;
    // the check sum is checked at the end
    let mut behind = [0];
    entry.read(&mut behind).map_err(|e| ReadReason::decoder(FORMAT, e))?;
    let others: Vec<_> = arrays
        .iter()
        .filter(|a| a.index != array.index)
        .map(|a| a.name.clone())
        .take(LISTED)
        .collect();
    let is_chosen = wanted.is_some();
    let note = ReadNote::OneArray { name: array.name.clone(), others, is_chosen };
    Ok(loaded.noting((is_chosen || arrays.len() > 1).then_some(note)))
}

/// The arrays of an archive, in its order.
fn arrays<R: Read + Seek>(archive: &mut ZipArchive<R>) -> Result<Vec<Array>, ReadReason> {
    let mut arrays = Vec::new();
    for index in 0..archive.len().min(MOST_ARRAYS) {
        let mut entry = archive.by_index(index).map_err(reason)?;
        let Some(name) = entry.name().strip_suffix(".npy").map(str::to_owned) else { continue };
        let header = Header::read(&mut entry).map(|(header, _)| header);
        let shape = header.as_ref().map_or("without a shape of numbers".into(), |header| {
            let mut numbers: Vec<_> = header.shape.iter().rev().map(usize::to_string).collect();
            if numbers.len() == 1 {
                numbers.push(String::new());
            }
            format!("({})", numbers.join(", ").trim_end())
        });
        let image =
            header.ok().and_then(|header| Form::of(&header).ok().map(|form| (header, form)));
        arrays.push(Array { index, name, image, shape });
    }
    Ok(arrays)
}

fn reason(error: ZipError) -> ReadReason {
    match error {
        ZipError::Io(error) => ReadReason::Io(error),
        other => ReadReason::decoder(FORMAT, other),
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Write};

    use atomesh::image::Samples;
    use atomesh::watch::Silent;
    use zip::write::{SimpleFileOptions, ZipWriter};

    use super::super::{ReadOptions, load_bytes};
    use super::*;

    fn npy(shape: &str, bytes: &[u8]) -> Vec<u8> {
        let text = format!("{{'descr': '|u1', 'fortran_order': False, 'shape': {shape}}}");
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend((text.len() as u16).to_le_bytes());
        [file, text.into_bytes(), bytes.to_vec()].concat()
    }

    fn archive(arrays: &[(&str, Vec<u8>)]) -> Vec<u8> {
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in arrays {
            zip.start_file(*name, SimpleFileOptions::default()).unwrap();
            zip.write_all(bytes).unwrap();
        }
        zip.finish().unwrap().into_inner()
    }

    fn load(bytes: &[u8], array: Option<&str>) -> Result<LoadedImage, ReadReason> {
        let options = ReadOptions { array: array.map(str::to_owned), ..ReadOptions::default() };
        load_bytes(bytes, FORMAT, &options, &mut Silent)
    }

    #[test]
    fn the_only_image_is_read_whatever_else_is_there() {
        let image = npy("(2, 3)", &[1, 2, 3, 4, 5, 6]);
        let loaded = load(&archive(&[("arr_0.npy", image.clone())]), None).unwrap();
        assert_eq!(*loaded.image.samples(), Samples::U8(vec![1, 2, 3, 4, 5, 6].into()));
        assert_eq!((loaded.image.shape(), loaded.notes), (vec![3, 2], vec![]));
        let more = archive(&[("spacing.npy", npy("(2,)", &[1, 1])), ("a.npy", image)]);
        let others = vec!["spacing".into()];
        let note = ReadNote::OneArray { name: "a".into(), others, is_chosen: false };
        assert_eq!(load(&more, None).unwrap().notes, [note]);
    }

    #[test]
    fn one_of_several_images_is_named() {
        let two = archive(&[
            ("ct.npy", npy("(2, 3)", &[1; 6])),
            ("lab.npy", npy("(2, 3)", &[2; 6])),
            ("n.npy", npy("()", &[2])),
        ]);
        let text = load(&two, None).unwrap_err().to_string();
        assert_eq!(text, "holds the arrays ct (2, 3), lab (2, 3), n (); expected one");
        assert_eq!(load(&two, Some("lab")).unwrap().image.samples().get(5), 2.0);
        assert!(
            load(&two, Some("x")).unwrap_err().to_string().ends_with("expected one, not \"x\"")
        );
        assert!(load(&two, Some("n")).is_err());
    }

    #[test]
    fn broken_archives_are_refused() {
        let whole = archive(&[("a.npy", npy("(20, 30)", &[7; 600]))]);
        assert!(load(&whole, None).is_ok());
        assert!((1..whole.len()).all(|length| load(&whole[..length], None).is_err()));
        let absurd = archive(&[("a.npy", npy("(1000000, 1000000)", &[7; 9]))]);
        let text = load(&absurd, None).unwrap_err().to_string();
        assert!(text.contains("more than a file"), "{text}");
        let short = archive(&[("a.npy", npy("(20, 30)", &[7; 599]))]);
        assert!(matches!(load(&short, None), Err(ReadReason::Truncated { found: 599, .. })));
    }
}
