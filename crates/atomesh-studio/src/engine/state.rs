//! The state in words and numbers.

use atomesh::run::Outcome;
use atomesh::synth::Scene;
use atomesh::watch::Watch;
use atomesh_io::image::ImageFormat;
use atomesh_job::JobError;
use atomesh_job::mesh::refusal;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::gesture::PaintedField;
use crate::model::{MOST_PARTS, MOST_REGIONS, Model, each};
use crate::session::Session;

/// What the engine knows beside the session.
pub struct Told<'a> {
    pub revision: u32,
    pub shown: u32,
    pub image: u32,
    pub atoms_revision: u32,
    pub is_busy: bool,
    pub has_atoms: bool,
    /// How many parts are shown, once they are made.
    pub parts: Option<usize>,
    pub figures: &'a Value,
    pub hash: Option<&'a str>,
    pub error: Option<&'a str>,
}

/// Everything that the page shows as text and controls.
pub fn state(session: &Session, told: &Told<'_>) -> Value {
    let [undo, redo] = session.counts();
    json!({
        "revision": told.revision,
        "shown": told.shown,
        "image": told.image,
        "atomsRevision": told.atoms_revision,
        "hasAtoms": told.has_atoms,
        "parts": told.parts,
        "busy": told.is_busy,
        "error": told.error,
        "undo": undo,
        "redo": redo,
        "session": session.folder().display().to_string(),
        "hash": told.hash,
        "figures": told.figures,
        "scenes": Scene::NAMES,
        "model": session.model().map(|model| each!(model, model => of_model(model))),
    })
}

fn of_model<const D: usize>(model: &Model<D>) -> Value {
    let image = model.image().unwrap_or(&model.opened().shown.image);
    let frame = image.frame();
    let grid = model.grid();
    let stages = model.stages();
    let outcome = stages.outcome();
    let in_samples = |p: &[f64; D]| (0..D).map(|k| p[k] / grid.step[k]).collect::<Vec<_>>();
    let wells: Vec<Value> = (model.wells().iter())
        .map(|well| json!({ "kind": well.kind, "at": in_samples(&well.at) }))
        .collect();
    let flow = stages.flow();
    let distance = stages.prepared().map(|prepared| {
        let d = prepared.distance();
        json!({ "least": d.least(), "mean": d.mean(), "greatest": d.greatest() })
    });
    let warnings =
        outcome.as_ref().map(|o| o.warnings()).or(stages.prepared().map(|p| p.warnings()));
    let warnings = warnings.unwrap_or_default().iter().map(ToString::to_string);
    json!({
        "name": model.opened().name,
        "dimension": D,
        "shape": frame.shape().as_slice(),
        "spacing": frame.spacing().as_slice(),
        "origin": frame.origin().as_slice(),
        "direction": frame.direction().iter().map(|row| row.to_vec()).collect::<Vec<_>>(),
        "step": grid.step.as_slice(),
        "units": model.opened().shown.world.units,
        "samples": {
            "least": model.opened().range.min,
            "greatest": model.opened().range.max,
            "bins": model.opened().bins.as_slice(),
        },
        "options": model.run(),
        "distance": distance,
        "estimate": stages.prepared().map(|prepared| prepared.estimate()),
        "notes": model.opened().notes.iter().cloned().chain(warnings).collect::<Vec<_>>(),
        "painted": {
            "size": model.painted(PaintedField::Size).is_some(),
            "weight": model.painted(PaintedField::Weight).is_some(),
        },
        "zUp": is_z_up(model),
        "edited": model.is_edited(),
        "voronoi": model.run().is_voronoi(),
        "wells": wells,
        "regions": stages.regions().map(|on_mesh| on_mesh.regions.clone()).unwrap_or_default(),
        "regionNames": (1..=MOST_REGIONS).map(|region| model.regions().name(region)).collect::<Vec<_>>(),
        "hasRegions": model.regions().is_any(),
        "mostParts": stages.clustered().map_or(MOST_PARTS, |clustered| clustered.most()),
        "flow": flow.as_ref().map(|flow| json!({
            "rates": flow.rates,
            "imbalance": flow.imbalance,
            "lines": flow.lines.len(),
            "facets": flow.facets.len(),
            "notes": flow.notes,
        })),
        "recorded": stages.playback().map_or(0, |playback| playback.frames.len()),
    })
}

/// Whether z grows upwards on the screen, as `--picture` has it.
fn is_z_up<const D: usize>(model: &Model<D>) -> bool {
    let format = model.run().input.shown().and_then(ImageFormat::of);
    let direction = model.opened().shown.image.frame().direction();
    format.is_some_and(ImageFormat::z_is_height) && direction[D - 1][D - 1] > 0.0
}

/// The figures of the mesh: shape, and how it follows features.
///
/// # Errors
/// [`JobError`] if it cannot be measured, or the watch ends the work.
pub fn figures<const D: usize>(
    model: &mut Model<D>,
    watch: &mut dyn Watch,
) -> Result<Value, JobError> {
    let outcome = model.refresh(watch)?;
    let refused = |e| refusal(model.run(), e);
    if let Some(report) = outcome.cells_report(watch).map_err(refused)? {
        return Ok(json!({
            "points": report.shape.points,
            "cells": report.shape.cells,
            "faces": report.shape.faces,
            "recall": report.alignment.recall,
        }));
    }
    let report = outcome.report(watch).map_err(refused)?;
    Ok(json!({
        "points": report.shape.points,
        "cells": report.shape.cells,
        "quality": report.shape.q_mean,
        "least": report.shape.q_min,
        "angle": report.shape.angle_min,
        "recall": report.alignment.recall,
    }))
}

/// What tells a mesh from others: SHA-256 of its points and cells, the first 16 digits.
pub fn hash<const D: usize>(outcome: &Outcome<D>) -> String {
    let mut hash = Sha256::new();
    let mesh = outcome.mesh();
    for p in mesh.points() {
        p.iter().for_each(|x| hash.update(x.to_bits().to_le_bytes()));
    }
    mesh.corners().iter().for_each(|corner| hash.update(corner.to_le_bytes()));
    hash.finalize()[..8].iter().map(|byte| format!("{byte:02x}")).collect()
}
