//! A problem placed on a grid: every name found, every compartment solvable.

use atomesh::geometry::Sets;

use crate::error::FlowError;
use crate::grid::{FlowFacet, Grid, cell_mean, facet_integral};
use crate::permeability::Permeability;
use crate::problem::{Condition, Control, Problem, Well};

/// Rates that sum to less than this share of their magnitudes sum to 0.
const BALANCED: f64 = 1e-9;

/// A well with the cells that it flows into.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedWell {
    /// The well's number in the problem.
    pub well: usize,
    /// The cells that hold its place, ascending, of one compartment; what flows is spread over their volume.
    pub cells: Vec<u32>,
    /// The volume of the cells (area in 2-D).
    pub measure: f64,
    /// The mean of the cells' permeabilities, by volume.
    pub permeability: f64,
}

/// Cells between which something can flow.
#[derive(Clone, Debug, PartialEq)]
pub struct Compartment {
    /// How many cells.
    pub cell_count: usize,
    /// Their volume (area in 2-D).
    pub measure: f64,
    /// The lowest cell.
    pub first: u32,
    /// What flows in through wells of given rate, boundaries of given flux, and the source term.
    pub rate: f64,
    /// Whether a well or boundary fixes a pressure. If not, the pressure is known up to a constant.
    pub has_pressure: bool,
}

/// A problem placed on a grid, found to have an answer.
#[derive(Clone, Debug)]
pub struct Setting<'a, const D: usize> {
    problem: &'a Problem<'a, D>,
    multipliers: Vec<f64>,
    conditions: Vec<Option<u32>>,
    wells: Vec<PlacedWell>,
    compartments: Vec<Compartment>,
    compartment_of: Vec<u32>,
    sources: Vec<f64>,
}

impl<'a, const D: usize> Setting<'a, D> {
    /// Finds the facets and cells that the problem names, and the compartments that its sealed barriers
    /// (multiplier 0) cut the grid into. Cost: O(cells), and as much for each well.
    ///
    /// A well in a place that more cells than one share, such as a point of the mesh, flows into all of them, as
    /// far as no barrier lies between.
    ///
    /// # Errors
    /// [`FlowError`] names what is not found, out of range or not finite; and a compartment with a well, a flux or a
    /// source, but no pressure, whose rates do not sum to 0.
    pub fn new(problem: &'a Problem<'a, D>, grid: &Grid<D>) -> Result<Self, FlowError> {
        problem.permeability.check(grid.cell_count())?;
        let multipliers = multipliers(problem, grid)?;
        let conditions = conditions(problem, grid)?;
        let roots = roots(grid, &multipliers);
        let compartment_of = numbers(&roots);
        let wells = place_wells(problem, grid, &multipliers)?;
        let source = |cell: usize| {
            problem.source.map_or(0.0, |q| cell_mean(grid, cell, &q) * grid.measures()[cell])
        };
        let sources = (0..grid.cell_count()).map(source).collect();
        let mut setting = Self {
            problem,
            multipliers,
            conditions,
            wells,
            compartments: Vec::new(),
            compartment_of,
            sources,
        };
        setting.compartments = setting.find_compartments(grid);
        setting.check_balance(grid)?;
        Ok(setting)
    }

    /// The problem.
    pub fn problem(&self) -> &'a Problem<'a, D> {
        self.problem
    }

