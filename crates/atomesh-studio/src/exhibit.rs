//! What slices are taken of: the image and the fields as they are, for whoever asks over HTTP.
//!
//! An exhibit is made by the engine when something has changed, and shares what it shows. Slices are raw: a head of four
//! u32 (columns, rows, the step of samples from one to the next, 0), then f32 values row by row, all little-endian.

use std::fmt;
use std::sync::Arc;

use atomesh::geometry::Point;
use atomesh::image::Grid;
use atomesh::mesh::is_feature_name;
use atomesh::run::{Outcome, Prepared};

use atomesh_job::mesh::MeshImages;

use crate::model::{OnMesh, Playback};
use crate::protocol::{Arrays, Kind, share};
use crate::region_view::{Divisions, REGION, areas};
use crate::slice_cells::slice_cells;

/// Samples of the longest side of a slice: what textures of all browsers hold.
const LONGEST: usize = 4096;

/// The axes of a slice, by the axis normal to it.
const AXES: [[usize; 2]; 3] = [[1, 2], [0, 2], [0, 1]];

/// What a slice shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum What {
    /// The image.
    Image,
    /// b(x).
    Potential,
    /// d(x).
    Distance,
    /// β(x).
    Weight,
}

/// What can be looked at while the engine works.
pub trait Exhibit: fmt::Debug + Send + Sync {
    /// A slice normal to an axis, through a sample; in the plane the axis is 2. `None` if there is none.
    fn slice(&self, what: What, axis: usize, at: usize) -> Option<Vec<u8>>;

    /// The edges in which a plane through a sample cuts the cells, as a frame of [`Kind::Mesh`]; `None` in the plane.
    fn cells(&self, axis: usize, at: usize) -> Option<Vec<u8>>;

    /// The regions and the borders of parts, as [`areas`] has them: in the plane, or where a plane through a sample cuts the
    /// cells; `None` if there are neither.
    fn regions(&self, axis: usize, at: usize) -> Option<Vec<u8>>;

    /// The surfaces of features and regions in space: a u32, how many triangles, and for each of them three places as u16 and
    /// a number: of its feature, from 1, or of its region with [`REGION`](crate::region_view::REGION) added; `None` if there
    /// are none.
    fn surface(&self) -> Option<Vec<u8>>;

    /// The recorded iterations: four u32 (frames, atoms, axes, iterations from frame to frame), for each frame two f32, the
    /// pairs' and the image's energy, then for each frame the places of all atoms as u16.
    fn playback(&self) -> Option<Vec<u8>>;
}

/// The triangles of regions' surfaces, with their numbers.
pub type Surfaces<const D: usize> = fn(&Outcome<D>, &[i32]) -> Vec<(u16, [Point<D>; D])>;

/// What a model shows.
#[derive(Debug)]
pub struct Shown<const D: usize> {
    /// The revision.
    pub revision: u32,
    /// The image.
    pub images: Arc<MeshImages<D>>,
    /// Its grid.
    pub grid: Grid<D>,
    /// The fields, once they are made.
    pub prepared: Option<Prepared<D>>,
    /// The mesh.
    pub outcome: Option<Arc<Outcome<D>>>,
    /// The iterations.
    pub playback: Option<Arc<Playback>>,
    /// The regions on the mesh, if there are any.
    pub regions: Option<Arc<OnMesh>>,
    /// The part of each cell, if they are shown.
    pub parts: Option<Arc<Vec<i32>>>,
    /// The surfaces of regions.
    pub surfaces: Surfaces<D>,
}

impl<const D: usize> Exhibit for Shown<D> {
    fn slice(&self, what: What, axis: usize, at: usize) -> Option<Vec<u8>> {
        let shape = self.grid.shape;
        let samples = self.images.image.samples();
        match what {
            What::Image => raw(shape, axis, at, |i| samples.get(i) as f32),
            What::Potential => {
                let b = self.prepared.as_ref()?.potential().samples();
                raw(shape, axis, at, |i| b[i])
            }
            What::Distance => {
                let d = self.prepared.as_ref()?.distance();
                raw(shape, axis, at, |i| d.at(&self.grid.position(i)) as f32)
            }
            What::Weight => {
                let weight = self.prepared.as_ref()?.fields().weight;
                raw(shape, axis, at, |i| weight.at(&self.grid.position(i)) as f32)
            }
        }
    }

    fn cells(&self, axis: usize, at: usize) -> Option<Vec<u8>> {
        if D != 3 || axis >= D {
            return None;
        }
        let outcome = self.outcome.as_ref()?;
        let (points, edges) = match outcome.cells() {
            Some(_) => return None,
            None => slice_cells(outcome.mesh(), axis, self.level(axis, at)),
        };
        let counts = [points.len(), edges.len() / 2];
        let mut arrays = Arrays::new(Kind::Mesh, D, self.revision, counts);
        points.iter().for_each(|p: &Point<D>| arrays.place(p, &self.grid, AXES[axis]));
        arrays.numbers(edges);
        Some(arrays.into_bytes())
    }

    fn regions(&self, axis: usize, at: usize) -> Option<Vec<u8>> {
        let outcome = self.outcome.as_ref().filter(|_| axis < 3 && (D == 3 || axis == 2))?;
        let regions: &[i32] = self.regions.as_ref().map_or(&[], |regions| &regions.of_cells);
        let parts: &[i32] = self.parts.as_ref().map_or(&[], |parts| parts);
        if regions.is_empty() && parts.is_empty() {
            return None;
        }
        let cut = (D == 3).then(|| (axis, self.level(axis, at)));
        let divisions = Divisions { regions, parts };
        Some(areas(outcome, &divisions, cut, (&self.grid, AXES[axis])))
    }

