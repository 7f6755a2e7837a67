//! Runs single steps of atomesh on the work that the peers get, for `bench/run.py`.
//!
//! Each command does its work once to warm up where that is cheap, then measures it, and prints one line
//! of JSON: wall seconds, CPU seconds of all threads, and what was done. Points and arrays come from raw
//! little-endian files, the ones that the peers read, and meshes go to such files, so that one program
//! judges all. Reading and writing are not in the figures.

mod clock;
mod connect;
mod energy;
mod graded;
mod raw;

use std::error::Error;

use clap::{Parser, Subcommand};

/// What went wrong, in words: this program only reports it.
type Failure = Box<dyn Error + Send + Sync>;

/// Steps of atomesh, measured.
#[derive(Debug, Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    step: Step,
    /// Threads to use.
    #[arg(long, global = true, default_value_t = 1)]
    threads: usize,
}

#[derive(Debug, Subcommand)]
enum Step {
    /// Energy and gradient of a lattice.
    Energy(energy::Energy),
    /// Delaunay mesh of given points.
    Delaunay(connect::Connect),
    /// Graded triangles from a velocity model in memory.
    Graded(graded::Graded),
}

fn main() -> Result<(), Failure> {
    let cli = Cli::parse();
    rayon::ThreadPoolBuilder::new().num_threads(cli.threads).build_global()?;
    let answer = match cli.step {
        Step::Energy(energy) => energy.run(),
        Step::Delaunay(connect) => connect.run(),
        Step::Graded(graded) => graded.run(),
    }?;
    println!("{answer}");
    Ok(())
}
