//! What flows, and how it was found.

use atomesh_draw::Picture;
use atomesh_flow::dg::DgSolution;
use atomesh_flow::streamlines::{Porosity, Streamline, TraceOptions};
use atomesh_flow::{Balance, FlowGrid, FlowMethod, Problem, Setting, Solution};
use serde_json::{Value, json};

use super::files::FlowFiles;
use super::flow_mesh::{FlowMesh, FlowMeshCells};
use super::leak::Leak;
use super::options::FlowOutputOptions;
use super::picture::{FlowDrawing, FlowPictureOptions};
use super::write::FlowWriting;
use crate::dimension::Dimension;
use crate::error::JobError;
use crate::options::InputOptions;
use crate::session::Session;

/// What flows in a mesh, with all that it was computed from.
#[derive(Clone, Debug)]
pub struct FlowAnswer<const D: usize> {
    /// What it was computed on.
    pub mesh: FlowMesh<D>,
    /// Cells and facets.
    pub grid: FlowGrid<D>,
    /// What was asked.
    pub problem: Problem<'static, D>,
    /// Pressures and fluxes.
    pub solution: Solution<D>,
    /// The mean velocity of each cell.
    pub velocities: Vec<[f64; D]>,
    /// The answer of the discontinuous Galerkin scheme, on triangles and tetrahedra.
    pub galerkin: Option<DgSolution<D>>,
    /// The share of the volume that the fluid fills.
    pub porosity: f64,
    /// What flows across features where they have no facets, if they are barriers and something does.
    pub leak: Option<Leak>,
}

impl<const D: usize> FlowAnswer<D> {
    /// The problem placed on the grid, as streamlines need it. Cost: O(cells).
    pub fn setting(&self, method: &FlowMethod<D>) -> Setting<'_, D> {
        (method.setting)(&self.problem, &self.grid).expect("it was solved")
    }

    /// What was solved, as in `discontinuous Galerkin of order 2`.
    pub fn scheme(&self) -> String {
        match &self.galerkin {
            Some(galerkin) => format!("discontinuous Galerkin of order {}", galerkin.order()),
            None => "two-point flux".to_string(),
        }
    }

    /// The permeability of each cell, where it is one number.
    pub fn permeabilities(&self) -> Option<Vec<f64>> {
        (0..self.grid.cell_count()).map(|cell| self.problem.permeability.scalar(cell)).collect()
    }

    /// What flows in and out.
    pub fn balance(&self, method: &FlowMethod<D>) -> Balance {
        (method.balance)(&self.solution, &self.grid)
    }

    /// Writes the files that options name.
    ///
    /// # Errors
    /// [`JobError`] if a name is of no use, a file cannot be written, or the watch ends the work.
    pub fn write(
        &self,
        options: &FlowOutputOptions,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        let files = FlowFiles::new(options)?;
        if matches!(self.mesh.cells, FlowMeshCells::Voronoi { .. }) {
            files.check_for_voronoi()?;
        }
        files.check(&InputOptions::default(), session)?;
        FlowWriting::new(&files, self, dimension).write(session)
    }

    /// So many streamlines, shared among sources by their rates.
    ///
    /// # Errors
    /// [`JobError`] if the watch ends the work.
    pub fn streamlines(
        &self,
        count: usize,
        method: &FlowMethod<D>,
        session: &mut Session<'_>,
    ) -> Result<Vec<Streamline<D>>, JobError> {
        let porosity = Porosity::Constant(self.porosity);
        let options = TraceOptions { count, porosity, ..TraceOptions::default() };
        let setting = self.setting(method);
        Ok((method.trace)(&self.grid, &setting, &self.solution, &options, session)?)
    }

    /// A picture of the flow.
    ///
    /// # Errors
    /// [`JobError`] if it cannot be drawn.
    pub fn picture(
        &self,
        shown: &FlowPictureOptions<'_, D>,
        dimension: &Dimension<D>,
    ) -> Result<Picture, JobError> {
        let setting = &self.setting(&dimension.flow);
        FlowDrawing { answer: self, setting, shown }.picture(dimension)
    }

    /// Everything in numbers.
    pub(super) fn report(
        &self,
        setting: &Setting<'_, D>,
        method: &FlowMethod<D>,
        session: &Session<'_>,
    ) -> Value {
        let balance = self.balance(method);
        let compartments: Vec<_> = (setting.compartments().iter().enumerate())
            .map(|(number, own)| {
                json!({
                    "compartment": number + 1,
                    "cells": own.cell_count,
                    "measure": own.measure,
                    "has_pressure": own.has_pressure,
                })
            })
            .collect();
        let barriers: Vec<_> = (self.problem.barriers.iter())
            .map(|barrier| json!({ "name": barrier.group, "multiplier": barrier.multiplier }))
            .collect();
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "cells": self.grid.cell_count(),
            "scheme": self.scheme(),
            "wells": self.solution.wells,
            "balance": balance,
            "relative_error": balance.relative_error(),
            "leak": self.solution.leak(&self.grid, setting),
            "not_met": self.leak,
            "compartments": compartments,
            "pinned": self.solution.pinned,
            "barriers": barriers,
            "solver": self.solution.solve,
            "notes": session.notes_json(),
            "seconds_total": session.elapsed().as_secs_f64(),
        })
    }
}