    fn surface(&self) -> Option<Vec<u8>> {
        let outcome = self.outcome.as_ref().filter(|_| D == 3)?;
        let points = outcome.mesh().points();
        let mut triangles: Vec<(u16, [Point<D>; D])> = Vec::new();
        if outcome.cells().is_none() {
            let tags = outcome.tags().ok()?;
            let groups = tags.facet_groups().iter().filter(|group| is_feature_name(&group.name));
            for (group, number) in groups.zip(1_u16..REGION) {
                let facets = group.facets.iter();
                let facets = facets.map(|facet| facet.map(|corner| points[corner as usize]));
                triangles.extend(facets.map(|facet| (number, facet)));
            }
        }
        if let Some(regions) = &self.regions {
            triangles.extend((self.surfaces)(outcome, &regions.of_cells));
        }
        if triangles.is_empty() {
            return None;
        }
        let mut bytes = (triangles.len() as u32).to_le_bytes().to_vec();
        for (number, corners) in triangles {
            for corner in corners {
                let place = shares(&corner, &self.grid);
                bytes.extend(place.iter().flat_map(|share| share.to_le_bytes()));
            }
            bytes.extend(number.to_le_bytes());
        }
        Some(bytes)
    }

    fn playback(&self) -> Option<Vec<u8>> {
        let playback = self.playback.as_ref()?;
        let count = playback.frames.first()?.len() / D;
        let head = [playback.frames.len(), count, D, playback.stride];
        let mut bytes: Vec<u8> = head.iter().flat_map(|n| (*n as u32).to_le_bytes()).collect();
        let energies = playback.energies.iter().flatten();
        bytes.extend(energies.flat_map(|energy| (*energy as f32).to_le_bytes()));
        for place in playback.frames.iter().flat_map(|frame| frame.chunks_exact(D)) {
            let place = shares(&std::array::from_fn(|k| f64::from(place[k])), &self.grid);
            bytes.extend(place.iter().flat_map(|share| share.to_le_bytes()));
        }
        Some(bytes)
    }
}

impl<const D: usize> Shown<D> {
    /// Where a plane through a sample cuts cells.
    fn level(&self, axis: usize, at: usize) -> f64 {
        let step = self.grid.step[axis];
        // no cell lies before the first sample: just behind it
        (at.min(self.grid.shape[axis] - 1) as f64 * step).max(1e-6 * step)
    }
}

/// A place as shares of the box, 0…65535.
fn shares<const D: usize>(p: &Point<D>, grid: &Grid<D>) -> [u16; D] {
    std::array::from_fn(|k| share(p[k], grid, k))
}

/// A slice with its head; every so manyth sample of a side longer than [`LONGEST`].
fn raw<const D: usize>(
    shape: [usize; D],
    axis: usize,
    at: usize,
    value: impl Fn(usize) -> f32,
) -> Option<Vec<u8>> {
    let of = |k: usize| shape.get(k).copied().unwrap_or(1);
    let [columns, rows] = *AXES.get(axis)?;
    if D == 2 && axis != 2 {
        return None;
    }
    let strides = [1, of(0), of(0) * of(1)];
    let base = at.min(of(axis) - 1) * strides[axis];
    let step = of(columns).max(of(rows)).div_ceil(LONGEST);
    let (width, height) = (of(columns).div_ceil(step), of(rows).div_ceil(step));
    let head = [width, height, step, 0].map(|n| n as u32);
    let mut bytes: Vec<u8> = Vec::with_capacity(16 + 4 * width * height);
    bytes.extend(head.iter().flat_map(|n| n.to_le_bytes()));
    for row in 0..height {
        for column in 0..width {
            let index = base + column * step * strides[columns] + row * step * strides[rows];
            bytes.extend(value(index).to_le_bytes());
        }
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(bytes: &[u8]) -> Vec<f32> {
        let (words, _) = bytes[16..].as_chunks::<4>();
        words.iter().map(|word| f32::from_le_bytes(*word)).collect()
    }

    #[test]
    fn slices_are_what_their_axes_say() {
        let shape = [2, 3, 4];
        let of = |axis, at| raw(shape, axis, at, |i| i as f32).map(|bytes| values(&bytes));
        assert_eq!(of(2, 1).unwrap(), [6.0, 7.0, 8.0, 9.0, 10.0, 11.0]);
        assert_eq!(of(1, 2).unwrap(), [4.0, 5.0, 10.0, 11.0, 16.0, 17.0, 22.0, 23.0]);
        assert_eq!(of(0, 1).unwrap()[..4], [1.0, 3.0, 5.0, 7.0]);
        assert_eq!(of(0, 99), of(0, 1), "beyond the last is the last");
        assert_eq!(of(3, 0), None);
        assert_eq!(raw([2, 3], 0, 0, |_| 0.0), None);
    }

    #[test]
    fn long_sides_are_thinned() {
        let bytes = raw([2 * LONGEST + 1, 1], 2, 0, |i| i as f32).unwrap();
        assert_eq!(values(&bytes)[..3], [0.0, 3.0, 6.0]);
        assert_eq!(bytes[8], 3);
    }
}
