//! Regions painted by hand: what parts and cells belong to.
//!
//! A stroke gives the parts that it touches, or single cells, a region's number; 0 takes them out of any. What is kept is
//! the region of each cell of the mesh that was painted last, and where its atoms were. Another mesh has it from there by
//! the rule of `atomesh::region::carry`: with atoms that were moved by hand since, else by the place. So what is seen is a
//! function of the gestures, however often a mesh was made between them.

use std::collections::BTreeMap;
use std::sync::Arc;

use atomesh::geometry::Point;
use atomesh::mesh::{MASK_NAME, Regions, is_feature_name, region_name};
use atomesh::region::{AtomMoves, CellFinder};
use atomesh::run::Outcome;
use atomesh::watch::Watch;
use atomesh_job::JobError;

use super::Model;
use super::paint::distance_to_segment;
use super::parts::PartEdit;

/// The greatest number of a region.
pub const MOST_REGIONS: u32 = 64;

/// The name of what is in no region.
const REST: &str = "rest";

/// What was painted, and how parts were changed for it.
#[derive(Clone, Debug)]
pub struct Painted<const D: usize> {
    cells: Option<Arc<Cells<D>>>,
    names: BTreeMap<u32, String>,
    pub(super) part_edits: Vec<PartEdit<D>>,
    /// Counts how often the atoms were made again: atoms of another count are others.
    atoms_made: u32,
}

impl<const D: usize> Default for Painted<D> {
    fn default() -> Self {
        Self { cells: None, names: BTreeMap::new(), part_edits: Vec::new(), atoms_made: 0 }
    }
}

impl<const D: usize> Painted<D> {
    /// Whether any cell was given a region.
    pub fn is_any(&self) -> bool {
        self.cells.is_some()
    }

    /// Atoms were made again: none is the same as before.
    pub(super) fn lose_atoms(&mut self) {
        self.atoms_made += 1;
    }

    /// Bytes, about.
    pub fn bytes(&self) -> usize {
        self.cells.as_ref().map_or(0, |cells| 4 * cells.regions.len() + 8 * D * cells.atoms.len())
    }

    /// The name of a region.
    pub fn name(&self, region: u32) -> String {
        self.names.get(&region).cloned().unwrap_or_else(|| region_name(region as i32))
    }
}

/// The cells of the mesh that was painted last.
#[derive(Debug)]
struct Cells<const D: usize> {
    finder: Arc<CellFinder<D>>,
    outcome: Arc<Outcome<D>>,
    regions: Vec<i32>,
    /// Where each atom was, by its number; `None` for one that was removed.
    atoms: Vec<Option<Point<D>>>,
    atoms_made: u32,
}

/// A stroke of the brush, in lattice units, and what it changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stroke<'a, const D: usize> {
    /// The path.
    pub path: &'a [Point<D>],
    /// The brush's radius.
    pub radius: f64,
    /// The level whose parts it touches; `None`: single cells.
    pub level: Option<usize>,
    /// The region whose cells alone it changes.
    pub over: Option<u32>,
}

/// A region as it lies on the mesh.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ShownRegion {
    /// Its number, from 1.
    pub region: u32,
    /// Its name.
    pub name: String,
    /// How many cells it has.
    pub cells: usize,
    /// Their area or volume in world units.
    pub measure: f64,
}

/// The region of each cell of the mesh, 0 for none, and what they amount to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OnMesh {
    /// The region of each cell.
    pub of_cells: Vec<i32>,
    /// The regions that have cells, by their numbers.
    pub regions: Vec<ShownRegion>,
}

impl<const D: usize> Model<D> {
    /// What was painted.
    pub fn regions(&self) -> &Painted<D> {
        &self.regions
    }

    /// The regions as they lie on the mesh; none are no regions at all.
    ///
    /// # Errors
    /// [`JobError`], also if the watch ends the work.
    pub fn on_mesh(&mut self, watch: &mut dyn Watch) -> Result<Option<Arc<OnMesh>>, JobError> {
        let Some(cells) = self.regions.cells.clone() else { return Ok(None) };
        if let Some(known) = self.stages.regions() {
            return Ok(Some(known));
        }
        let outcome = self.refresh(watch)?;
        let of_cells = self.carried(&cells, &outcome);
        let regions = self.shown(&outcome, &of_cells);
        Ok(Some(self.stages.keep_regions(OnMesh { of_cells, regions })))
    }

