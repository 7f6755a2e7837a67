//! The answer in words and numbers.

use std::fmt::Write as _;

use atomesh_flow::dg::DgSolution;
use atomesh_flow::{FlowGrid, Setting, Solution};
use serde_json::json;

use super::ground::Ground;
use crate::progress::Progress;

/// What was computed.
pub struct Answer<'a, const D: usize> {
    /// What it was computed on.
    pub ground: &'a Ground<D>,
    /// Cells and facets.
    pub grid: &'a FlowGrid<D>,
    /// The problem.
    pub setting: &'a Setting<'a, D>,
    /// Pressures and fluxes.
    pub solution: Solution<D>,
    /// The mean velocity of each cell.
    pub velocities: Vec<[f64; D]>,
    /// The answer of the discontinuous Galerkin scheme.
    pub galerkin: Option<DgSolution<D>>,
    /// The share of the volume that the fluid fills.
    pub porosity: f64,
}

impl<const D: usize> Answer<'_, D> {
    /// Everything in numbers.
    pub fn report(&self, watch: &Progress) -> serde_json::Value {
        let balance = self.solution.balance(self.grid);
        let compartments: Vec<_> = (self.setting.compartments().iter().enumerate())
            .map(|(number, own)| {
                json!({
                    "compartment": number + 1,
                    "cells": own.cell_count,
                    "measure": own.measure,
                    "has_pressure": own.has_pressure,
                })
            })
            .collect();
        let barriers: Vec<_> = (self.setting.problem().barriers.iter())
            .map(|barrier| json!({ "name": barrier.group, "multiplier": barrier.multiplier }))
            .collect();
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "cells": self.grid.cell_count(),
            "scheme": self.scheme(),
            "wells": self.solution.wells,
            "balance": balance,
            "relative_error": balance.relative_error(),
            "leak": self.solution.leak(self.grid, self.setting),
            "compartments": compartments,
            "pinned": self.solution.pinned,
            "barriers": barriers,
            "solver": self.solution.solve,
            "seconds_total": watch.elapsed().as_secs_f64(),
        })
    }

    /// What was solved, in one line.
    pub fn summary(&self, watch: &Progress) -> String {
        let solve = &self.solution.solve;
        format!(
            "{} cells; {}, {} unknowns by {}; {:.2} s",
            self.grid.cell_count(),
            self.scheme(),
            solve.unknowns,
            solve.method,
            watch.elapsed().as_secs_f64()
        )
    }

    /// The permeability of each cell, where it is one number.
    pub fn permeabilities(&self) -> Option<Vec<f64>> {
        let permeability = self.setting.permeability();
        (0..self.grid.cell_count()).map(|cell| permeability.scalar(cell)).collect()
    }

    fn scheme(&self) -> String {
        match &self.galerkin {
            Some(galerkin) => format!("discontinuous Galerkin of order {}", galerkin.order()),
            None => "two-point flux".to_string(),
        }
    }

    /// The table of what flows in and out.
    pub fn table(&self) -> String {
        let mut text = String::new();
        let balance = self.solution.balance(self.grid);
        let _ = writeln!(text, "{:<24} {:>14} {:>14} {:>14}", "", "in", "out", "pressure");
        for well in &self.solution.wells {
            let (inward, outward) = (well.rate.max(0.0), (-well.rate).max(0.0));
            let pressure = well.wall_pressure.unwrap_or(well.cell_pressure);
            let _ = writeln!(
                text,
                "{:<24} {inward:>14.6e} {outward:>14.6e} {pressure:>14.6e}",
                well.name
            );
        }
        let mut line = |name: &str, inward: f64, outward: f64| {
            let _ = writeln!(text, "{name:<24} {inward:>14.6e} {outward:>14.6e}");
        };
        line("boundary", balance.boundary_in, balance.boundary_out);
        let inward = balance.wells_in + balance.boundary_in + balance.source.max(0.0);
        let outward = balance.wells_out + balance.boundary_out + (-balance.source).max(0.0);
        line("sum", inward, outward);
        let _ = writeln!(text, "mass balance error {:.1e}", balance.relative_error());
        text
    }
}
