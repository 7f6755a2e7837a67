//! What every shell of atomesh does: options, inputs, outputs, and the jobs between them.
//!
//! A shell (a command, a Python module, a server) turns its users' wishes into options, calls a job, and puts the
//! answer into words. Everything in between is here, once:
//!
//! - [`options`]: each option with its name, help, type and range; how options from several places are merged, and
//!   how a run is kept. With the feature `clap` they are also the arguments of a command.
//! - [`values`]: how values such as `6..18` or `120,40:rate=2` are spelt.
//! - [`images`], [`mesh_file`]: reading, with what a reader took for granted as notes.
//! - jobs, in memory and from file to file: [`mesh`](mod@mesh), [`flow`](mod@flow), [`features`](mod@features),
//!   [`clusters`](mod@clusters), [`surfaces`], [`sample`], [`export`], [`enhance`], [`measure`]. Files to write are checked before the work and
//!   appear whole or not at all.
//! - [`memory`]: how much is left, how much was used.
//!
//! Nothing here prints, ends the process or installs a signal handler. A job takes a [`Session`], which passes
//! phases on to a [`Watch`](atomesh::watch::Watch) that may end the work, keeps their times, and collects notes. A
//! [`JobError`] says what kind of reason it is, about which file, and what the user might do.
//!
//! From an image in memory to the flow past its dark row, in one call:
//!
//! ```
//! use atomesh::image::{Frame, Image, Samples};
//! use atomesh::watch::Silent;
//! use atomesh_job::flow::{FlowOptions, flow};
//! use atomesh_job::mesh::MeshImages;
//! use atomesh_job::options::{LatticeOptions, RunConfig};
//! use atomesh_job::{Dimension, Session};
//!
//! let mut grey = vec![200u8; 64 * 48];
//! grey[24 * 64 + 16..24 * 64 + 48].fill(10); // a dark row that ends within the image
//! let image = Image::new(Frame::new([64, 48])?, Samples::U8(grey.into()))?;
//!
//! let lattice = LatticeOptions { size: Some("6".parse()?), ..Default::default() };
//! let run = RunConfig { lattice, ..Default::default() };
//! let options = FlowOptions {
//!     source: vec!["32,8:rate=2".parse()?],
//!     sink: vec!["32,40".parse()?],
//!     ..Default::default()
//! };
//! let mut watch = Silent;
//! let mut session = Session::new(&mut watch);
//! let images = MeshImages::new(image);
//! let plane = Dimension::plane();
//! let answer = flow(&run, &options, images, &plane, &mut session)?;
//!
//! let balance = answer.balance(&plane.flow);
//! assert!((balance.wells_in - 2.0).abs() < 1e-9 && balance.relative_error() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod clusters;
mod dimension;
pub mod enhance;
mod error;
pub mod export;
pub mod features;
pub mod files;
pub mod flow;
pub mod images;
mod in_samples;
mod in_space;
mod labels;
pub mod measure;
pub mod memory;
pub mod mesh;
pub mod mesh_file;
pub mod options;
mod page;
mod permeability;
pub mod sample;
mod session;
pub mod surfaces;
pub mod values;

pub use dimension::Dimension;
pub use error::{ErrorKind, JobError};
pub use session::{Listener, Note, NoteKind, Session};