    /// The regions as exporters take them; none are no regions at all.
    ///
    /// # Errors
    /// [`JobError`], also if the watch ends the work.
    pub fn exported_regions(&mut self, watch: &mut dyn Watch) -> Result<Option<Regions>, JobError> {
        let Some(on_mesh) = self.on_mesh(watch)? else { return Ok(None) };
        let own = on_mesh.regions.iter().map(|shown| (shown.region as i32, shown.name.clone()));
        let has_rest = on_mesh.of_cells.contains(&0);
        let rest = has_rest.then(|| (0, REST.to_owned()));
        let names = rest.into_iter().chain(own).collect();
        Ok(Some(Regions { of_cells: on_mesh.of_cells.clone(), names }))
    }

    /// Finds the cells of the mesh.
    ///
    /// # Errors
    /// [`JobError`], also if the watch ends the work.
    pub fn finder(&mut self, watch: &mut dyn Watch) -> Result<Arc<CellFinder<D>>, JobError> {
        if let Some(finder) = self.stages.finder() {
            return Ok(finder);
        }
        let outcome = self.refresh(watch)?;
        let finder = match outcome.cells() {
            Some(cells) => CellFinder::of_sites(cells.centers()),
            None => CellFinder::of_mesh(outcome.mesh()),
        };
        Ok(self.stages.keep_finder(finder))
    }

    /// Gives what a stroke touches a region: the parts of a level, or without one the cells.
    pub(super) fn paint_region(
        &mut self,
        region: u32,
        stroke: Stroke<'_, D>,
        watch: &mut dyn Watch,
    ) -> Result<(), JobError> {
        check_number(region, 0)?;
        check_number(stroke.over.unwrap_or(0), 0)?;
        let touched = self.touched(stroke, watch)?;
        let chosen: Vec<bool> = match stroke.level {
            None => {
                let mut chosen = vec![false; self.finder(watch)?.cell_count()];
                touched.iter().for_each(|&cell| chosen[cell as usize] = true);
                chosen
            }
            Some(level) => {
                let parts = self.parts(level, watch)?;
                let mut of_stroke: Vec<i32> =
                    touched.iter().map(|&cell| parts[cell as usize]).collect();
                of_stroke.sort_unstable();
                of_stroke.dedup();
                parts.iter().map(|part| of_stroke.binary_search(part).is_ok()).collect()
            }
        };
        let before = self.on_mesh(watch)?;
        let mut regions =
            before.map_or_else(|| vec![0; chosen.len()], |known| known.of_cells.clone());
        let over = stroke.over.map(|over| over as i32);
        for (own, chosen) in regions.iter_mut().zip(chosen) {
            if chosen && over.is_none_or(|over| *own == over) {
                *own = region as i32;
            }
        }
        let is_none = regions.iter().all(|own| *own == 0);
        let cells = Cells {
            finder: self.finder(watch)?,
            outcome: self.refresh(watch)?,
            regions,
            atoms: self.atoms_now(),
            atoms_made: self.regions.atoms_made,
        };
        self.regions.cells = (!is_none).then(|| Arc::new(cells));
        self.stages.forget_regions();
        Ok(())
    }

    /// Names a region.
    pub(super) fn name_region(&mut self, region: u32, name: &str) -> Result<(), JobError> {
        check_number(region, 1)?;
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
        let begins = name.starts_with(|c: char| c.is_ascii_alphabetic());
        if !begins || name.len() > 64 || !name.chars().all(is_plain) {
            let message = format!(
                "the name {name:?}; expected a letter, then letters, digits, '_', '-' or '.', 64 at most"
            );
            return Err(JobError::misuse(message));
        }
        let others = (1..=MOST_REGIONS).filter(|other| *other != region);
        let is_taken =
            is_other_name(name) || others.into_iter().any(|o| self.regions.name(o) == name);
        if is_taken {
            return Err(JobError::misuse(format!("the name {name:?} is that of something else")));
        }
        self.regions.names.insert(region, name.into());
        self.stages.forget_regions();
        Ok(())
    }

