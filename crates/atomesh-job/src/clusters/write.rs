//! Writing parts: as regions of the mesh, as a picture, in numbers.

use atomesh::image::Image;
use atomesh::watch::Phase;
use atomesh_draw::Style;
use atomesh_io::output_group::OutputGroup;

use super::{ClusteredMesh, Clusters, ClustersRequest, picture};
use crate::dimension::Dimension;
use crate::error::JobError;
use crate::files::{self, PictureFile, write_bytes};
use crate::images::is_z_up;
use crate::mesh_file;
use crate::session::Session;

/// Parts of a mesh, to be written.
pub(super) struct Writing<'a, const D: usize, M> {
    pub request: &'a ClustersRequest,
    pub picture: Option<PictureFile>,
    pub loaded: &'a M,
    /// The image that the parts are drawn over.
    pub image: Option<Image<D>>,
    pub found: &'a Clusters,
}

impl<const D: usize, M: ClusteredMesh<D>> Writing<'_, D, M> {
    /// Writes the files of the request.
    ///
    /// # Errors
    /// [`JobError`] names the file that cannot be written.
    pub fn write(
        &self,
        group: &mut OutputGroup,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        let Self { request, loaded, found, .. } = *self;
        if let Some(file) = &self.picture {
            session.begin(Phase::Draw);
            let (image, view) = (self.image.as_ref(), request.view.unwrap_or_default());
            let shown = picture::Shown { parts: &found.parts, image, view };
            let drawn = picture::picture(loaded, &shown, &self.style(), dimension)?;
            file.staged(group)?.write(&drawn)?;
        }
        session.begin(Phase::Write);
        if let (Some(path), Some(named)) =
            (&files::stage_any(&request.output, group)?, &request.output)
        {
            loaded.write([path, named], &found.parts, dimension, session)?;
        }
        if let Some(path) = &files::stage_any(&request.json, group)? {
            let mut report = found.report(loaded);
            report["notes"] = session.notes_json();
            write_bytes(path, format!("{report:#}\n").as_bytes())?;
        }
        Ok(())
    }

    fn style(&self) -> Style {
        let units = mesh_file::units(self.loaded.provenance());
        let frame = self.image.as_ref().map(Image::frame).or(self.loaded.frame());
        let z_up = frame.is_some_and(|frame| is_z_up(self.request.source(), frame));
        let units = self.request.units.or(units).unwrap_or_default();
        Style { units, z_up, ..Style::default() }
    }
}
