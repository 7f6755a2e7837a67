//! The writers of each dimension as a value, so that they are compiled here and nowhere else.
//!
//! Code that is generic over the dimension and calls a generic writer by its name has all of it compiled
//! again in its own crate. Through this value it calls what this crate holds already.

use std::path::Path;

use atomesh::image::Image;
use atomesh::mesh::{FacetGroup, Mesh};
use atomesh::watch::Watch;

use crate::atomic_file::AtomicFile;
use crate::image::{WriteError, write_image};
use crate::mesh::cells::{
    CellData, ConnectionFiles, Flow, ModflowFiles, Rock, SimulatorFiles, foam_mesh_of,
    write_cells_vtu, write_cells_vtu_with, write_connections, write_connections_with_flow,
    write_modflow, write_simulator,
};
use crate::mesh::openfoam::write_foam_mesh;
use crate::mesh::vtu::write_broken_vtu;
use crate::mesh::{
    CellFields, FluxFiles, FluxTable, MeshData, MeshFormat, MeshWriteError, Streamlines,
    write_fluxes, write_mesh_as, write_streamlines,
};
use crate::surface::{SurfaceExtras, SurfaceWriteError, write_surface};

/// What a writer of meshes returns.
type Written = Result<(), MeshWriteError>;

/// A value in a cell at a point of it, given by the numbers of both and the point's place.
pub type PointValue<'a, const D: usize> = dyn Fn(usize, usize, &[f64; D]) -> f64 + Sync + 'a;

/// What writes files of one dimension: [`plane`](Self::plane) or [`space`](MeshFiles::space). Each field
/// does what the function named does.
#[derive(Clone, Copy, Debug)]
pub struct MeshFiles<const D: usize> {
    /// [`write_image`].
    pub image: fn(&Path, &Image<D>, &mut dyn Watch) -> Result<(), WriteError>,
    /// [`write_mesh_as`].
    pub mesh: fn(&Path, MeshFormat, &MeshData<'_, D>, &mut dyn Watch) -> Written,
    /// [`write_broken_vtu`].
    pub broken: fn(&Path, &MeshData<'_, D>, usize, &PointValue<'_, D>, &mut dyn Watch) -> Written,
    /// [`write_cells_vtu`], into a file that appears whole or not at all.
    pub cells: fn(&Path, &CellData<'_, D>, &mut dyn Watch) -> Written,
    /// [`write_cells_vtu_with`], into a file that appears whole or not at all.
    pub cells_with: fn(&Path, &CellData<'_, D>, &CellFields<'_, D>, &mut dyn Watch) -> Written,
    /// [`foam_mesh_of`] and [`write_foam_mesh`].
    pub foam_cells: fn(&Path, &CellData<'_, D>, &mut dyn Watch) -> Written,
    /// [`write_connections`].
    pub connections: fn(&ConnectionFiles, &CellData<'_, D>, &mut dyn Watch) -> Written,
    /// [`write_connections_with_flow`].
    pub connections_with_flow:
        fn(&ConnectionFiles, &CellData<'_, D>, Flow<'_>, &mut dyn Watch) -> Written,
    /// [`write_modflow`].
    pub modflow: fn(&ModflowFiles, &CellData<'_, D>, &Rock<'_>, &mut dyn Watch) -> Written,
    /// [`write_simulator`].
    pub simulator: fn(&SimulatorFiles, &CellData<'_, D>, &Rock<'_>, &mut dyn Watch) -> Written,
    /// [`write_streamlines`].
    pub streamlines: fn(&Path, &Streamlines<'_, D>, &mut dyn Watch) -> Written,
    /// [`write_fluxes`].
    pub fluxes: fn(&FluxFiles, &FluxTable<'_, D>, &mut dyn Watch) -> Written,
    /// [`write_surface`].
    pub surface: SurfaceWriter<D>,
}

/// Writes groups of facets, with what else is known of them.
type SurfaceWriter<const D: usize> = fn(
    &Path,
    &Mesh<D>,
    &[FacetGroup<D>],
    SurfaceExtras<'_>,
    &mut dyn Watch,
) -> Result<(), SurfaceWriteError>;

impl MeshFiles<2> {
    /// The writers of the plane. Not inlined: the caller's crate would compile them again.
    #[inline(never)]
    pub fn plane() -> Self {
        Self::new()
    }
}

impl MeshFiles<3> {
    /// The writers of space. Not inlined: the caller's crate would compile them again.
    #[inline(never)]
    pub fn space() -> Self {
        Self::new()
    }
}

impl<const D: usize> MeshFiles<D> {
    fn new() -> Self {
        Self {
            image: write_image,
            mesh: write_mesh_as,
            broken: write_broken_vtu,
            cells: |path, data, watch| {
                let mut file = AtomicFile::create(path)?;
                write_cells_vtu(&mut file, data, watch)?;
                Ok(file.commit()?)
            },
            cells_with: |path, data, fields, watch| {
                let mut file = AtomicFile::create(path)?;
                write_cells_vtu_with(&mut file, data, fields, watch)?;
                Ok(file.commit()?)
            },
            foam_cells: |path, data, watch| write_foam_mesh(path, &foam_mesh_of(data)?, watch),
            connections: write_connections,
            connections_with_flow: write_connections_with_flow,
            modflow: write_modflow,
            simulator: write_simulator,
            streamlines: write_streamlines,
            fluxes: write_fluxes,
            surface: write_surface,
        }
    }
}
