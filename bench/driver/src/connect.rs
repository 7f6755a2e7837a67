//! Delaunay meshes of points that CGAL, TetGen and Gmsh get too.

use std::path::{Path, PathBuf};

use atomesh::geometry::Point;
use atomesh::mesh::{Delaunay, Mesh};
use atomesh::watch::Silent;
use clap::{Args, ValueEnum};
use serde_json::Value;
use spade::{DelaunayTriangulation, Point2, Triangulation};

use crate::Failure;
use crate::clock::Clock;
use crate::raw::{read_points, write_mesh};

/// Who connects.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Connector {
    /// atomesh.
    Atomesh,
    /// The crate spade, 2-D only, by its bulk loading.
    Spade,
}

/// Connects points.
#[derive(Debug, Args)]
pub struct Connect {
    /// Points as raw f64.
    points: PathBuf,
    /// 2 or 3.
    #[arg(long)]
    dimension: usize,
    /// Who connects.
    #[arg(long, value_enum, default_value = "atomesh")]
    connector: Connector,
    /// Where the mesh goes.
    #[arg(long)]
    mesh: Option<PathBuf>,
}

impl Connect {
    /// Connects the points once.
    pub fn run(&self) -> Result<Value, Failure> {
        match (self.dimension, self.connector) {
            (2, Connector::Spade) => self.spade(),
            (2, Connector::Atomesh) => self.atomesh(Delaunay::<2>::new()),
            (3, Connector::Atomesh) => self.atomesh(Delaunay::<3>::new()),
            (dimension, connector) => Err(format!("{connector:?} in {dimension}-D").into()),
        }
    }

    fn atomesh<const D: usize>(&self, delaunay: Delaunay<D>) -> Result<Value, Failure> {
        let points = read_points::<D>(&self.points)?;
        let clock = Clock::start();
        let mesh = delaunay.connect(&points, &mut Silent)?;
        let answer = clock.stop();
        finish(answer, self.mesh.as_deref(), &mesh)
    }

    fn spade(&self) -> Result<Value, Failure> {
        let points = read_points::<2>(&self.points)?;
        let vertices = points.iter().map(|&[x, y]| Point2::new(x, y)).collect();
        let clock = Clock::start();
        let triangulation = DelaunayTriangulation::<Point2<f64>>::bulk_load_stable(vertices)?;
        let faces = triangulation.inner_faces();
        let corners: Vec<u32> =
            faces.flat_map(|face| face.vertices().map(|v| v.fix().index() as u32)).collect();
        let answer = clock.stop();
        let at = |p: Point2<f64>| -> Point<2> { [p.x, p.y] };
        let points = triangulation.vertices().map(|v| at(v.position())).collect();
        finish(answer, self.mesh.as_deref(), &Mesh::new(points, corners)?)
    }
}

fn finish<const D: usize>(
    mut answer: Value,
    path: Option<&Path>,
    mesh: &Mesh<D>,
) -> Result<Value, Failure> {
    write_mesh(path, mesh)?;
    answer["points"] = mesh.points().len().into();
    answer["cells"] = mesh.cell_count().into();
    Ok(answer)
}
