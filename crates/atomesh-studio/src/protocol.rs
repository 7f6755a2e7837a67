//! What page and engine say to each other.
//!
//! The page sends text: `{"seq": 7, "command": {"op": "undo"}}`, and hears `{"seq": 7}` or `{"seq": 7, "refused": "why"}`.
//! It is shown states: the state in words (`{"state": …, "kind": 0, "version": 12}`) and arrays. A frame of arrays is a
//! head of 16 bytes and what the head counts, all of it little-endian:
//!
//! | bytes | what |
//! | --- | --- |
//! | 0 | the [`Kind`] |
//! | 1 | axes of a place: 2 or 3 |
//! | 2…3 | 0 |
//! | 4…7 | the revision of what is shown |
//! | 8…11, 12…15 | two counts, as the kind says |
//!
//! Places are u16, 0…65535 over the samples 0…n − 1 of each axis: what a screen can show. The truth are the engine's f64;
//! the page sends gestures, and names atoms by number. A page acknowledges each frame of a kind before it gets the next.

use atomesh::geometry::Point;
use atomesh::image::Grid;
use serde::{Deserialize, Serialize};

use crate::gesture::Gesture;

/// What a frame shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum Kind {
    /// Everything in words and numbers.
    State = 0,
    /// The mesh in the plane: so many places, and edges of two u32 each.
    Mesh = 1,
    /// The atoms: so many, each a whole place and a u32 that is 0 for an atom, 1 for a pinned one, 2 for one that is gone;
    /// and, in the plane, the cells between them, three u32 each. A whole place in space has a fourth u16, which is 0.
    Atoms = 2,
    /// What an unfinished drag has changed since the atoms' revision: so many moves (u32, whole place), and so many u32 that
    /// follow: the number of cells removed, their corners, and the corners of the cells added; in space no cells.
    Drag = 3,
    /// The facets of features in the plane: so many, each two places and a u32: the number of the feature, from 1, plus
    /// 65536 where it lets everything through; and nothing.
    Facets = 4,
    /// Streamlines: so many places, so many lines, each the u32 number of its places; the places first.
    Flow = 5,
    /// The progress of work, in words.
    Progress = 6,
}

/// What a page asks for.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "op", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Command {
    /// A frame has been taken up.
    Ack {
        /// Its kind.
        kind: Kind,
    },
    /// Something is done.
    Do {
        /// What.
        gesture: Gesture,
    },
    /// An atom is dragged on, or a drag begins.
    Drag {
        /// The atom's number.
        atom: u32,
        /// Where it is drawn, in samples.
        to: Vec<f64>,
        /// How far atoms follow, over the nominal distance there.
        reach: f64,
        /// The revision of the atoms that the page shows.
        revision: u32,
    },
    /// The drag ends.
    Drop,
    /// Takes back.
    Undo,
    /// Does again what was taken back.
    Redo,
    /// Ends the work under way.
    Cancel,
    /// Whether atoms are shown, and so may be edited.
    Atoms {
        /// Whether.
        shown: bool,
    },
    /// Which parts of the cells are shown.
    Parts {
        /// The level, by its number of parts; none: no parts are shown.
        count: Option<usize>,
    },
    /// Asks for the command that makes the same mesh.
    CommandLine,
    /// Draws a synthetic image and opens it.
    Scene {
        /// Its name.
        name: String,
        /// The seed of its random numbers.
        seed: u64,
    },
}

/// A command with its number.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Numbered {
    /// The page's number, which the answer repeats.
    pub seq: u32,
    /// The command.
    pub command: Command,
}

/// How a command ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Answer {
    /// The number of the command.
    pub seq: u32,
    /// Why it was not done.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
    /// What was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
}

/// Why text is no command.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no command: {0}")]
pub struct NoCommand(String);

/// Places in one gesture: minutes of painting.
const MOST_PLACES: usize = 4096;

