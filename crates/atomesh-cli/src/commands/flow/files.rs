//! The files that `atomesh flow` writes: refused before the work if they cannot be, written after it.

use std::path::{Path, PathBuf};

use atomesh::geometry::Point;
use atomesh::watch::Phase;
use atomesh_draw::PictureFormat;
use atomesh_flow::streamlines::{Porosity, Streamline, TraceOptions, time_of_flight, trace};
use atomesh_io::atomic_file::AtomicFile;
use atomesh_io::mesh::cells::{CellData, write_cells_vtu_with};
use atomesh_io::mesh::vtu::write_broken_vtu;
use atomesh_io::mesh::{
    CellFields, FacetFlux, FluxFiles, FluxTable, MeshData, MeshFormat, MeshWriteError, Streamlines,
    write_fluxes, write_mesh, write_streamlines,
};

use super::answer::Answer;
use super::ground::{Body, failure};
use super::picture::picture;
use super::{FlowOptions, FlowOutput};
use crate::dimension::Dimension;
use crate::failure::Failure;
use crate::outputs::{Places, check_writable, picture_file, unknown_ending, write_bytes};
use crate::progress::{Progress, writing};
use crate::run_config::RunConfig;

/// Where everything goes, in formats that are known.
pub struct Files {
    output: Option<PathBuf>,
    pressure: Option<PathBuf>,
    streamlines: Option<PathBuf>,
    streamline_count: usize,
    fluxes: Option<FluxFiles>,
    report: Option<PathBuf>,
    picture: Option<(PathBuf, PictureFormat)>,
    shows_pressure: bool,
    shows_streamlines: bool,
}

impl Files {
    /// The files of a run, found writable and apart from each other and the inputs.
    ///
    /// # Errors
    /// [`Failure`] if an ending is unknown, or a file cannot be written or is taken.
    pub fn new(options: &FlowOutput, run: &RunConfig) -> Result<Self, Failure> {
        let ending = |path: &Option<PathBuf>, known: &str, wanted: &[&str]| match path {
            Some(path)
                if !path.extension().is_some_and(|e| {
                    wanted.iter().any(|wanted| e.eq_ignore_ascii_case(wanted))
                }) =>
            {
                Err(unknown_ending(path, known))
            }
            _ => Ok(()),
        };
        ending(&options.pressure_output, ".vtu", &["vtu"])?;
        ending(&options.streamlines, ".vtp", &["vtp"])?;
        ending(&options.fluxes, ".json", &["json"])?;
        if let Some(path) = &options.output {
            MeshFormat::of(path).map_err(|_| unknown_ending(path, &MeshFormat::endings()))?;
        }
        let picture = picture_file(options.picture.as_deref())?;
        let files = Self {
            output: options.output.clone(),
            pressure: options.pressure_output.clone(),
            streamlines: options.streamlines.clone(),
            streamline_count: options.streamline_count,
            fluxes: options.fluxes.as_deref().map(FluxFiles::of),
            report: options.report.clone(),
            picture,
            shows_pressure: options.picture_of == "pressure",
            shows_streamlines: options.picture_streamlines,
        };
        files.check(run)?;
        Ok(files)
    }

    fn check(&self, run: &RunConfig) -> Result<(), Failure> {
        let _guard = writing();
        let mut places = Places::taken(run.input.paths());
        let picture = self.picture.as_ref().map(|(path, _)| path);
        let paths = [
            self.output.as_ref(),
            self.pressure.as_ref(),
            self.streamlines.as_ref(),
            self.report.as_ref(),
            picture,
        ];
        let tables = self.fluxes.iter().flat_map(FluxFiles::paths);
        for path in paths.into_iter().flatten().map(PathBuf::as_path).chain(tables) {
            check_writable(path)?;
            places.take(path)?;
        }
        Ok(())
    }

