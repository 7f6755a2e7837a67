//! A folder with the files of a scan.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use atomesh::watch::{Phase, Watch, check};

use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::super::note::LoadedImage;
use super::super::options::{GivenFrame, ReadOptions};
use super::super::scan_note::ScanNote;
use super::choose::in_file;
use super::frames::Frames;
use super::header::{Found, Header};
use super::is_dicom;
use super::reader::Reader;
use super::volume::{Scan, Wishes};

/// How deep folders are looked into; the media of scanners have four levels.
const DEEPEST: usize = 8;

/// The most folders that are looked into.
const MOST_FOLDERS: usize = 10_000;

/// Reads the slices in a folder, or those below it if it has none.
pub(super) fn read(
    folder: &Path,
    options: &ReadOptions,
    watch: &mut dyn Watch,
) -> Result<LoadedImage, ReadReason> {
    let wishes = Wishes::of(options, Memory::up_to(options.memory_limit));
    let (mut files, mut others) = headers(folder, files_in(folder)?, wishes.given, watch)?;
    let is_below = files.is_empty();
    if is_below {
        let (found, more) = headers(folder, files_below(folder)?, wishes.given, watch)?;
        (files, others) = (found, others + more);
    }
    let scan = Scan::new(files, others, &wishes)?;
    let count = scan.frame_count();
    let mut done = 0;
    // the frames of a file follow each other, so that it stays open
    let mut open: Option<(usize, Frames<File>)> = None;
    let mut values = |header: &Header, (file, frame): (usize, usize)| {
        check(watch, Phase::Read, (0.1 + 0.9 * done as f64 / count as f64).min(1.0), None)?;
        done += 1;
        let name = scan.file(file);
        let mut read = || {
            let frames = match open.take() {
                Some((of, frames)) if of == file => frames,
                _ => Frames::again(reader(&folder.join(name))?, header)?,
            };
            let (_, frames) = open.insert((file, frames));
            frames.values(header, frame, wishes.memory)
        };
        read().map_err(|reason| in_file(name, reason))
    };
    let mut loaded = scan.load(&wishes, &mut values)?;
    if is_below {
        let of = |file: usize| Path::new(scan.file(file)).parent().map(Path::to_path_buf);
        let mut folders: Vec<String> =
            (0..scan.file_count()).filter_map(of).map(|p| p.display().to_string()).collect();
        folders.dedup();
        let folder = match &folders[..] {
            [only] => only.clone(),
            all => format!("{} folders, such as {}", all.len(), all[0]),
        };
        loaded.notes.insert(0, ScanNote::Below { folder }.into());
    }
    Ok(loaded)
}

/// The names of the files in a folder; links are followed.
fn files_in(folder: &Path) -> Result<Vec<PathBuf>, ReadReason> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(ReadReason::Io)? {
        let entry = entry.map_err(ReadReason::Io)?;
        if entry.path().is_file() {
            names.push(entry.file_name().into());
        }
    }
    names.sort();
    Ok(names)
}

/// The files in the folders below a folder, relative to it. Links to folders are not followed.
fn files_below(folder: &Path) -> Result<Vec<PathBuf>, ReadReason> {
    let mut names = Vec::new();
    let mut folders = vec![(PathBuf::new(), 0)];
    let mut seen = 0;
    while let Some((inner, depth)) = folders.pop() {
        seen += 1;
        if seen > MOST_FOLDERS {
            let text = format!("it holds more than {MOST_FOLDERS} folders");
            return Err(ReadReason::Io(std::io::Error::other(text)));
        }
        // what may not be read is no part of the scan
        let Ok(entries) = fs::read_dir(folder.join(&inner)) else { continue };
        for entry in entries {
            let entry = entry.map_err(ReadReason::Io)?;
            let kind = entry.file_type().map_err(ReadReason::Io)?;
            let path = inner.join(entry.file_name());
            if kind.is_dir() && depth < DEEPEST {
                folders.push((path, depth + 1));
            } else if depth > 0 && entry.path().is_file() {
                names.push(path);
            }
        }
    }
    names.sort();
    Ok(names)
}

/// The images among files, each with the name of its file, and how many others there are.
fn headers(
    folder: &Path,
    names: Vec<PathBuf>,
    given: GivenFrame,
    watch: &mut dyn Watch,
) -> Result<(Vec<(String, Found)>, usize), ReadReason> {
    let (mut files, mut others) = (Vec::new(), 0);
    for (k, name) in names.iter().enumerate() {
        // a header is some kilobytes, a slice half a megabyte
        check(watch, Phase::Read, 0.1 * k as f64 / names.len() as f64, None)?;
        let text = name.to_string_lossy().into_owned();
        let header = header(&folder.join(name), given).map_err(|reason| in_file(&text, reason))?;
        match header {
            Some(found) => files.push((text, found)),
            None => others += 1,
        }
    }
    Ok((files, others))
}

fn reader(path: &Path) -> Result<Reader<File>, ReadReason> {
    let file = File::open(path).map_err(ReadReason::Io)?;
    let bytes = file.metadata().map_err(ReadReason::Io)?.len();
    Ok(Reader::new(file, bytes))
}

/// The header of an image; none if the file is not DICOM, or holds no image.
fn header(path: &Path, given: GivenFrame) -> Result<Option<Found>, ReadReason> {
    if !is_dicom(path) {
        return Ok(None);
    }
    let mut reader = reader(path)?;
    match Found::read(&mut reader, given) {
        // it only looked like a file whose preamble was left out
        Err(_) if reader.is_bare => Ok(None),
        read => read,
    }
}
