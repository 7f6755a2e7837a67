//! What flows where, and how that is computed.

use std::path::{Path, PathBuf};

use atomesh_flow::dg::{DgOptions, Form};
use atomesh_flow::solve::{SolveMethod, SolveOptions};

use crate::error::JobError;
use crate::memory;
use crate::values::{BarrierSpec, SideSpec, WellSpec};
#[cfg(feature = "clap")]
use crate::values::{named, number_in};

/// What flows where.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct FlowOptions {
    /// A source: its place, and if wanted :rate=Q (default 1) or :pressure=P, and :radius=R, which a pressure needs.
    /// May be given again
    #[cfg_attr(
        feature = "clap",
        arg(long, value_name = "X,Y[,Z][:KEY=VALUE]", allow_hyphen_values = true)
    )]
    pub source: Vec<WellSpec>,
    /// A sink, likewise; sinks without rate or pressure share what the other wells bring
    #[cfg_attr(
        feature = "clap",
        arg(long, value_name = "X,Y[,Z][:KEY=VALUE]", allow_hyphen_values = true)
    )]
    pub sink: Vec<WellSpec>,
    /// Pressure, or flux into the domain per unit of area, on tagged facets of the boundary such as xmin. May be
    /// given again. Default: nothing flows through the boundary
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME=pressure:P|flux:F"))]
    pub side: Vec<SideSpec>,
    /// Facets along which the mean of b is at most this, -1 to 0, are faults; for images only. With --mesh voronoi,
    /// faces along which the mean of |b| is at least as much
    #[cfg_attr(feature = "clap", arg(long, value_name = "B", default_value_t = Self::default().below,
        value_parser = number_in(-1.0, 0.0, "a number from -1 to 0")))]
    pub below: f64,
    /// Share of the flow that faults, all groups named feature-N, let through, 0 (sealed) to 1 (open)
    #[cfg_attr(feature = "clap", arg(long, value_name = "M", default_value_t = Self::default().multiplier,
        value_parser = number_in(0.0, 1.0, "a number from 0 to 1")))]
    pub multiplier: f64,
    /// The same for one group of facets. May be given again
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME=M"))]
    pub barrier: Vec<BarrierSpec>,
    /// Permeability: a number above 0; one for each axis, KX,KY or KX,KY,KZ; a tensor Kxx,Kxy,Kyy or
    /// Kxx,Kxy,Kxz,Kyy,Kyz,Kzz; or the name of a cell field of the mesh
    #[cfg_attr(feature = "clap", arg(long, value_name = "K | NAME", default_value_t = Self::default().permeability))]
    pub permeability: String,
    /// Image of permeabilities, averaged over each cell
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE", conflicts_with = "permeability"))]
    pub permeability_image: Option<PathBuf>,
    /// How it is averaged
    #[cfg_attr(feature = "clap", arg(long, value_name = "MEAN", default_value_t = Self::default().permeability_mean,
        requires = "permeability_image", value_parser = ["mean", "harmonic", "geometric"]))]
    pub permeability_mean: String,
    /// Share of the volume that the fluid fills, above 0, at most 1; for times of flight
    #[cfg_attr(feature = "clap", arg(long, value_name = "PHI", default_value_t = Self::default().porosity,
        value_parser = number_in(1e-12, 1.0, "a number above 0, at most 1")))]
    pub porosity: f64,
    /// Form of the discontinuous Galerkin scheme: symmetric interior penalty (sipg), or that of Oden, Babuska and
    /// Baumann (obb), of order 2 or more. Default: sipg
    #[cfg_attr(feature = "clap", arg(long, value_name = "FORM", value_parser = named::<Form>(&["sipg", "obb"])))]
    pub form: Option<Form>,
    /// Degree of the pressure in a cell, 1 to 3. Default: 2
    #[cfg_attr(feature = "clap", arg(long, value_name = "ORDER", value_parser = clap::value_parser!(u8).range(0..=9)))]
    pub order: Option<u8>,
    /// How the equations are solved
    #[cfg_attr(feature = "clap", arg(long, value_name = "METHOD", default_value = "auto",
        value_parser = named::<SolveMethod>(&["auto", "direct", "iterative"])))]
    pub solver: SolveMethod,
    /// Residual that iteration may leave, relative to the right-hand side, 1e-15 to 0.01
    #[cfg_attr(feature = "clap", arg(long, value_name = "SHARE", default_value_t = Self::default().solver_tolerance,
        value_parser = number_in(1e-15, 1e-2, "a number from 1e-15 to 0.01")))]
    pub solver_tolerance: f64,
}

