//! A session's log, done again without a page.

use std::path::Path;

use atomesh::watch::Watch;
use atomesh_job::JobError;

use crate::session::Session;

/// Does again what a log holds, and writes the mesh that comes out: the bytes that the page's export gives.
///
/// # Errors
/// [`JobError`] if the log or an image cannot be read or is not what it was, nothing was opened, the mesh cannot be written,
/// or the watch ends the work.
pub fn replay(log: &Path, output: &Path, watch: &mut dyn Watch) -> Result<(), JobError> {
    let mut session = Session::replay(log, watch)?;
    if session.source().is_none() {
        return Err(JobError::content("nothing was opened").about(log));
    }
    session.write(output, watch)
}