impl Numbered {
    /// Reads a command and checks its numbers.
    ///
    /// # Errors
    /// [`NoCommand`].
    pub fn parse(text: &str) -> Result<Self, NoCommand> {
        let numbered: Self = serde_json::from_str(text).map_err(|e| NoCommand(e.to_string()))?;
        match &numbered.command {
            Command::Do { gesture } => gesture.check(MOST_PLACES).map_err(NoCommand)?,
            Command::Drag { to, reach, .. } => {
                let numbers = to.iter().chain([reach]);
                if !(2..=3).contains(&to.len()) || !numbers.into_iter().all(|x| x.is_finite()) {
                    return Err(NoCommand("a place of 2 or 3 finite numbers was expected".into()));
                }
            }
            _ => {}
        }
        Ok(numbered)
    }
}

/// A frame of arrays under way.
#[derive(Debug)]
pub struct Arrays(Vec<u8>);

impl Arrays {
    /// The head.
    pub fn new(kind: Kind, dimension: usize, revision: u32, counts: [usize; 2]) -> Self {
        let mut bytes = vec![kind as u8, dimension as u8, 0, 0];
        let numbers = [revision, counts[0] as u32, counts[1] as u32];
        bytes.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
        Self(bytes)
    }

    /// Adds numbers.
    pub fn numbers(&mut self, numbers: impl IntoIterator<Item = u32>) {
        self.0.extend(numbers.into_iter().flat_map(u32::to_le_bytes));
    }

    /// Adds a place, of which some axes are seen.
    pub fn place<const D: usize>(&mut self, p: &Point<D>, grid: &Grid<D>, axes: [usize; 2]) {
        self.0.extend(axes.into_iter().flat_map(|k| share(p[k], grid, k).to_le_bytes()));
    }

    /// Adds a whole place.
    pub fn whole_place<const D: usize>(&mut self, p: &Point<D>, grid: &Grid<D>) {
        self.0.extend((0..D).flat_map(|k| share(p[k], grid, k).to_le_bytes()));
        if D % 2 == 1 {
            self.0.extend([0, 0]);
        }
    }

    /// The frame.
    pub fn into_bytes(self) -> Vec<u8> {
        self.0
    }
}

/// A coordinate as a share of the box along an axis, 0…65535.
pub fn share<const D: usize>(x: f64, grid: &Grid<D>, axis: usize) -> u16 {
    let extent = (grid.shape[axis] as f64 - 1.0) * grid.step[axis];
    let share = if extent > 0.0 { (x / extent).clamp(0.0, 1.0) } else { 0.0 };
    (share * 65535.0).round() as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_read_strictly() {
        let read = |text: &str| Numbered::parse(text);
        let undo = read(r#"{"seq":7,"command":{"op":"undo"}}"#).unwrap();
        assert_eq!(undo, Numbered { seq: 7, command: Command::Undo });
        for odd in [
            "",
            "[]",
            r#"{"seq":7}"#,
            r#"{"seq":-1,"command":{"op":"undo"}}"#,
            r#"{"seq":7,"command":{"op":"undo"},"more":1}"#,
            r#"{"seq":7,"command":{"op":"open","path":"/etc/passwd"}}"#,
            r#"{"seq":7,"command":{"op":"ack","kind":"nothing"}}"#,
            r#"{"seq":7,"command":{"op":"drag","atom":1,"to":[1],"reach":5,"revision":0}}"#,
            r#"{"seq":7,"command":{"op":"drag","atom":1,"to":[1,1e999],"reach":5,"revision":0}}"#,
            r#"{"seq":7,"command":{"op":"do","gesture":{"do":"set","option":"lattice.size","value":8,"x":1}}}"#,
        ] {
            assert!(read(odd).is_err(), "{odd}");
        }
    }

    #[test]
    fn places_reach_from_the_first_sample_to_the_last() {
        let grid = Grid::<2> { shape: [3, 5], step: [1.0, 0.5] };
        let mut arrays = Arrays::new(Kind::Mesh, 2, 9, [2, 0]);
        arrays.place(&[0.0, 0.0], &grid, [0, 1]);
        arrays.place(&[2.0, 2.0], &grid, [0, 1]);
        let bytes = arrays.into_bytes();
        assert_eq!(bytes[..8], [1, 2, 0, 0, 9, 0, 0, 0]);
        assert_eq!(bytes[16..], [0, 0, 0, 0, 255, 255, 255, 255]);
    }
}