impl Default for FlowOptions {
    fn default() -> Self {
        Self {
            source: Vec::new(),
            sink: Vec::new(),
            side: Vec::new(),
            below: -0.2,
            multiplier: 0.0,
            barrier: Vec::new(),
            permeability: "1".into(),
            permeability_image: None,
            permeability_mean: "geometric".into(),
            porosity: 1.0,
            form: None,
            order: None,
            solver: SolveMethod::Auto,
            solver_tolerance: SolveOptions::default().tolerance,
        }
    }
}

impl FlowOptions {
    /// All wells with the options that name them, sources first.
    pub(super) fn wells(&self) -> impl Iterator<Item = (&'static str, &WellSpec)> {
        let sources = self.source.iter().map(|well| ("source", well));
        sources.chain(self.sink.iter().map(|well| ("sink", well)))
    }

    /// Refuses what Voronoi cells, with one pressure each, have no use for.
    pub(super) fn check_for_voronoi(&self) -> Result<(), JobError> {
        if self.form.is_none() && self.order.is_none() {
            return Ok(());
        }
        let message = "--form and --order are for triangles and tetrahedra, not Voronoi cells";
        Err(JobError::misuse(message))
    }

    pub(super) fn solve(&self) -> SolveOptions {
        SolveOptions {
            method: self.solver,
            tolerance: self.solver_tolerance,
            memory: memory::available().unwrap_or(u64::MAX) / 10 * 8,
            ..SolveOptions::default()
        }
    }

    pub(super) fn galerkin(&self) -> DgOptions {
        let default = DgOptions::default();
        let form = self.form.unwrap_or(default.form);
        let order = self.order.map_or(default.order, usize::from);
        DgOptions { form, order, solve: self.solve(), ..default }
    }
}

/// The files that are written.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct FlowOutputOptions {
    /// Mesh with pressure, velocity, permeability and mean time of flight from the inflow (NaN where nothing comes)
    /// of each cell: .vtu; triangles and tetrahedra also .msh .msh2 .vtk .npz
    #[cfg_attr(feature = "clap", arg(short, long, value_name = "MESH"))]
    pub output: Option<PathBuf>,
    /// Pressure as the scheme has it, with its jumps: a .vtu whose points are repeated for each cell
    #[cfg_attr(feature = "clap", arg(long, value_name = "VTU"))]
    pub pressure_output: Option<PathBuf>,
    /// Streamlines from source to sink, with times of flight, as .vtp
    #[cfg_attr(feature = "clap", arg(long, value_name = "VTP"))]
    pub streamlines: Option<PathBuf>,
    /// Number of streamlines, shared among sources by their rates
    #[cfg_attr(feature = "clap", arg(long, value_name = "COUNT", default_value_t = Self::default().streamline_count))]
    pub streamline_count: usize,
    /// What flows through each facet: a head as JSON, and beside it NAME-facets.csv
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME.json"))]
    pub fluxes: Option<PathBuf>,
    /// Wells, compartments, mass balance and how the equations were solved, as JSON
    #[cfg_attr(feature = "clap", arg(long, value_name = "JSON"))]
    pub report: Option<PathBuf>,
    /// Picture of the flow, .png or .svg: mesh, faults bold, flow vectors; in 3-D, on the three slices through the
    /// middle
    #[cfg_attr(feature = "clap", arg(long, value_name = "PICTURE"))]
    pub picture: Option<PathBuf>,
    /// What the picture shows behind the mesh
    #[cfg_attr(feature = "clap", arg(long, value_name = "WHAT", default_value_t = Self::default().picture_of,
        value_parser = ["image", "pressure"]))]
    pub picture_of: String,
    /// Draw streamlines too
    #[cfg_attr(feature = "clap", arg(long))]
    pub picture_streamlines: bool,
}

impl FlowOutputOptions {
    /// All files that are written, without tables beside them.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        let Self { output, pressure_output, streamlines, fluxes, report, picture, .. } = self;
        let all = [output, pressure_output, streamlines, fluxes, report, picture];
        all.into_iter().flatten().map(PathBuf::as_path)
    }
}

impl Default for FlowOutputOptions {
    fn default() -> Self {
        Self {
            output: None,
            pressure_output: None,
            streamlines: None,
            streamline_count: 60,
            fluxes: None,
            report: None,
            picture: None,
            picture_of: "image".into(),
            picture_streamlines: false,
        }
    }
}
