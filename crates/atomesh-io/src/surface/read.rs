//! Reading surface files: those written here, STL as text too, and the common parts of what others write.

use std::io;
use std::path::Path;
use std::str::FromStr;

use super::loaded::LoadedSurface;
use super::read_vtp::read_vtp;
use super::{SurfaceFormat, SurfaceWriteError};
use crate::mesh::MeshReadError;

/// Why a surface was not read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceReadError {
    /// The name calls for no format that is read.
    #[error(
        "{0:?} is not a surface file that can be read; expected .vtp, .stl, .obj, .ply, .ts or .pl"
    )]
    Format(std::path::PathBuf),
    /// The system did not give the bytes.
    #[error("the surface could not be read: {0}")]
    Io(#[from] io::Error),
    /// The bytes are no VTP file.
    #[error(transparent)]
    Vtp(#[from] MeshReadError),
    /// The bytes are not what the format says.
    #[error("expected {expected}, found {found:?}")]
    Malformed {
        /// What the format says.
        expected: &'static str,
        /// What is there.
        found: String,
    },
}

fn malformed(expected: &'static str, found: impl Into<String>) -> SurfaceReadError {
    SurfaceReadError::Malformed { expected, found: found.into() }
}

/// Reads a surface in the format that the name calls for: VTP (one piece of lines and triangles), STL (binary
/// or text), OBJ (lines and triangles), PLY as it is written here, GOCAD's TSurf and PLine.
///
/// # Errors
/// [`SurfaceReadError`] if the file cannot be read or is not what its name says.
pub fn read_surface(path: &Path) -> Result<LoadedSurface, SurfaceReadError> {
    let format = SurfaceFormat::of(path).map_err(|e| match e {
        SurfaceWriteError::Format { path } => SurfaceReadError::Format(path),
        other => SurfaceReadError::Io(io::Error::other(other)),
    })?;
    let bytes = std::fs::read(path)?;
    let surface = match format {
        SurfaceFormat::Stl if is_text_stl(&bytes) => text_stl(&text(&bytes)?),
        SurfaceFormat::Stl => binary_stl(&bytes),
        SurfaceFormat::Obj => obj(&text(&bytes)?),
        SurfaceFormat::Ply => ply(&bytes),
        SurfaceFormat::TSurf | SurfaceFormat::PLine => gocad(&text(&bytes)?),
        SurfaceFormat::Vtp => Ok(read_vtp(&bytes)?),
    }?;
    let count = surface.points.len();
    let corners = surface.lines.as_flattened().iter().chain(surface.triangles.as_flattened());
    match corners.copied().find(|&corner| corner as usize >= count) {
        Some(corner) => Err(malformed("a point that there is", corner.to_string())),
        None => Ok(surface),
    }
}

fn text(bytes: &[u8]) -> Result<String, SurfaceReadError> {
    String::from_utf8(bytes.to_vec()).map_err(|e| malformed("text", e.to_string()))
}

/// The next word as a number.
fn number<'a, T: FromStr>(
    words: &mut impl Iterator<Item = &'a str>,
) -> Result<T, SurfaceReadError> {
    let word = words.next().unwrap_or("the end of the line");
    word.parse().map_err(|_| malformed("a number", word))
}

fn point<'a>(words: &mut impl Iterator<Item = &'a str>) -> Result<[f64; 3], SurfaceReadError> {
    Ok([number(words)?, number(words)?, number(words)?])
}

/// Whether an STL file is text: it begins with "solid", and its length is not that of a binary one.
fn is_text_stl(bytes: &[u8]) -> bool {
    let count = bytes.get(80..84).map_or(0, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    bytes.starts_with(b"solid") && bytes.len() as u64 != 84 + 50 * u64::from(count)
}

fn text_stl(text: &str) -> Result<LoadedSurface, SurfaceReadError> {
    let (mut surface, mut name) = (LoadedSurface::default(), "");
    for line in text.lines() {
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("solid") => name = words.next().unwrap_or(""),
            Some("vertex") => surface.points.push(point(&mut words)?),
            Some("endloop") => {
                let end = surface.points.len() as u32;
                if end != 3 * (surface.triangles.len() as u32 + 1) {
                    return Err(malformed("three vertices in each loop", line));
                }
                surface.triangles.push([end - 3, end - 2, end - 1]);
                surface.groups.push(name.into());
            }
            _ => {}
        }
    }
    Ok(surface)
}

fn binary_stl(bytes: &[u8]) -> Result<LoadedSurface, SurfaceReadError> {
    let rest = bytes.get(80..).unwrap_or_default();
    let count = rest.first_chunk::<4>().map_or(0, |b| u32::from_le_bytes(*b)) as usize;
    let records = rest.get(4..).unwrap_or_default();
    if bytes.len() < 84 || records.len() != count.saturating_mul(50) {
        let found = format!("{} bytes for {count}", records.len());
        return Err(malformed("50 bytes for each triangle after a head of 84", found));
    }
    let mut surface = LoadedSurface::default();
    for record in records.chunks_exact(50) {
        let reals: Vec<f64> = record[12..48]
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| f64::from(f32::from_le_bytes(*b)))
            .collect();
        let start = surface.points.len() as u32;
        surface.points.extend(reals.as_chunks::<3>().0);
        surface.triangles.push([start, start + 1, start + 2]);
        let id = u16::from_le_bytes([record[48], record[49]]);
        surface.groups.push(if id == 0 { String::new() } else { id.to_string() });
    }
    Ok(surface)
}