    /// The permeability.
    pub fn permeability(&self) -> &'a Permeability<D> {
        &self.problem.permeability
    }

    /// The multiplier of each facet: 1 where nothing hinders flow.
    pub fn multipliers(&self) -> &[f64] {
        &self.multipliers
    }

    /// The condition on a facet of the boundary, if there is one. `None` elsewhere: nothing flows.
    pub fn condition(&self, facet: usize) -> Option<Condition<'a, D>> {
        let number = self.conditions[facet]?;
        Some(self.problem.boundaries[number as usize].condition)
    }

    /// The number in the problem of the condition on a facet of the boundary.
    ///
    /// # Panics
    /// If there is none.
    pub(crate) fn boundary(&self, facet: usize) -> u32 {
        self.conditions[facet].expect("a condition holds on the facet")
    }

    /// The wells with their cells, in the problem's order.
    pub fn wells(&self) -> &[PlacedWell] {
        &self.wells
    }

    /// The compartments, in the order of their lowest cells.
    pub fn compartments(&self) -> &[Compartment] {
        &self.compartments
    }

    /// The compartments whose pressure nothing fixes, each with the cell in which schemes make its mean 0.
    pub fn pinned(&self) -> impl Iterator<Item = (usize, u32)> + '_ {
        let all = self.compartments.iter().enumerate();
        all.filter(|(_, own)| !own.has_pressure).map(|(number, own)| (number, own.first))
    }

    /// The compartment of each cell, from 0.
    pub fn compartment_of(&self) -> &[u32] {
        &self.compartment_of
    }

    /// What the source term brings into each cell, wells apart.
    pub fn sources(&self) -> &[f64] {
        &self.sources
    }

    fn find_compartments(&self, grid: &Grid<D>) -> Vec<Compartment> {
        let count = self.compartment_of.iter().max().map_or(0, |&most| most as usize + 1);
        let none = Compartment {
            cell_count: 0,
            measure: 0.0,
            first: u32::MAX,
            rate: 0.0,
            has_pressure: false,
        };
        let mut all = vec![none; count];
        for (cell, &number) in self.compartment_of.iter().enumerate() {
            let own = &mut all[number as usize];
            own.cell_count += 1;
            own.measure += grid.measures()[cell];
            own.first = own.first.min(cell as u32);
            own.rate += self.sources[cell];
        }
        for (number, facet) in grid.facets().iter().enumerate() {
            let own = &mut all[self.compartment_of[facet.cell as usize] as usize];
            match self.condition(number) {
                Some(Condition::Pressure(_)) => own.has_pressure = true,
                Some(Condition::Flux(value)) => {
                    own.rate += facet_integral(grid, number, &value);
                }
                None => {}
            }
        }
        for placed in &self.wells {
            let own = &mut all[self.compartment_of[placed.cells[0] as usize] as usize];
            match self.problem.wells[placed.well].control {
                Control::Rate(rate) => own.rate += rate,
                Control::Pressure(_) => own.has_pressure = true,
            }
        }
        all
    }

    fn check_balance(&self, grid: &Grid<D>) -> Result<(), FlowError> {
        let whole: f64 = grid.measures().iter().sum();
        for (number, compartment) in self.compartments.iter().enumerate() {
            let scale = self.flow_scale(grid, number as u32);
            if compartment.has_pressure || compartment.rate.abs() <= BALANCED * scale {
                continue;
            }
            return Err(FlowError::Unbalanced {
                compartment: number + 1,
                cells: compartment.cell_count,
                share: compartment.measure / whole,
                inside: self.inside(grid, number as u32),
                rate: compartment.rate,
            });
        }
        Ok(())
    }

    /// The sum of the magnitudes of what flows in and out of a compartment by given rates.
    fn flow_scale(&self, grid: &Grid<D>, compartment: u32) -> f64 {
        let within = |cell: u32| self.compartment_of[cell as usize] == compartment;
        let mut scale = 0.0;
        for placed in self.wells.iter().filter(|placed| within(placed.cells[0])) {
            if let Control::Rate(rate) = self.problem.wells[placed.well].control {
                scale += rate.abs();
            }
        }
        for (cell, q) in self.sources.iter().enumerate() {
            scale += if within(cell as u32) { q.abs() } else { 0.0 };
        }
        for (number, _) in grid.facets().iter().enumerate().filter(|(_, f)| within(f.cell)) {
            if let Some(Condition::Flux(value)) = self.condition(number) {
                scale += facet_integral(grid, number, &value).abs();
            }
        }
        scale
    }

    /// What lies in a compartment, in words.
    fn inside(&self, grid: &Grid<D>, compartment: u32) -> String {
        let within = |cell: u32| self.compartment_of[cell as usize] == compartment;
        let wells = self.wells.iter().filter(|placed| within(placed.cells[0]));
        let mut names: Vec<&str> =
            wells.map(|placed| self.problem.wells[placed.well].name.as_str()).collect();
        for (number, boundary) in self.problem.boundaries.iter().enumerate() {
            let holds = |(at, facet): (usize, &FlowFacet<D>)| {
                self.conditions[at] == Some(number as u32) && within(facet.cell)
            };
            if grid.facets().iter().enumerate().any(holds) {
                names.push(&boundary.group);
            }
        }
        match names.is_empty() {
            true => "a source term".to_string(),
            false => names.join(", "),
        }
    }
}

