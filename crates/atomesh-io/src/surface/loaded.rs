//! What comes out of a surface file.

/// Points with the lines or triangles between them, and the name of the group of each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadedSurface {
    /// The points; in STL three for each triangle.
    pub points: Vec<[f64; 3]>,
    /// The lines.
    pub lines: Vec<[u32; 2]>,
    /// The triangles.
    pub triangles: Vec<[u32; 3]>,
    /// The group of each line or triangle, by its name, or its number where the file has no names; of none,
    /// empty.
    pub groups: Vec<String>,
}
