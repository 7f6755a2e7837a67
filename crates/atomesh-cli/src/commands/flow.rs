//! `atomesh flow`: steady flow on a mesh, or on the mesh of an image.

use std::fmt::Write;

use atomesh_job::files::is_standard_output;
use atomesh_job::flow::{FlowExpectation, FlowRequest, FlowSummary, expect, flow_file};
use atomesh_job::{JobError, memory};

use super::standard_output::StandardOutput;
use crate::progress::Progress;
use crate::words::{say, seconds};

/// Compute steady flow on a mesh that follows an image, from sources to sinks, past faults
///
/// Solves -div(k grad p) = q. Given an image, it is meshed first, by the options of `atomesh mesh`, with
/// sources and sinks as fixed atoms; facets along which b is low are barriers. Given a mesh, its tagged features
/// are. Triangles and tetrahedra are solved on by a discontinuous Galerkin scheme, Voronoi cells (--mesh
/// voronoi) by two-point flux. Both conserve mass in every cell and let pressure jump across barriers.
///
/// The table of what flows in and out goes to standard output. Places and lengths of wells are in world
/// coordinates; units of permeability, pressure and time are the user's own. Nothing flows through a side without
/// a condition.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true, override_usage = USAGE)]
pub struct FlowArgs {
    #[command(flatten)]
    request: FlowRequest,
    #[command(flatten)]
    standard_output: StandardOutput,
    /// Print how many cells and unknowns, and how much memory and time the answer would take; write nothing
    #[arg(long, help_heading = "Run")]
    dry_run: bool,
}

const USAGE: &str = "\
atomesh flow [OPTIONS] IMAGE --source X,Y[,Z] --sink X,Y[,Z]
       atomesh flow [OPTIONS] MESH --source X,Y[,Z] --sink X,Y[,Z]";

const EXAMPLES: &str = "\
Examples:
  From an image to a picture of flow past its faults:
    atomesh flow faults.png --size 8 --source 20,20 --sink 300,300 --picture flow.png
  Faults that let a thousandth through, a well of given pressure, and the answer as files:
    atomesh flow faults.png --size 8 --multiplier 0.001 --source 20,20:pressure=10:radius=0.1 \\
      --sink 300,300:rate=2 -o flow.vtu --streamlines lines.vtp --report flow.json
  On a mesh with tags, from one side to the other, permeability from the image it was sampled from:
    atomesh sample tagged.msh --image k=permeability.npy --statistic harmonic -o rock.vtu
    atomesh flow rock.vtu --permeability k --side xmin=pressure:1 --side xmax=pressure:0 -o flow.vtu
  The same on Voronoi cells:
    atomesh flow faults.png --mesh voronoi --size 8 --source 20,20 --sink 300,300 --picture flow.png";

/// Runs the command; the text is for standard output.
///
/// # Errors
/// [`JobError`] if options make no sense, a file cannot be used, or the user ends the work.
pub fn run(mut args: FlowArgs, progress: &mut Progress) -> Result<String, JobError> {
    let output = &mut args.request.output;
    args.standard_output.format_any(&mut output.output)?;
    let holds_output = output.files().any(is_standard_output);
    if args.dry_run {
        let expected =
            progress.job(|session| expect(args.request, session), |_, _| String::new())?;
        return Ok(expectation(&expected));
    }
    let found = progress.job(
        |session| flow_file(args.request, session),
        |FlowSummary { cell_count, scheme, unknowns, method, .. }, time| {
            let time = seconds(time);
            format!("{cell_count} cells; {scheme}, {unknowns} unknowns by {method}; {time}")
        },
    )?;
    let table = table(&found);
    if !holds_output {
        return Ok(table);
    }
    // standard output holds a file: all words go elsewhere
    if !progress.is_quiet() {
        say(table.trim_end());
    }
    Ok(String::new())
}

fn expectation(expected: &FlowExpectation) -> String {
    let FlowExpectation { cell_count, cells, unknowns, memory, seconds } = expected;
    let memory = memory::text(*memory);
    format!(
        "cells    about {cell_count} {cells}\nunknowns about {unknowns}\nmemory   about {memory}\n\
         time     about {seconds:.1} s\n"
    )
}

/// The table of what flows in and out.
fn table(found: &FlowSummary) -> String {
    let mut text = String::new();
    let balance = &found.balance;
    let _ = writeln!(text, "{:<24} {:>14} {:>14} {:>14}", "", "in", "out", "pressure");
    for well in &found.wells {
        let (inward, outward) = (well.rate.max(0.0), (-well.rate).max(0.0));
        let pressure = well.wall_pressure.unwrap_or(well.cell_pressure);
        let _ =
            writeln!(text, "{:<24} {inward:>14.6e} {outward:>14.6e} {pressure:>14.6e}", well.name);
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
