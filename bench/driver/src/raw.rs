//! Raw little-endian arrays from and to files.

use std::fs;
use std::path::Path;

use atomesh::geometry::Point;
use atomesh::mesh::Mesh;

use crate::Failure;

/// The f64 coordinates of points, x fastest.
pub fn read_points<const D: usize>(path: &Path) -> Result<Vec<Point<D>>, Failure> {
    let bytes = fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let (values, rest) = bytes.as_chunks::<8>();
    let values: Vec<f64> = values.iter().map(|b| f64::from_le_bytes(*b)).collect();
    let (points, more) = values.as_chunks::<D>();
    if !(rest.is_empty() && more.is_empty()) {
        return Err(
            format!("{}: {} bytes are not {D}-D points", path.display(), bytes.len()).into()
        );
    }
    Ok(points.to_vec())
}

/// `count` f32 samples.
pub fn read_samples(path: &Path, count: usize) -> Result<Vec<f32>, Failure> {
    let bytes = fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    if bytes.len() != 4 * count {
        return Err(
            format!("{}: {} bytes are not {count} samples", path.display(), bytes.len()).into()
        );
    }
    Ok(bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect())
}

/// Writes `path`.points (f64) and `path`.cells (u32) if there is a path.
pub fn write_mesh<const D: usize>(path: Option<&Path>, mesh: &Mesh<D>) -> Result<(), Failure> {
    let Some(path) = path else { return Ok(()) };
    let points: Vec<u8> =
        mesh.points().as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    let cells: Vec<u8> = mesh.corners().iter().flat_map(|c| c.to_le_bytes()).collect();
    fs::write(path.with_extension("points"), points)?;
    fs::write(path.with_extension("cells"), cells)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_come_back_from_the_file_of_a_mesh() {
        let folder = std::env::temp_dir().join(format!("bench-driver-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let points = vec![[0.0, 0.1], [1.0, -2.5e-300], [0.0, 1.0]];
        let mesh = Mesh::new(points.clone(), vec![0, 1, 2]).unwrap();
        write_mesh(Some(&folder.join("mesh")), &mesh).unwrap();
        assert_eq!(read_points::<2>(&folder.join("mesh.points")).unwrap(), points);
        assert!(read_points::<4>(&folder.join("mesh.points")).is_err());
        assert_eq!(fs::read(folder.join("mesh.cells")).unwrap().len(), 12);
        fs::remove_dir_all(folder).unwrap();
    }
}
