//! What is done with images and meshes outside of a run, as a value.

use crate::cluster::{SharedFacet, shared_faces, shared_facets};
use crate::enhance::{EnhanceError, Enhanced, FeatureOptions, Mixture, enhance, enhance_mixture};
use crate::features::{
    FacetField, FeatureFaces, FeatureFacetOptions, FeatureSet, FeaturesError, feature_faces,
    find_features,
};
use crate::fields::{FieldError, Interpolation, ScalarField};
use crate::geometry::{Bounds, Point};
use crate::image::{Frame, Grid, Image, Samples, Units};
use crate::measure::{
    FidelityReport, HomogeneityReport, MeasureError, ShapeReport, WantedSize, fidelity,
    homogeneity, shape,
};
use crate::mesh::{Delaunay, FacetGroup, Mesh, PolyMesh, PolyReport, Tags};
use crate::sample::{CellProperties, SampleError, SampleOptions, sample};
use crate::voronoi::{VoronoiError, voronoi};
use crate::watch::Watch;

use super::outcome::{lattice_cells, lattice_mesh, sides};
use super::report::{MeshReport, VoronoiReport};

type EnhanceImage<const D: usize> =
    fn(&Image<D>, &FeatureOptions, &mut dyn Watch) -> Result<Enhanced<D>, EnhanceError>;

type EnhanceMixture<const D: usize> =
    fn(&Mixture, &FeatureOptions, &Image<D>, &mut dyn Watch) -> Result<Enhanced<D>, EnhanceError>;

type FieldAlong<const D: usize> =
    fn(&Mesh<D>, &ScalarField<D>, &mut dyn Watch) -> Result<FacetField<D>, FeaturesError>;

type SharedFacets<const D: usize> =
    fn(&Mesh<D>, Option<&FacetField<D>>, &[(&FacetGroup<D>, f64)]) -> Vec<SharedFacet>;

type FindFeatures<const D: usize> =
    fn(&Mesh<D>, &FacetField<D>, &FeatureFacetOptions) -> Result<FeatureSet<D>, FeaturesError>;

type Measure<const D: usize> = fn(
    &Mesh<D>,
    &Grid<D>,
    &[f32],
    WantedSize<'_>,
    &mut dyn Watch,
) -> Result<MeshReport, MeasureError>;

type MeasureCells<const D: usize> =
    fn(&PolyMesh<D>, &Grid<D>, &[f32], f64, &mut dyn Watch) -> Result<VoronoiReport, MeasureError>;

type Shape<const D: usize> =
    fn(&Mesh<D>, Option<&Bounds<D>>, &mut dyn Watch) -> Result<ShapeReport, MeasureError>;

type Potential<const D: usize> =
    fn(Grid<D>, Vec<f32>, Interpolation) -> Result<ScalarField<D>, FieldError>;

type Fidelity<const D: usize> =
    fn(&Mesh<D>, &Frame<D>, &Samples, &mut dyn Watch) -> Result<FidelityReport, MeasureError>;

type Homogeneity<C, const D: usize> =
    fn(&C, &Image<D>, &mut dyn Watch) -> Result<HomogeneityReport, MeasureError>;

type Sample<C, const D: usize> =
    fn(&C, &Image<D>, SampleOptions<'_>, &mut dyn Watch) -> Result<CellProperties, SampleError>;

type Voronoi<const D: usize> =
    fn(&Delaunay<D>, &[Point<D>], Bounds<D>, &mut dyn Watch) -> Result<PolyMesh<D>, VoronoiError>;

/// Functions for images and meshes of `D` axes; each does what the function that it is named after says.
///
/// They are compiled in this crate. Whoever is generic over D and names the functions themselves compiles them
/// again.
#[derive(Clone, Copy)]
pub struct Tools<const D: usize> {
    /// [`enhance`](enhance()).
    pub enhance: EnhanceImage<D>,
    /// [`enhance_mixture`], all kinds from one image.
    pub enhance_mixture: EnhanceMixture<D>,
    /// [`FacetField::along`].
    pub field_along: FieldAlong<D>,
    /// [`find_features`].
    pub find_features: FindFeatures<D>,
    /// [`MeshReport::new`].
    pub measure: Measure<D>,
    /// [`VoronoiReport::new`].
    pub measure_cells: MeasureCells<D>,
    /// [`feature_faces`](feature_faces()).
    pub feature_faces: fn(&PolyMesh<D>, &ScalarField<D>, f64, f64) -> FeatureFaces,
    /// [`shared_facets`].
    pub shared_facets: SharedFacets<D>,
    /// [`shared_faces`], with one multiplier for all features.
    pub shared_faces: fn(&PolyMesh<D>, &FeatureFaces, f64) -> Vec<SharedFacet>,
    /// [`shape`](shape()).
    pub shape: Shape<D>,
    /// [`PolyReport::new`].
    pub cells_shape: fn(&PolyMesh<D>, &Bounds<D>) -> PolyReport,
    /// [`fidelity`](fidelity()).
    pub fidelity: Fidelity<D>,
    /// [`homogeneity`](homogeneity()) of triangles or tetrahedra.
    pub homogeneity: Homogeneity<Mesh<D>, D>,
    /// [`homogeneity`](homogeneity()) of polygons or polyhedra.
    pub homogeneity_of_cells: Homogeneity<PolyMesh<D>, D>,
    /// [`sample`](sample()) in triangles or tetrahedra.
    pub sample: Sample<Mesh<D>, D>,
    /// [`sample`](sample()) in polygons or polyhedra.
    pub sample_cells: Sample<PolyMesh<D>, D>,
    /// [`sides`](sides()).
    pub sides: fn(&Mesh<D>, &Bounds<D>, bool) -> Tags<D>,
    /// [`lattice_mesh`].
    pub lattice_mesh: fn(&Mesh<D>, &Frame<D>, Units) -> Mesh<D>,
    /// [`lattice_cells`].
    pub lattice_cells: fn(&PolyMesh<D>, &Frame<D>, Units) -> PolyMesh<D>,
    /// [`ScalarField::potential`].
    pub potential: Potential<D>,
    /// [`voronoi`](voronoi()).
    pub voronoi: Voronoi<D>,
}

impl Tools<2> {
    /// In the plane.
    pub const fn plane() -> &'static Self {
        &PLANE
    }
}

impl Tools<3> {
    /// In space.
    pub const fn space() -> &'static Self {
        &SPACE
    }
}

static PLANE: Tools<2> = Tools::new();
static SPACE: Tools<3> = Tools::new();

impl<const D: usize> Tools<D> {
    const fn new() -> Self {
        Self {
            enhance,
            enhance_mixture: |mixture, options, image, watch| {
                enhance_mixture(mixture, options, |_| image, watch)
            },
            field_along: FacetField::along,
            find_features,
            measure: MeshReport::new,
            measure_cells: VoronoiReport::new,
            feature_faces,
            shared_facets,
            shared_faces: |mesh, features, multiplier| shared_faces(mesh, features, |_| multiplier),
            shape,
            cells_shape: PolyReport::new,
            fidelity,
            homogeneity,
            homogeneity_of_cells: homogeneity,
            sample,
            sample_cells: sample,
            sides,
            lattice_mesh,
            lattice_cells,
            potential: ScalarField::potential,
            voronoi,
        }
    }
}
