//! Cells and the facets between them: all that both schemes need of a mesh.

use atomesh::features::FeatureFaces;
use atomesh::geometry::{Point, difference, dot};
use atomesh::mesh::{Mesh, PolyMesh, Tags, feature_name, side_name};

use crate::problem::Value;

/// A facet between two cells, or of one cell on the boundary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowFacet<const D: usize> {
    /// The cell that the area vector points out of.
    pub cell: u32,
    /// The cell on the other side, or `None` on the boundary.
    pub neighbour: Option<u32>,
    /// The area vector: the normal out of `cell`, its length the facet's measure.
    pub area: Point<D>,
    /// The facet's centroid.
    pub centroid: Point<D>,
}

impl<const D: usize> FlowFacet<D> {
    /// The facet's length in the plane, its area in space.
    pub fn measure(&self) -> f64 {
        dot(&self.area, &self.area).sqrt()
    }
}

/// Facets with a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FacetSet {
    /// The name, such as `xmin` or `feature-1`.
    pub name: String,
    /// Numbers of facets.
    pub facets: Vec<u32>,
}

/// What decides which cells hold a place.
#[derive(Clone, Debug)]
enum Shape<const D: usize> {
    /// Triangles or tetrahedra.
    Simplices(Mesh<D>),
    /// Voronoi cells: each is the part nearest to its site.
    Cells(Box<PolyMesh<D>>),
}

/// The cells and facets of a mesh, and names of facets.
#[derive(Clone, Debug)]
pub struct FlowGrid<const D: usize> {
    measures: Vec<f64>,
    centroids: Vec<Point<D>>,
    facets: Vec<FlowFacet<D>>,
    sets: Vec<FacetSet>,
    /// The corners of each facet; empty for Voronoi cells.
    corners: Vec<[u32; D]>,
    starts: Vec<u32>,
    facets_of_cells: Vec<u32>,
    shape: Shape<D>,
}

impl<const D: usize> FlowGrid<D> {
    /// The grid of triangles or tetrahedra of positive orientation. Facets are those of [`Mesh::facets`], in that order;
    /// names come from `tags`.
    ///
    /// # Panics
    /// If the tags are another mesh's.
    pub fn of_mesh(mesh: &Mesh<D>, tags: &Tags<D>) -> Self {
        let points = mesh.points();
        let centroids: Vec<Point<D>> = mesh.cells().map(|cell| mean(points, cell)).collect();
        let all = mesh.facets();
        let facets = all.iter().map(|facet| {
            let centroid = mean(points, &facet.corners);
            let mut area = mesh.facet_normal(&facet.corners);
            let out = difference(&centroid, &centroids[facet.cell as usize]);
            if dot(&area, &out) < 0.0 {
                area = area.map(|x| -x);
            }
            FlowFacet { cell: facet.cell, neighbour: facet.neighbour, area, centroid }
        });
        let facets = facets.collect();
        let number = |corners: &[u32; D]| {
            let mut corners = *corners;
            corners.sort_unstable();
            let at = all.binary_search_by(|facet| facet.corners.cmp(&corners));
            at.expect("tags are those of the mesh") as u32
        };
        let set = |name: &str, facets: &[[u32; D]]| FacetSet {
            name: name.to_string(),
            facets: facets.iter().map(number).collect(),
        };
        let groups = tags.facet_groups().iter();
        let sets = groups.map(|group| set(&group.name, &group.facets)).collect();
        let measures = mesh.simplices().map(|simplex| simplex.measure()).collect();
        let corners = all.iter().map(|facet| facet.corners).collect();
        let shape = Shape::Simplices(mesh.clone());
        Self { corners, ..Self::new(measures, centroids, facets, sets, shape) }
    }