    /// The cells at a path, and those whose middles are nearer to it than the brush's radius; ascending.
    fn touched(
        &mut self,
        Stroke { path, radius, .. }: Stroke<'_, D>,
        watch: &mut dyn Watch,
    ) -> Result<Vec<u32>, JobError> {
        if !(0.0..=1e9).contains(&radius) {
            let message = format!("a brush of radius {radius}; expected a length of 0 or more");
            return Err(JobError::misuse(message));
        }
        let finder = self.finder(watch)?;
        let outcome = self.refresh(watch)?;
        let mut cells = finder.along(path, self.stroke_step());
        if radius > 0.0 {
            let middles = middles(&outcome, &AtomMoves::none());
            let near = middles.iter().zip(0..).filter(|(p, _)| is_near(p, path, radius));
            cells.extend(near.map(|(_, cell): (_, u32)| cell));
            cells.sort_unstable();
            cells.dedup();
        }
        Ok(cells)
    }

    /// Where the atoms are, by their numbers.
    fn atoms_now(&self) -> Vec<Option<Point<D>>> {
        match &self.edited {
            Some(edited) => edited.atoms().map(|atom| atom.map(|(place, _)| place)).collect(),
            None => self.stages.settled_atoms().iter().copied().map(Some).collect(),
        }
    }

    /// What the cells of a mesh have of those that were painted.
    fn carried(&self, painted: &Cells<D>, outcome: &Outcome<D>) -> Vec<i32> {
        let is_voronoi = |of: &Outcome<D>| of.cells().is_some();
        if painted.outcome.mesh() == outcome.mesh()
            && is_voronoi(&painted.outcome) == is_voronoi(outcome)
        {
            return painted.regions.clone();
        }
        let moves = match painted.atoms_made == self.regions.atoms_made {
            false => AtomMoves::none(),
            true => {
                let now = self.atoms_now();
                let (mut from, mut to) = (Vec::new(), Vec::new());
                for (number, place) in now.iter().enumerate() {
                    if let Some(place) = place {
                        let before = painted.atoms.get(number).copied().flatten();
                        from.push(before.unwrap_or(*place));
                        to.push(*place);
                    }
                }
                AtomMoves::new(from, to)
            }
        };
        painted.finder.carried(&painted.regions, &middles(outcome, &moves))
    }

    /// The regions in numbers.
    fn shown(&self, outcome: &Outcome<D>, of_cells: &[i32]) -> Vec<ShownRegion> {
        let mut found: BTreeMap<i32, (usize, f64)> = BTreeMap::new();
        let measures: Vec<f64> = match outcome.world_cells() {
            Some(cells) => cells.measures().to_vec(),
            None => outcome.world_mesh().simplices().map(|cell| cell.measure().abs()).collect(),
        };
        for (region, measure) in of_cells.iter().zip(measures).filter(|(region, _)| **region > 0) {
            let sums = found.entry(*region).or_default();
            *sums = (sums.0 + 1, sums.1 + measure);
        }
        let shown = |(region, (cells, measure)): (i32, (usize, f64))| {
            let region = region as u32;
            ShownRegion { region, name: self.regions.name(region), cells, measure }
        };
        found.into_iter().map(shown).collect()
    }
}

/// Where the middles of the cells were.
fn middles<const D: usize>(outcome: &Outcome<D>, moves: &AtomMoves<D>) -> Vec<Point<D>> {
    match outcome.cells() {
        Some(cells) => moves.sites(cells.centers()),
        None => moves.middles(outcome.mesh()),
    }
}

fn is_near<const D: usize>(p: &Point<D>, path: &[Point<D>], radius: f64) -> bool {
    let near = |from: &Point<D>, to: &Point<D>| {
        let is_in =
            |k: usize| p[k] >= from[k].min(to[k]) - radius && p[k] <= from[k].max(to[k]) + radius;
        (0..D).all(is_in) && distance_to_segment(p, from, to) < radius
    };
    match path {
        [at] => near(at, at),
        _ => path.windows(2).any(|ends| near(&ends[0], &ends[1])),
    }
}

fn check_number(region: u32, least: u32) -> Result<(), JobError> {
    match (least..=MOST_REGIONS).contains(&region) {
        true => Ok(()),
        false => {
            let message = format!("region {region}; expected {least} to {MOST_REGIONS}");
            Err(JobError::misuse(message))
        }
    }
}

/// Whether a group of facets or points may have the name, or what is in no region has it.
fn is_other_name(name: &str) -> bool {
    let is_side = name.len() == 4 && (name.ends_with("min") || name.ends_with("max"));
    let is_numbered = ["well-", "interface-"].iter().any(|start| name.starts_with(start));
    is_side || is_numbered || is_feature_name(name) || [MASK_NAME, REST].contains(&name)
}