fn multipliers<const D: usize>(
    problem: &Problem<'_, D>,
    grid: &Grid<D>,
) -> Result<Vec<f64>, FlowError> {
    let mut multipliers = vec![1.0; grid.facets().len()];
    for barrier in &problem.barriers {
        let name = || barrier.group.clone();
        if !(0.0..=1.0).contains(&barrier.multiplier) {
            return Err(FlowError::Multiplier { name: name(), value: barrier.multiplier });
        }
        for &facet in facets_named(grid, &barrier.group)? {
            if grid.facets()[facet as usize].neighbour.is_none() {
                let (found, expected) = ("lie on the boundary", "a barrier inside the mesh");
                return Err(FlowError::Place { name: name(), found, expected });
            }
            multipliers[facet as usize] = barrier.multiplier;
        }
    }
    Ok(multipliers)
}

fn conditions<const D: usize>(
    problem: &Problem<'_, D>,
    grid: &Grid<D>,
) -> Result<Vec<Option<u32>>, FlowError> {
    let mut conditions = vec![None; grid.facets().len()];
    for (number, boundary) in problem.boundaries.iter().enumerate() {
        let (value, what) = match boundary.condition {
            Condition::Pressure(value) => (value, "pressure"),
            Condition::Flux(value) => (value, "flux"),
        };
        for &facet in facets_named(grid, &boundary.group)? {
            let name = || boundary.group.clone();
            let own = &grid.facets()[facet as usize];
            if own.neighbour.is_some() {
                let (found, expected) = ("lie inside the mesh", "facets of the boundary");
                return Err(FlowError::Place { name: name(), found, expected });
            }
            let at = value.at(&own.centroid);
            if !at.is_finite() {
                return Err(FlowError::NotFinite { name: name(), what, value: at });
            }
            conditions[facet as usize] = Some(number as u32);
        }
    }
    Ok(conditions)
}

fn facets_named<'g, const D: usize>(grid: &'g Grid<D>, name: &str) -> Result<&'g [u32], FlowError> {
    match grid.sets().iter().find(|set| set.name == name) {
        Some(set) => Ok(&set.facets),
        None => {
            let known: Vec<&str> = grid.sets().iter().map(|set| set.name.as_str()).collect();
            let known = if known.is_empty() { "none".to_string() } else { known.join(", ") };
            Err(FlowError::Group { name: name.to_string(), known })
        }
    }
}

/// The lowest cell of each cell's compartment.
fn roots<const D: usize>(grid: &Grid<D>, multipliers: &[f64]) -> Vec<u32> {
    let mut sets = Sets::new(grid.cell_count());
    for (facet, &multiplier) in grid.facets().iter().zip(multipliers) {
        if let Some(other) = facet.neighbour.filter(|_| multiplier > 0.0) {
            sets.join(facet.cell, other);
        }
    }
    sets.roots()
}

/// Numbers from 0 in the order of the roots, which are the lowest cells.
fn numbers(roots: &[u32]) -> Vec<u32> {
    let mut numbers = vec![0; roots.len()];
    let mut count = 0;
    for (cell, &root) in roots.iter().enumerate() {
        if root as usize == cell {
            numbers[cell] = count;
            count += 1;
        } else {
            numbers[cell] = numbers[root as usize];
        }
    }
    numbers
}