    /// The grid of Voronoi cells. Facets are the mesh's faces, in its order. The sides are named `xmin`, ... (see
    /// [`side_name`]), the features `feature-1`, ...
    pub fn of_cells(mesh: &PolyMesh<D>, features: Option<&FeatureFaces>) -> Self {
        let facet = |face: usize| FlowFacet {
            cell: mesh.owners()[face],
            neighbour: mesh.neighbours().get(face).copied(),
            area: mesh.area_vector(face),
            centroid: mesh.face_centroid(face),
        };
        let facets = (0..mesh.face_count()).map(facet).collect();
        let mut sets: Vec<FacetSet> = (0..2 * D)
            .map(|side| FacetSet {
                name: side_name(side).to_string(),
                facets: mesh.side(side).map(|face| face as u32).collect(),
            })
            .collect();
        if let Some(features) = features {
            let first = sets.len();
            let names = (1..=features.areas.len() as u32).map(feature_name);
            sets.extend(names.map(|name| FacetSet { name, facets: Vec::new() }));
            for (face, &number) in features.of_faces.iter().enumerate().filter(|(_, n)| **n > 0) {
                sets[first + number as usize - 1].facets.push(face as u32);
            }
        }
        let shape = Shape::Cells(Box::new(mesh.clone()));
        Self::new(mesh.measures().to_vec(), mesh.centroids().to_vec(), facets, sets, shape)
    }

    fn new(
        measures: Vec<f64>,
        centroids: Vec<Point<D>>,
        facets: Vec<FlowFacet<D>>,
        sets: Vec<FacetSet>,
        shape: Shape<D>,
    ) -> Self {
        let mut starts = vec![0_u32; measures.len() + 1];
        let beside = |facet: &FlowFacet<D>| std::iter::once(facet.cell).chain(facet.neighbour);
        for cell in facets.iter().flat_map(beside) {
            starts[cell as usize + 1] += 1;
        }
        for cell in 0..measures.len() {
            starts[cell + 1] += starts[cell];
        }
        let mut next = starts.clone();
        let mut facets_of_cells = vec![0; starts[measures.len()] as usize];
        for (number, facet) in facets.iter().enumerate() {
            for cell in beside(facet) {
                let place = &mut next[cell as usize];
                facets_of_cells[*place as usize] = number as u32;
                *place += 1;
            }
        }
        let corners = Vec::new();
        Self { measures, centroids, facets, sets, corners, starts, facets_of_cells, shape }
    }

    /// The number of cells.
    pub fn cell_count(&self) -> usize {
        self.measures.len()
    }

    /// The area (plane) or volume (space) of each cell.
    pub fn measures(&self) -> &[f64] {
        &self.measures
    }

    /// The centroid of each cell.
    pub fn centroids(&self) -> &[Point<D>] {
        &self.centroids
    }

    /// The facets.
    pub fn facets(&self) -> &[FlowFacet<D>] {
        &self.facets
    }

    /// The corners of a facet, ascending; `None` for Voronoi cells.
    pub fn facet_corners(&self, facet: usize) -> Option<&[u32; D]> {
        self.corners.get(facet)
    }

    /// The facets with names.
    pub fn sets(&self) -> &[FacetSet] {
        &self.sets
    }

    /// Adds a name for facets.
    ///
    /// # Panics
    /// If there is no such facet.
    pub fn add_set(&mut self, set: FacetSet) {
        assert!(set.facets.iter().all(|&facet| (facet as usize) < self.facets.len()));
        self.sets.push(set);
    }

