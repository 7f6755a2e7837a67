//! Where meshes come from.

use atomesh::image::Frame;
use atomesh_io::mesh::Provenance;

/// A frame as "meta" has it.
fn frame_json<const D: usize>(frame: &Frame<D>) -> serde_json::Value {
    let rows: Vec<Vec<f64>> = frame.direction().iter().map(|row| row.to_vec()).collect();
    serde_json::json!({
        "shape": frame.shape().to_vec(),
        "spacing": frame.spacing().to_vec(),
        "origin": frame.origin().to_vec(),
        "direction": rows,
    })
}

/// Where a mesh comes from, as `meta` has it.
pub fn meta<const D: usize>(
    frame: Option<&Frame<D>>,
    provenance: Option<&Provenance>,
) -> serde_json::Value {
    let mut all = serde_json::Map::new();
    if let Some(frame) = frame {
        all.insert("frame".into(), frame_json(frame));
    }
    if let Some(made) = provenance {
        all.insert("version".into(), made.version.clone().into());
        all.insert("options".into(), made.options.clone());
        all.insert("seed".into(), made.seed.into());
        all.insert("units".into(), made.units.clone().into());
    }
    all.into()
}
