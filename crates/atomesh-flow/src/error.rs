//! Why flow cannot be computed.

use atomesh::watch::Cancelled;

use crate::solve::SolveError;

/// Why flow cannot be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FlowError {
    /// A value that is not a permeability.
    #[error(
        "the permeability of cell {cell} is {value:?}; expected a number above 0, or a symmetric tensor whose \
         principal values are above 0"
    )]
    Permeability {
        /// The cell.
        cell: usize,
        /// Its tensor, row by row.
        value: Vec<f64>,
    },
    /// The number of permeabilities is not that of the cells.
    #[error("permeabilities of {found} cells; the mesh has {expected}")]
    PermeabilityCount {
        /// The number given.
        found: usize,
        /// The number of cells.
        expected: usize,
    },
    /// A tensor, which two-point flux cannot treat.
    #[error(
        "the permeability is a tensor, which two-point flux on Voronoi cells cannot treat; expected one number \
         for each cell, or a mesh of triangles or tetrahedra"
    )]
    Tensor,
    /// A face between two Voronoi cells that is not normal to the line between their sites.
    #[error(
        "the normal of the face between cells {} and {} and the line between their sites have the cosine {cosine}; \
         expected 1, as in Voronoi cells that no frame has stretched or sheared",
        .cells[0], .cells[1]
    )]
    Skewed {
        /// The cells.
        cells: [u32; 2],
        /// The cosine of the angle.
        cosine: f64,
    },
    /// An unknown group of facets.
    #[error("no facets are named {name:?}; known are {known}")]
    Group {
        /// The name asked for.
        name: String,
        /// The known names.
        known: String,
    },
    /// A condition on facets inside the mesh, or a barrier on the boundary.
    #[error("the facets named {name:?} {found}; expected {expected}")]
    Place {
        /// The group's name.
        name: String,
        /// Where facets of it lie.
        found: &'static str,
        /// Where they should.
        expected: &'static str,
    },
    /// A multiplier outside 0…1.
    #[error("the multiplier of {name:?} is {value}; expected 0 to 1")]
    Multiplier {
        /// The barrier's group.
        name: String,
        /// The value found.
        value: f64,
    },
    /// A rate, pressure or flux that is not finite.
    #[error("the {what} of {name:?} is {value}; expected a finite number")]
    NotFinite {
        /// The well or group.
        name: String,
        /// Rate, pressure or flux.
        what: &'static str,
        /// The value found.
        value: f64,
    },
    /// A well outside the mesh.
    #[error("the well {name:?} at {place:?} lies outside the mesh")]
    WellOutside {
        /// The well.
        name: String,
        /// Its place.
        place: Vec<f64>,
    },
    /// A well without a radius, or with one that is too large.
    #[error(
        "the well {name:?} has the radius {found}; expected one above 0 and below {equivalent}, the equivalent radius of its cells"
    )]
    WellRadius {
        /// The well.
        name: String,
        /// Its radius, 0 where there is none.
        found: f64,
        /// The equivalent radius of its cells.
        equivalent: f64,
    },
    /// The rates of a compartment without a given pressure do not balance.
    #[error(
        "compartment {compartment} ({cells} cells, {share:.3} of the mesh, with {inside}) has no given pressure, \
         and {rate} flows in; expected rates that sum to 0, or a given pressure, or no barrier around it"
    )]
    Unbalanced {
        /// Its number, from 1.
        compartment: usize,
        /// The number of its cells.
        cells: usize,
        /// Its share of the mesh's volume.
        share: f64,
        /// Its wells and boundaries.
        inside: String,
        /// The sum of all rates.
        rate: f64,
    },
    /// An order outside the range of the form.
    #[error("order {found} of the {form} form; expected {least} to {most}")]
    Order {
        /// The order asked for.
        found: usize,
        /// The form's name.
        form: &'static str,
        /// The lowest order that is stable.
        least: usize,
        /// The highest order that there is.
        most: usize,
    },
    /// A penalty factor below 1, with which the equations may be unstable.
    #[error("the penalty factor is {value}; expected a finite number, 1 or more")]
    Penalty {
        /// The factor found.
        value: f64,
    },
    /// Discontinuous Galerkin on Voronoi cells.
    #[error(
        "the discontinuous Galerkin scheme does not work on Voronoi cells; expected triangles or tetrahedra"
    )]
    NotSimplices,
    /// A value that is not a porosity.
    #[error("the porosity of cell {cell} is {value}; expected more than 0, at most 1")]
    Porosity {
        /// The cell.
        cell: usize,
        /// The value found.
        value: f64,
    },
    /// The number of porosities is not that of the cells.
    #[error("porosities of {found} cells; the mesh has {expected}")]
    PorosityCount {
        /// The number given.
        found: usize,
        /// The number of cells.
        expected: usize,
    },
    /// The linear equations were not solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The watch ended the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