    /// The numbers of a cell's facets, ascending.
    pub fn facets_of(&self, cell: usize) -> &[u32] {
        &self.facets_of_cells[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// The cells that hold a place, ascending. Of triangles and tetrahedra there are several if it lies on a common facet
    /// or corner, to 10⁻⁹ of a cell's height; of Voronoi cells one, that of the nearest site. None outside the mesh.
    /// Cost: O(cells).
    pub fn cells_at(&self, place: &Point<D>) -> Vec<u32> {
        match &self.shape {
            Shape::Simplices(mesh) => simplices_at(mesh, place),
            Shape::Cells(mesh) => {
                let sites = mesh.centers();
                let away = |site: &Point<D>| {
                    let way = difference(site, place);
                    dot(&way, &way)
                };
                let nearest =
                    (0..sites.len()).min_by(|&a, &b| away(&sites[a]).total_cmp(&away(&sites[b])));
                let holds = |cell: &usize| {
                    self.facets_of(*cell).iter().all(|&number| {
                        let facet = &self.facets[number as usize];
                        let inside = dot(&difference(place, &facet.centroid), &facet.area);
                        facet.neighbour.is_some() || inside <= 1e-9 * self.measures[*cell]
                    })
                };
                nearest.filter(holds).map(|cell| cell as u32).into_iter().collect()
            }
        }
    }

    /// The sites of Voronoi cells; `None` for triangles and tetrahedra.
    pub fn sites(&self) -> Option<&[Point<D>]> {
        self.cells().map(PolyMesh::centers)
    }

    /// The mesh of triangles or tetrahedra; `None` for Voronoi cells.
    pub fn mesh(&self) -> Option<&Mesh<D>> {
        match &self.shape {
            Shape::Simplices(mesh) => Some(mesh),
            Shape::Cells(_) => None,
        }
    }

    /// The mesh of Voronoi cells; `None` for triangles and tetrahedra.
    pub fn cells(&self) -> Option<&PolyMesh<D>> {
        match &self.shape {
            Shape::Cells(mesh) => Some(mesh),
            Shape::Simplices(_) => None,
        }
    }
}

fn mean<const D: usize>(points: &[Point<D>], corners: &[u32]) -> Point<D> {
    let sum = |axis: usize| corners.iter().map(|&c| points[c as usize][axis]).sum::<f64>();
    std::array::from_fn(|axis| sum(axis) / corners.len() as f64)
}

/// The simplices in which all barycentric coordinates of `place` are 0 or more, to 10⁻⁹.
fn simplices_at<const D: usize>(mesh: &Mesh<D>, place: &Point<D>) -> Vec<u32> {
    let holds = |cell: &&[u32]| {
        let simplex = mesh.simplex(cell);
        let whole = simplex.measure();
        (0..=D).all(|corner| {
            let mut part = simplex;
            match corner {
                0 => part.first = *place,
                _ => part.others[corner - 1] = *place,
            }
            part.measure() >= -1e-9 * whole
        })
    };
    let near = |cell: &&[u32]| {
        (0..D).all(|axis| {
            let at = |&c: &u32| mesh.points()[c as usize][axis];
            let (low, high) =
                cell.iter().map(at).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
                    (low.min(x), high.max(x))
                });
            let slack = 1e-9 * (high - low);
            place[axis] >= low - slack && place[axis] <= high + slack
        })
    };
    let cells = mesh.cells().enumerate();
    cells.filter(|(_, cell)| near(cell) && holds(cell)).map(|(at, _)| at as u32).collect()
}

/// The mean of a value over a cell: exact for quadratic fields in triangles and tetrahedra (a weighted mean of the
/// corners and the centroid), the value at the centroid in Voronoi cells.
pub(crate) fn cell_mean<const D: usize>(
    grid: &FlowGrid<D>,
    cell: usize,
    value: &Value<'_, D>,
) -> f64 {
    let centre = &grid.centroids[cell];
    if let (Value::Field(_), Shape::Simplices(mesh)) = (value, &grid.shape) {
        let corners = &mesh.corners()[cell * (D + 1)..(cell + 1) * (D + 1)];
        return quadratic_mean(mesh.points(), corners, centre, value);
    }
    value.at(centre)
}

/// The integral of a value over a facet: exact for quadratic fields on facets of triangles and tetrahedra, the value at
/// the centroid times the area on faces of Voronoi cells.
pub(crate) fn facet_integral<const D: usize>(
    grid: &FlowGrid<D>,
    facet: usize,
    value: &Value<'_, D>,
) -> f64 {
    let own = &grid.facets[facet];
    let measure = own.measure();
    if let (Value::Field(_), Some(corners)) = (value, grid.corners.get(facet)) {
        let mesh = grid.mesh().expect("only meshes have facets of D corners");
        return measure * quadratic_mean(mesh.points(), corners, &own.centroid, value);
    }
    measure * value.at(&own.centroid)
}

/// The mean over the simplex of n corners: `Σ f(corner) / (n (n + 1)) + f(centroid) n / (n + 1)`.
fn quadratic_mean<const D: usize>(
    points: &[Point<D>],
    corners: &[u32],
    centre: &Point<D>,
    value: &Value<'_, D>,
) -> f64 {
    // the mean of x² about the centroid of a simplex of n corners is Σ x_i² / (n (n + 1)): the corners' weight
    let n = corners.len() as f64;
    let sum: f64 = corners.iter().map(|&c| value.at(&points[c as usize])).sum();
    let corner = 1.0 / (n * (n + 1.0));
    corner * sum + (1.0 - n * corner) * value.at(centre)
}
