//! NPZ, NumPy's archive of arrays: `points` (n × D, float64), `cells` (m × (D + 1), uint32), one float32
//! array by the name of each field at the points, `cell.NAME` for each field in the cells, where there are groups of
//! points `point_group` (uint32, 0 for none), and `metadata`, the frame and the provenance as JSON bytes: `json.loads(archive["metadata"].item())`.

mod first_error;
mod read;
mod write;

pub use read::read_npz;
pub use write::write_npz;