    /// Refuses what Voronoi cells, with one pressure each, have no use for.
    ///
    /// # Errors
    /// [`Failure`] names the first option.
    pub fn check_for_cells(&self, flow: &FlowOptions) -> Result<(), Failure> {
        if flow.form.is_some() || flow.order.is_some() {
            let message = "--form and --order are for triangles and tetrahedra, not Voronoi cells";
            return Err(Failure::misuse(message));
        }
        if let Some(path) = &self.pressure {
            let message = "Voronoi cells have one pressure each; expected -o, which holds it";
            return Err(Failure::misuse(message).about(path));
        }
        match &self.output {
            Some(path) if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("vtu")) => {
                Err(Failure::misuse("Voronoi cells are written as .vtu").about(path))
            }
            _ => Ok(()),
        }
    }

    /// Whether the image is still needed after it was meshed.
    pub fn needs_image(&self) -> bool {
        self.picture.is_some()
    }
}

impl Files {
    /// Writes the answer.
    ///
    /// # Errors
    /// [`Failure`] if a file cannot be written, or the user ends the work.
    pub fn write<const D: usize>(
        &self,
        answer: &Answer<'_, D>,
        dimension: &Dimension<D>,
        watch: &mut Progress,
    ) -> Result<(), Failure> {
        let needs_lines = self.streamlines.is_some() || self.shows_streamlines;
        let lines = if needs_lines { self.lines(answer, watch)? } else { Vec::new() };
        let _guard = writing();
        if let Some((path, format)) = &self.picture {
            watch.begin(Phase::Draw);
            let drawn = if self.shows_streamlines { &lines[..] } else { &[] };
            let picture = picture(answer, self.shows_pressure, drawn, dimension)?;
            write_bytes(path, &picture.encode(*format).map_err(Failure::content)?)?;
        }
        watch.begin(Phase::Write);
        if let Some(path) = &self.output {
            self.write_output(path, answer, watch)?;
        }
        if let Some(path) = &self.pressure {
            write_pressure(path, answer, watch)?;
        }
        if let Some(path) = &self.streamlines {
            write_lines(path, answer, &lines, watch)?;
        }
        if let Some(files) = &self.fluxes {
            write_facets(files, answer, watch)?;
        }
        watch.finish();
        if let Some(path) = &self.report {
            write_bytes(path, format!("{:#}\n", answer.report(watch)).as_bytes())?;
        }
        Ok(())
    }

    fn lines<const D: usize>(
        &self,
        answer: &Answer<'_, D>,
        watch: &mut Progress,
    ) -> Result<Vec<Streamline<D>>, Failure> {
        let options = TraceOptions {
            count: self.streamline_count,
            porosity: Porosity::Constant(answer.porosity),
            ..TraceOptions::default()
        };
        trace(answer.grid, answer.setting, &answer.solution, &options, watch).map_err(failure)
    }

    /// Writes the mesh with what is known of its cells.
    fn write_output<const D: usize>(
        &self,
        path: &Path,
        answer: &Answer<'_, D>,
        watch: &mut Progress,
    ) -> Result<(), Failure> {
        let about = |e: MeshWriteError| write_failure(e, path);
        let ground = answer.ground;
        let permeability = answer.permeabilities();
        let porosity = Porosity::Constant(answer.porosity);
        let times = time_of_flight(answer.grid, answer.setting, &answer.solution, porosity, watch);
        let never = |t: f64| if t.is_finite() { t } else { f64::NAN };
        let times: Vec<f64> = times.map_err(failure)?.into_iter().map(never).collect();
        if let (Body::Polytopes(cells, features), Some(frame), Some(provenance)) =
            (&ground.body, &ground.frame, &ground.provenance)
        {
            let mut fields = CellFields::new(cells.cell_count())
                .with_numbers("pressure", &answer.solution.pressures)
                .and_then(|fields| fields.with_numbers("time_of_flight", &times))
                .and_then(|fields| fields.with_vectors("velocity", &answer.velocities))
                .map_err(Failure::content)?;
            if let Some(values) = &permeability {
                fields = fields.with_numbers("permeability", values).map_err(Failure::content)?;
            }
            let data = CellData { mesh: cells, features, frame, provenance };
            let mut write = || {
                let mut file = AtomicFile::create(path)?;
                write_cells_vtu_with(&mut file, &data, &fields, watch)?;
                Ok(file.commit()?)
            };
            return write().map_err(about);
        }
        let Some(mut data) = mesh_data(answer) else {
            return Err(Failure::content("Voronoi cells without a frame cannot be written"));
        };
        data = data
            .with_cell_field("pressure", &answer.solution.pressures)
            .map_err(Failure::content)?;
        data = data.with_cell_vectors("velocity", &answer.velocities).map_err(Failure::content)?;
        if let Some(values) = &permeability {
            data = data.with_cell_field("permeability", values).map_err(Failure::content)?;
        }
        data = data.with_cell_field("time_of_flight", &times).map_err(Failure::content)?;
        write_mesh(path, &data, watch).map_err(about)
    }
}

