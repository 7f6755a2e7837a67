//! The studio: see an image and its mesh, tune, paint, edit atoms, and take flow from it, in a browser page.
//!
//! The page is served on the loopback by one process, which holds the truth; nothing leaves the machine.
//!
//! - [`security`]: who may speak to it. Every request is asked, before any routing.
//! - [`server`], `routes`, `socket`: connections, files, commands.
//! - [`protocol`], [`gesture`]: what page and engine say to each other, and what a hand does.
//! - `engine`: one thread that owns the session; the newest request counts, work under way is ended by its watch.
//! - [`session`], [`log`]: what was done, in order; undo, redo, and a log that survives a kill. [`replay`] makes of it the
//!   bytes that the page exports.
//! - `model`: an image, options, paint, edited atoms, barriers, wells and regions, and the mesh made of them, stage by stage.
//! - `view`, `exhibit`, `slice_cells`, `region_view`: what is seen of it, as frames and slices.
//! - `page`: the page's files, plain modules without a build.
//!
//! ```no_run
//! use std::path::Path;
//! use std::time::Duration;
//!
//! use atomesh::watch::Silent;
//! use atomesh_job::options::RunConfig;
//! use atomesh_studio::{Server, Session};
//!
//! let mut session = Session::open(Path::new("faults-studio"), &mut Silent)?;
//! let mut run = RunConfig::default();
//! run.input.image = Some("faults.png".into());
//! session.open_file(run, &mut Silent)?;
//! let server = Server::new(session, Duration::from_secs(600))?;
//! println!("{}", server.address());
//! server.run(|| false)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod drop_file;
mod engine;
mod exhibit;
pub mod gesture;
mod hub;
pub mod log;
mod model;
mod page;
pub mod protocol;
mod region_view;
pub mod replay;
mod routes;
pub mod security;
pub mod server;
pub mod session;
mod slice_cells;
mod socket;
mod view;

pub use server::Server;
pub use session::Session;