/// A corner, counted from 1, with what stands behind a slash left out.
fn corner<'a>(words: &mut impl Iterator<Item = &'a str>) -> Result<u32, SurfaceReadError> {
    let word = words.next().unwrap_or("the end of the line");
    let first = word.split('/').next().unwrap_or_default();
    let index = first.parse::<u32>().ok().and_then(|index| index.checked_sub(1));
    index.ok_or_else(|| malformed("a vertex's number, 1 or more", word))
}

fn obj(text: &str) -> Result<LoadedSurface, SurfaceReadError> {
    let (mut surface, mut name) = (LoadedSurface::default(), "");
    for line in text.lines() {
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => surface.points.push(point(&mut words)?),
            Some("g") => name = words.next().unwrap_or(""),
            Some("l") => {
                surface.lines.push([corner(&mut words)?, corner(&mut words)?]);
                surface.groups.push(name.into());
            }
            Some("f") => {
                let (a, b) = (corner(&mut words)?, corner(&mut words)?);
                surface.triangles.push([a, b, corner(&mut words)?]);
                surface.groups.push(name.into());
            }
            _ => {}
        }
    }
    Ok(surface)
}

fn gocad(text: &str) -> Result<LoadedSurface, SurfaceReadError> {
    let (mut surface, mut name, mut start) = (LoadedSurface::default(), "", 0);
    for line in text.lines() {
        if let Some(found) = line.strip_prefix("name:") {
            name = found.trim();
        }
        let mut words = line.split_ascii_whitespace();
        let from = |words: &mut std::str::SplitAsciiWhitespace| {
            let own = corner(words)?;
            own.checked_add(start).ok_or_else(|| malformed("a vertex's number", line))
        };
        match words.next() {
            Some("GOCAD") => start = surface.points.len() as u32,
            Some("VRTX" | "PVRTX") => {
                let own: usize = number(&mut words)?;
                if own != surface.points.len() - start as usize + 1 {
                    return Err(malformed("vertices numbered 1, 2, 3 ...", line));
                }
                surface.points.push(point(&mut words)?);
            }
            Some("SEG") => {
                surface.lines.push([from(&mut words)?, from(&mut words)?]);
                surface.groups.push(name.into());
            }
            Some("TRGL") => {
                let (a, b) = (from(&mut words)?, from(&mut words)?);
                surface.triangles.push([a, b, from(&mut words)?]);
                surface.groups.push(name.into());
            }
            _ => {}
        }
    }
    Ok(surface)
}

fn ply(bytes: &[u8]) -> Result<LoadedSurface, SurfaceReadError> {
    let mark = b"end_header\n";
    let end = bytes.windows(mark.len()).position(|w| w == mark);
    let end = end.ok_or_else(|| malformed("end_header", "none"))? + mark.len();
    let head = text(&bytes[..end])?;
    if !head.starts_with("ply\nformat binary_little_endian 1.0\n") {
        return Err(malformed("binary, little-endian PLY", head.lines().nth(1).unwrap_or("")));
    }
    let (mut counts, mut names) = ([0_usize; 3], Vec::new());
    for line in head.lines() {
        let mut words = line.split_ascii_whitespace();
        match (words.next(), words.next()) {
            (Some("element"), Some("vertex")) => counts[0] = number(&mut words)?,
            (Some("element"), Some("edge")) => counts[1] = number(&mut words)?,
            (Some("element"), Some("face")) => counts[2] = number(&mut words)?,
            (Some("comment"), Some("feature")) => {
                let id: u32 = number(&mut words)?;
                names.push((id, words.next().unwrap_or("").to_owned()));
            }
            _ => {}
        }
    }
    let [vertices, edges, faces] = counts;
    let sizes = [vertices.checked_mul(24), edges.checked_mul(12), faces.checked_mul(17)];
    let size = sizes.into_iter().try_fold(0_usize, |sum, size| sum.checked_add(size?));
    let body = &bytes[end..];
    if size != Some(body.len()) {
        return Err(malformed("24 bytes a vertex, 12 an edge, 17 a face", body.len().to_string()));
    }
    let word = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let name =
        |id: u32| names.iter().find(|(own, _)| *own == id).map_or(String::new(), |n| n.1.clone());
    let (points, rest) = body.split_at(vertices * 24);
    let (edges, faces) = rest.split_at(edges * 12);
    let reals: Vec<f64> =
        points.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
    let mut surface =
        LoadedSurface { points: reals.as_chunks::<3>().0.to_vec(), ..LoadedSurface::default() };
    for edge in edges.chunks_exact(12) {
        surface.lines.push([word(edge), word(&edge[4..])]);
        surface.groups.push(name(word(&edge[8..])));
    }
    for face in faces.chunks_exact(17) {
        surface.triangles.push([word(&face[1..]), word(&face[5..]), word(&face[9..])]);
        surface.groups.push(name(word(&face[13..])));
    }
    Ok(surface)
}