/// The mesh with its tags, and where it comes from.
fn mesh_data<'a, const D: usize>(answer: &Answer<'a, D>) -> Option<MeshData<'a, D>> {
    let ground = answer.ground;
    let Body::Simplices(mesh, tags) = &ground.body else { return None };
    let mut data = MeshData::new(mesh).with_tags(tags);
    if let Some(frame) = &ground.frame {
        data = data.with_frame(frame);
    }
    if let Some(provenance) = &ground.provenance {
        data = data.with_provenance(provenance);
    }
    Some(data)
}

/// Writes the pressure with its jumps.
fn write_pressure<const D: usize>(
    path: &Path,
    answer: &Answer<'_, D>,
    watch: &mut Progress,
) -> Result<(), Failure> {
    let about = |e: MeshWriteError| write_failure(e, path);
    let (Some(galerkin), Some(data)) = (&answer.galerkin, mesh_data(answer)) else {
        return Ok(()); // refused before the work
    };
    let data = data.with_cell_vectors("velocity", &answer.velocities).map_err(Failure::content)?;
    let at = |cell: usize, _: usize, place: &Point<D>| galerkin.pressure(cell, place);
    write_broken_vtu(path, &data, galerkin.order(), &at, watch).map_err(about)
}

fn write_lines<const D: usize>(
    path: &Path,
    answer: &Answer<'_, D>,
    lines: &[Streamline<D>],
    watch: &mut Progress,
) -> Result<(), Failure> {
    let well = |number: Option<usize>| number.map(|n| n as u32);
    let lines: Vec<_> = (lines.iter())
        .map(|line| atomesh_io::mesh::Streamline {
            points: &line.points,
            times: &line.times,
            pressures: &[],
            from: well(line.from),
            to: well(line.to),
        })
        .collect();
    let ground = answer.ground;
    let data = Streamlines {
        lines: &lines,
        frame: ground.frame.as_ref(),
        provenance: ground.provenance.as_ref(),
    };
    write_streamlines(path, &data, watch).map_err(|e| write_failure(e, path))
}

fn write_facets<const D: usize>(
    files: &FluxFiles,
    answer: &Answer<'_, D>,
    watch: &mut Progress,
) -> Result<(), Failure> {
    let mut names = vec![""; answer.grid.facets().len()];
    for set in answer.grid.sets() {
        set.facets.iter().for_each(|&facet| names[facet as usize] = &set.name);
    }
    let multipliers = answer.setting.multipliers();
    let facets: Vec<FacetFlux<'_, D>> = (answer.grid.facets().iter().enumerate())
        .map(|(number, facet)| FacetFlux {
            cell: facet.cell,
            neighbour: facet.neighbour,
            area: facet.area,
            centroid: facet.centroid,
            flux: answer.solution.fluxes[number],
            multiplier: multipliers[number],
            group: names[number],
        })
        .collect();
    let ground = answer.ground;
    let table = FluxTable {
        facets: &facets,
        frame: ground.frame.as_ref(),
        provenance: ground.provenance.as_ref(),
    };
    write_fluxes(files, &table, watch).map_err(|e| write_failure(e, &files.head))
}

fn write_failure(error: MeshWriteError, path: &Path) -> Failure {
    match error {
        MeshWriteError::Cancelled(_) => Failure::cancelled(),
        _ => Failure::content(error).about(path),
    }
}