fn place_wells<const D: usize>(
    problem: &Problem<'_, D>,
    grid: &Grid<D>,
    multipliers: &[f64],
) -> Result<Vec<PlacedWell>, FlowError> {
    let place = |(number, well): (usize, &Well<D>)| {
        let name = || well.name.clone();
        let (value, what) = match well.control {
            Control::Rate(rate) => (rate, "rate"),
            Control::Pressure(pressure) => (pressure, "pressure"),
        };
        if !value.is_finite() {
            return Err(FlowError::NotFinite { name: name(), what, value });
        }
        let found = grid.cells_at(&well.place);
        if found.is_empty() {
            return Err(FlowError::WellOutside { name: name(), place: well.place.to_vec() });
        }
        let cells = one_side(grid, multipliers, found);
        let measures = cells.iter().map(|&cell| grid.measures()[cell as usize]);
        let measure: f64 = measures.clone().sum();
        let weighted = |(&cell, measure): (&u32, f64)| {
            problem.permeability.mean(cell as usize) * measure / cells_measure(grid, &cells)
        };
        let permeability = cells.iter().zip(measures).map(weighted).sum();
        Ok(PlacedWell { well: number, cells, measure, permeability })
    };
    problem.wells.iter().enumerate().map(place).collect()
}

fn cells_measure<const D: usize>(grid: &Grid<D>, cells: &[u32]) -> f64 {
    cells.iter().map(|&cell| grid.measures()[cell as usize]).sum()
}

/// The cells that can be reached from the lowest one through facets between them that are no barrier.
fn one_side<const D: usize>(grid: &Grid<D>, multipliers: &[f64], cells: Vec<u32>) -> Vec<u32> {
    let mut sets = Sets::new(cells.len());
    for (at, &cell) in cells.iter().enumerate() {
        for &facet in grid.facets_of(cell as usize) {
            let other = grid.facets()[facet as usize].neighbour;
            let open = multipliers[facet as usize] == 1.0;
            let to = other.filter(|_| open).and_then(|other| cells.binary_search(&other).ok());
            if let Some(to) = to {
                sets.join(at as u32, to as u32);
            }
        }
    }
    let roots = sets.roots();
    cells.iter().zip(roots).filter(|(_, root)| *root == 0).map(|(&cell, _)| cell).collect()
}

impl PlacedWell {
    /// The radius at which the pressure around the well is the mean of its cells, for a scheme that spreads what
    /// flows over them: of a disk of their area A, R = √(A/π), e^(−1/4) R; of a ball of their volume, 5R/6. Follows
    /// from `−k∇²p = q/A` within the disk or ball, and the field of a line or point outside.
    pub fn equivalent_radius<const D: usize>(&self) -> f64 {
        use std::f64::consts::PI;
        if D == 2 {
            (-0.25_f64).exp() * (self.measure / PI).sqrt()
        } else {
            5.0 / 6.0 * (self.measure * 3.0 / (4.0 * PI)).cbrt()
        }
    }
}

/// The rate of a well per unit of pressure between its wall, of radius `wall`, and the radius `equivalent`: in 2-D
/// `2πk / ln(r_e/r_w)`, in 3-D `4πk / (1/r_w − 1/r_e)`.
///
/// # Errors
/// [`FlowError::WellRadius`] unless 0 < wall < equivalent.
pub fn well_index<const D: usize>(
    name: &str,
    permeability: f64,
    wall: Option<f64>,
    equivalent: f64,
) -> Result<f64, FlowError> {
    use std::f64::consts::PI;
    let found = wall.unwrap_or(0.0);
    if !(found > 0.0 && found < equivalent) {
        return Err(FlowError::WellRadius { name: name.to_string(), found, equivalent });
    }
    Ok(match D {
        2 => 2.0 * PI * permeability / (equivalent / found).ln(),
        _ => 4.0 * PI * permeability / (1.0 / found - 1.0 / equivalent),
    })
}

#[cfg(test)]
mod tests {
    use atomesh::geometry::Bounds;
    use atomesh::mesh::{FacetGroup, Mesh, Tags};

    use super::*;
    use crate::problem::{Barrier, Boundary, Value};

    /// A unit square of 2 × n triangles, cut at x = 1/2 by the group `wall`.
    fn strip() -> Grid<2> {
        let points = (0..6).map(|i| [0.5 * f64::from(i / 2), f64::from(i % 2)]).collect();
        let mesh = Mesh::new(points, vec![0, 2, 1, 2, 3, 1, 2, 4, 3, 4, 5, 3]).unwrap();
        let wall = FacetGroup { id: 9, name: "wall".to_string(), facets: vec![[2, 3]] };
        let bounds = Bounds::of(mesh.points()).unwrap();
        let tags = Tags::sides(&mesh, &bounds, 1e-9)
            .merge(Tags::new(&mesh, vec![wall], None).unwrap())
            .unwrap();
        Grid::of_mesh(&mesh, &tags)
    }

