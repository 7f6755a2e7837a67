//! Reading a polyMesh folder of text files.

use std::fs;
use std::path::Path;
use std::str::FromStr;

use super::super::read_error::{MeshReadError, excerpt, malformed};
use super::{Beyond, CellZone, FaceZone, FoamMesh, FoamMeshError, Patch, PointZone};

/// Reads the cells in a polyMesh folder, as text; zones may be missing. Patches of other types than
/// `empty` are taken as plain ones.
///
/// # Errors
/// [`MeshReadError`] if a file is missing, binary, or not what OpenFOAM's format says; the place is that
/// in the file that is named.
pub fn read_foam_mesh(folder: &Path) -> Result<FoamMesh, MeshReadError> {
    let points_file = fs::read(folder.join("points"))?;
    let points = File::new("points", &points_file)?.list(point)?;
    let (faces, owner) = (fs::read(folder.join("faces"))?, fs::read(folder.join("owner"))?);
    let faces = File::new("faces", &faces)?.list(face)?;
    let owners = File::new("owner", &owner)?.list(|file| file.number::<u32>("a cell"))?;
    let neighbours = fs::read(folder.join("neighbour"))?;
    let neighbours =
        File::new("neighbour", &neighbours)?.list(|file| file.number::<u32>("a cell"))?;
    let boundary = fs::read(folder.join("boundary"))?;
    let patches = File::new("boundary", &boundary)?.list(patch)?;
    if owners.len() != faces.len() || neighbours.len() > faces.len() {
        let expected = format!("{} owners and no more neighbours in the files", faces.len());
        return Err(malformed(0, expected, format!("{}, {}", owners.len(), neighbours.len())));
    }
    let cell_count = owners.iter().chain(&neighbours).max().map_or(0, |&cell| cell as usize + 1);
    let names = patches.iter().map(|(patch, ..)| patch.clone()).collect();
    let mut mesh = FoamMesh::new(points, cell_count, names).with_note(&comment(&points_file));
    for (at, (corners, &owner)) in faces.iter().zip(&owners).enumerate() {
        let holds =
            |(_, start, count): &(Patch, usize, usize)| (*start..start + count).contains(&at);
        let beyond = match neighbours.get(at) {
            Some(&cell) => Beyond::Cell(cell),
            None => Beyond::Patch(patches.iter().position(holds).unwrap_or(usize::MAX) as u32),
        };
        mesh.push_face(corners, owner, beyond).map_err(wrong)?;
    }
    if let Ok(zones) = fs::read(folder.join("pointZones")) {
        let zones = File::new("pointZones", &zones)?.list(|file| plain_zone(file, "a point"))?;
        for (name, points) in zones {
            mesh.push_point_zone(PointZone { name, points }).map_err(wrong)?;
        }
    }
    if let Ok(zones) = fs::read(folder.join("faceZones")) {
        for zone in File::new("faceZones", &zones)?.list(face_zone)? {
            mesh.push_face_zone(zone).map_err(wrong)?;
        }
    }
    if let Ok(zones) = fs::read(folder.join("cellZones")) {
        let zones = File::new("cellZones", &zones)?.list(|file| plain_zone(file, "a cell"))?;
        for (name, cells) in zones {
            mesh.push_cell_zone(CellZone { name, cells }).map_err(wrong)?;
        }
    }
    Ok(mesh)
}

fn wrong(error: FoamMeshError) -> MeshReadError {
    malformed(0, "files that agree", error.to_string())
}

/// The text of a comment in the first line.
fn comment(bytes: &[u8]) -> String {
    let line = bytes.split(|&b| b == b'\n').next().unwrap_or_default();
    let text = line.strip_prefix(b"// ").unwrap_or_default();
    String::from_utf8_lossy(text).into_owned()
}

/// A file's words: numbers, names, and each bracket, brace and semicolon alone.
struct File<'a> {
    name: &'static str,
    bytes: &'a [u8],
    at: usize,
}

impl<'a> File<'a> {
    /// A file after its head.
    fn new(name: &'static str, bytes: &'a [u8]) -> Result<Self, MeshReadError> {
        let mut file = Self { name, bytes, at: 0 };
        file.expect("FoamFile")?;
        file.expect("{")?;
        loop {
            match file.word()? {
                "}" => return Ok(file),
                "format" if file.word()? != "ascii" => {
                    return Err(MeshReadError::Unsupported {
                        what: "polyMesh file format",
                        found: "binary".into(),
                        expected: "ascii",
                    });
                }
                _ => {}
            }
        }
    }

    fn wrong(&self, expected: &str) -> MeshReadError {
        let expected = format!("{expected} in the file {}", self.name);
        malformed(self.at, expected, excerpt(self.bytes, self.at))
    }

    fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    fn skip(&mut self) {
        loop {
            self.at += self.rest().iter().take_while(|b| b.is_ascii_whitespace()).count();
            let length = match self.rest() {
                [b'/', b'/', rest @ ..] => rest.iter().position(|&b| b == b'\n'),
                [b'/', b'*', rest @ ..] => {
                    rest.windows(2).position(|end| end == b"*/").map(|length| length + 2)
                }
                _ => return,
            };
            self.at = length.map_or(self.bytes.len(), |length| self.at + 2 + length);
        }
    }

    /// The next word; an empty one is an error.
    fn word(&mut self) -> Result<&'a str, MeshReadError> {
        self.skip();
        let rest = self.rest();
        let length = match rest.first() {
            Some(b'(' | b')' | b'{' | b'}' | b';') => 1,
            Some(b'"') => rest[1..].iter().position(|&b| b == b'"').map_or(0, |end| end + 2),
            _ => rest
                .iter()
                .take_while(|b| !b.is_ascii_whitespace() && !b"(){};".contains(b))
                .count(),
        };
        match std::str::from_utf8(&rest[..length]) {
            Ok(word) if length > 0 => {
                self.at += length;
                Ok(word)
            }
            _ => Err(self.wrong("a word")),
        }
    }

    fn expect(&mut self, what: &str) -> Result<(), MeshReadError> {
        let at = self.at;
        if self.word()? == what {
            return Ok(());
        }
        self.at = at;
        Err(self.wrong(what))
    }

    fn number<T: FromStr>(&mut self, what: &str) -> Result<T, MeshReadError> {
        let at = self.at;
        self.word()?.parse().map_err(|_| {
            self.at = at;
            self.wrong(what)
        })
    }

    /// A count and so many items in brackets.
    fn list<T>(
        &mut self,
        item: impl Fn(&mut Self) -> Result<T, MeshReadError>,
    ) -> Result<Vec<T>, MeshReadError> {
        let count: usize = self.number("a count")?;
        if count > self.rest().len() {
            return Err(self.wrong("items as many as the count before says"));
        }
        self.expect("(")?;
        let items: Result<Vec<T>, MeshReadError> = (0..count).map(|_| item(self)).collect();
        self.expect(")")?;
        items
    }
}

fn point(file: &mut File) -> Result<[f64; 3], MeshReadError> {
    file.expect("(")?;
    let point = [file.number("x")?, file.number("y")?, file.number("z")?];
    file.expect(")")?;
    Ok(point)
}

fn face(file: &mut File) -> Result<Vec<u32>, MeshReadError> {
    file.list(|file| file.number("a point"))
}

/// A patch, its first face, and how many it has.
fn patch(file: &mut File) -> Result<(Patch, usize, usize), MeshReadError> {
    let mut patch = Patch::new(file.word()?);
    file.expect("{")?;
    let (mut start, mut count) = (0, 0);
    loop {
        match file.word()? {
            "}" => return Ok((patch, start, count)),
            "type" => patch.is_empty = file.word()? == "empty",
            "nFaces" => count = file.number::<u32>("a count")? as usize,
            "startFace" => start = file.number::<u32>("a face")? as usize,
            _ => {}
        }
    }
}

/// The name of a zone; its lists are given to `list` by their names.
fn zone<'a>(
    file: &mut File<'a>,
    mut list: impl FnMut(&str, &mut File<'a>) -> Result<(), MeshReadError>,
) -> Result<String, MeshReadError> {
    let name = file.word()?.into();
    file.expect("{")?;
    loop {
        match file.word()? {
            "}" => return Ok(name),
            word @ ("pointLabels" | "faceLabels" | "flipMap" | "cellLabels") => {
                file.word()?; // List<label>
                list(word, file)?;
            }
            _ => {}
        }
    }
}

fn face_zone(file: &mut File) -> Result<FaceZone, MeshReadError> {
    let (mut faces, mut flips) = (Vec::new(), Vec::new());
    let name = zone(file, |word, file| {
        match word {
            "faceLabels" => faces = file.list(|file| file.number("a face"))?,
            _ => flips = file.list(|file| file.number::<u8>("0 or 1"))?,
        }
        Ok(())
    })?;
    if faces.len() != flips.len() {
        return Err(file.wrong("as many faces as flips before this"));
    }
    let faces = faces.into_iter().zip(flips).map(|(face, flip)| (face, flip != 0)).collect();
    Ok(FaceZone { name, faces })
}

/// The name of a zone that is a list of numbers, and these.
fn plain_zone(file: &mut File, what: &'static str) -> Result<(String, Vec<u32>), MeshReadError> {
    let mut members = Vec::new();
    let name = zone(file, |_, file| {
        members = file.list(|file| file.number(what))?;
        Ok(())
    })?;
    Ok((name, members))
}
