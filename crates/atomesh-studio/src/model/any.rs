//! A model of the plane or of space: the one place where the two part.

use std::path::Path;

use atomesh::watch::Watch;
use atomesh_job::JobError;

use super::Model;
use crate::gesture::Gesture;

/// A model of either dimension.
#[derive(Clone)]
pub enum AnyModel {
    /// In the plane.
    Flat(Model<2>),
    /// In space.
    Volume(Model<3>),
}

/// Does the same with a model of either dimension.
macro_rules! each {
    ($any:expr, $model:ident => $what:expr) => {
        match $any {
            $crate::model::AnyModel::Flat($model) => $what,
            $crate::model::AnyModel::Volume($model) => $what,
        }
    };
}
pub(crate) use each;

impl std::fmt::Debug for AnyModel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        each!(self, model => f.debug_struct("AnyModel").field("name", &model.opened().name).finish())
    }
}

impl AnyModel {
    /// [`Model::apply`].
    ///
    /// # Errors
    /// As there.
    pub fn apply(&mut self, gesture: &Gesture, watch: &mut dyn Watch) -> Result<(), JobError> {
        each!(self, model => model.apply(gesture, watch))
    }

    /// [`Model::write`].
    ///
    /// # Errors
    /// As there.
    pub fn write(&mut self, path: &Path, watch: &mut dyn Watch) -> Result<(), JobError> {
        each!(self, model => model.write(path, watch))
    }

    /// [`Model::command_line`].
    ///
    /// # Errors
    /// As there.
    pub fn command_line(
        &mut self,
        folder: &Path,
        watch: &mut dyn Watch,
    ) -> Result<Vec<String>, JobError> {
        each!(self, model => model.command_line(folder, watch))
    }

    /// [`Stages::made_count`](super::stages::Stages::made_count).
    pub fn made_count(&self) -> usize {
        each!(self, model => model.stages().made_count())
    }

    /// Bytes that a copy may come to hold alone, about: atoms under edit, paint and regions.
    pub fn bytes(&self) -> usize {
        /// Bytes of an atom with its cells in an editor, in space.
        const ATOM: usize = 600;
        each!(self, model => {
            let atoms = model.edited().map_or(0, |edited| edited.atoms().len());
            let paint = usize::from(model.is_painted()) * 8 * model.grid().sample_count();
            ATOM * atoms + paint + model.regions().bytes()
        })
    }
}