    fn well(name: &str, x: f64, rate: f64) -> Well<2> {
        let control = Control::Rate(rate);
        Well { name: name.to_string(), place: [x, 0.4], control, radius: None }
    }

    fn sealed() -> Vec<Barrier> {
        vec![Barrier { group: "wall".to_string(), multiplier: 0.0 }]
    }

    #[test]
    fn sealed_barriers_part_the_grid() {
        let problem = Problem { barriers: sealed(), ..Problem::default() };
        let grid = strip();
        let setting = Setting::new(&problem, &grid).unwrap();
        assert_eq!(setting.compartment_of(), [0, 0, 1, 1]);
        assert_eq!(setting.pinned().collect::<Vec<_>>(), [(0, 0), (1, 2)]);
        assert!((setting.compartments()[1].measure - 0.5).abs() < 1e-15);
    }

    #[test]
    fn a_compartment_whose_rates_do_not_balance_is_named() {
        let wells = vec![well("source", 0.1, 1.0), well("sink", 0.9, -1.0)];
        let open = Problem { wells: wells.clone(), ..Problem::default() };
        assert!(Setting::new(&open, &strip()).is_ok());
        let parted = Problem { wells, barriers: sealed(), ..Problem::default() };
        let error = Setting::new(&parted, &strip()).unwrap_err();
        assert!(matches!(error, FlowError::Unbalanced { compartment: 1, cells: 2, .. }));
        let text = error.to_string();
        assert!(text.contains("source") && !text.contains("sink"), "{text}");
    }

    #[test]
    fn a_pressure_on_a_side_frees_the_rates_of_its_compartment_alone() {
        let fixed = |group: &str| Boundary {
            group: group.to_string(),
            condition: Condition::Pressure(Value::Constant(1.0)),
        };
        let problem = |group: &str| Problem {
            wells: vec![well("source", 0.1, 1.0)],
            barriers: sealed(),
            boundaries: vec![fixed(group)],
            ..Problem::default()
        };
        assert!(Setting::new(&problem("xmin"), &strip()).is_ok());
        assert!(Setting::new(&problem("xmax"), &strip()).is_err(), "beyond the wall");
    }

    #[test]
    fn a_well_on_a_barrier_flows_to_one_side() {
        let problem = Problem {
            wells: vec![Well { place: [0.5, 0.5], ..well("source", 0.5, 0.0) }],
            barriers: sealed(),
            ..Problem::default()
        };
        let setting = Setting::new(&problem, &strip()).unwrap();
        assert_eq!(setting.wells()[0].cells, [1]);
        let open = Problem { barriers: vec![], ..problem };
        assert_eq!(Setting::new(&open, &strip()).unwrap().wells()[0].cells, [1, 2]);
    }

    #[test]
    fn what_is_not_there_is_named() {
        let grid = strip();
        let fails =
            |problem: Problem<'_, 2>| Setting::new(&problem, &grid).unwrap_err().to_string();
        let barrier = |group: &str, multiplier: f64| Problem {
            barriers: vec![Barrier { group: group.to_string(), multiplier }],
            ..Problem::default()
        };
        assert!(fails(barrier("fault", 0.0)).contains("xmin, xmax, ymin, ymax, wall"));
        assert!(fails(barrier("wall", 1.5)).contains("1.5"));
        assert!(fails(barrier("xmin", 0.5)).contains("boundary"));
        let outside = Problem { wells: vec![well("far", 3.0, 0.0)], ..Problem::default() };
        assert!(fails(outside).contains("far"));
        let odd = Problem { wells: vec![well("odd", 0.1, f64::NAN)], ..Problem::default() };
        assert!(fails(odd).contains("NaN"));
        let inner = Boundary {
            group: "wall".to_string(),
            condition: Condition::Pressure(Value::Constant(0.0)),
        };
        let inside = Problem { boundaries: vec![inner], ..Problem::default() };
        assert!(fails(inside).contains("inside"));
    }
}
