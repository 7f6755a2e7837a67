//! How does one see the papers happen? Every figure of Hale, "Atomic images: a method for meshing digital images" (2001),
//! and of its sequel on Voronoi meshes (2002), made by the program's own parts.
//!
//! `cargo run --release --example paper -- OUT`
//!
//! Writes `OUT/figure-1.png` and so on, and `OUT/index.md`, which has for each the options it was made with and a number
//! that was checked. Images are drawn by the program; where the variable `ATOMESH_DATA` names a folder with the papers'
//! images, those are taken.

mod book;
mod medical;
mod phantom;
mod plane;
mod potential;
mod space;
mod units;
mod voronoi;

use std::path::PathBuf;

use book::{Book, Failure};

fn main() -> Result<(), Failure> {
    let out = std::env::args_os().nth(1).ok_or("expected a folder to write to")?;
    let data = std::env::var_os("ATOMESH_DATA").map(PathBuf::from);
    let mut book = Book::new(PathBuf::from(out), data)?;
    plane::faults(&mut book)?;
    potential::pair_functions(&mut book)?;
    potential::one_atom(&mut book)?;
    plane::lattice(&mut book)?;
    plane::flow(&mut book)?;
    space::volume(&mut book)?;
    medical::torso(&mut book)?;
    voronoi::along_faults(&mut book)?;
    voronoi::in_space(&mut book)?;
    units::section(&mut book)?;
    book.finish()
}
